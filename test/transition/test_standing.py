"""The stand is at rest: statics computed here once more, from sums over the masses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walk_optimizer.errors import ConfigurationError, InvalidRequestError
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.transition.settings import TransitionSettings
from walk_optimizer.transition.standing import Standing, standing_pose

WALKER = WalkerParameters()


def unbalanced(stand: Standing) -> float:
    """Return the largest generalized force in [N] or [N m] that is left over."""
    mechanics = mechanics_at(stand.walker, stand.spring, stand.q[:, None], np.zeros((6, 1)))
    return float(np.abs(mechanics.momentum_rate(stand.torques[:, None], stand.forces[:, None])).max())


@given(st.floats(0.02, 1.2), st.floats(0.01, 0.8), st.floats(0, 600), st.floats(2.0, np.pi))
@settings(max_examples=30, deadline=None)
def test_every_pose_is_held_by_its_torques(distance, bend, stiffness, equilibrium):
    stand = standing_pose(WALKER, distance, bend).on(KneeSpring(stiffness, equilibrium))
    assert unbalanced(stand) < 1e-9 * WALKER.weight
    assert stand.feet_distance == pytest.approx(distance, abs=1e-12)
    assert np.all(np.pi - stand.q[[3, 5]] >= bend - 1e-12)


def test_both_feet_carry_within_their_friction_cones(stand):
    tangential, normal = stand.forces[[0, 2]], stand.forces[[1, 3]]
    assert np.all(normal > 0)
    assert np.all(np.abs(tangential) < stand.walker.friction_coefficient * normal)
    assert normal.sum() == pytest.approx(stand.walker.weight)


def test_no_other_torques_that_hold_the_pose_are_smaller(stand):
    """Feet may press against each other: the balance leaves one direction of torques free."""
    mechanics = mechanics_at(stand.walker, stand.spring, stand.q[:, None], np.zeros((6, 1)))
    columns = [mechanics.momentum_rate(np.eye(3)[:, [k]], np.zeros((4, 1))) for k in range(3)]
    columns += [mechanics.momentum_rate(np.zeros((3, 1)), np.eye(4)[:, [k]]) for k in range(4)]
    free = np.linalg.svd(np.hstack(columns) - mechanics.force)[2][-1]
    assert free[:3] @ stand.torques == pytest.approx(0.0, abs=1e-9)


def test_feet_that_the_legs_can_not_reach_are_refused():
    with pytest.raises(InvalidRequestError, match=r"2\.5 m apart, allowed is above 0 and below 2 m"):
        standing_pose(WALKER, 2.5, 0.05)


def test_a_stand_on_a_slope_is_refused():
    with pytest.raises(InvalidRequestError, match="stands and transitions are for level ground"):
        standing_pose(WalkerParameters(terrain=Terrain(slope=0.05)), 0.1, 0.05)


def test_impossible_settings_are_refused():
    with pytest.raises(ConfigurationError, match="transition setting steps is 5, allowed is 1 to 4"):
        TransitionSettings(0.1, 0.05, 5, 4, 0.2, 1.2)
