"""Figures, readable in black and white. They need matplotlib: the extra `figures`.

Owns how a gait looks. Does not own what is in it: everything drawn is computed elsewhere.
"""

from walk_optimizer.figures.canvas import picture_target
from walk_optimizer.figures.gait_page import gait_picture

__all__ = ["gait_picture", "picture_target"]
