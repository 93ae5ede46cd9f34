"""A walk: stands, gaits and the steps between them, moved on by a clock, and what joints need for it.

Does not own which command counts, nor ROS.
"""
