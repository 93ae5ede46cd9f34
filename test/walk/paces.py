"""Gaits and stands that tests of walks lead from one to another."""

import numpy as np
from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.references.profile import profile_of
from walk_optimizer.transition.standing import standing_pose
from walk_optimizer.walk.stand import StandProfile

STANDING = standing_pose(WalkerParameters(), 0.1, 0.05)
STAND = StandProfile(STANDING)
SLOW = profile_of(with_refinement(made_up_gait(points=20), intervals=20))
FAST = profile_of(with_refinement(made_up_gait(speed=0.8, points=30, torque=3.0), intervals=20))


def landing_jump(profile):
    """How far the velocity of a gait's own solution jumps where its step ends, in [rad/s]."""
    before, after = profile.sample(profile.step_time).qdot, profile.sample(0.0).qdot
    exchanged = before[[0, 1, 4, 5, 2, 3]]
    return float(np.abs(exchanged - after)[2:].max())
