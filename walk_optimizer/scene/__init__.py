"""Where the walker is and what it does, found from its joint references: what displays show.

Owns the floating base, which joint references don't tell, the paths of the feet and the ground reaction.
Does not own how they are drawn, and knows no ROS. Points lie in the optimiser's plane: x forward, y up.
"""
