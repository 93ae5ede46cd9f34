"""The walker as a robot: links, joints and frames in ROS's axes, and its URDF. No ROS is imported.

Owns how the optimiser's plane lies in space: its x is ROS's x (forward), its y is ROS's z (up), and a
positive angle turns a leg forward, so about -y (REP 103).
"""
