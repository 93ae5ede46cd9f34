"""A solved gait is broken in one place at a time: exactly the families that must notice do."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.grid import certify
from walk_optimizer.gait import Trajectory
from walk_optimizer.model.parameters import KneeSpring, SpringMode

# Rows of the points, and of the points' columns two instants: amid the step, and its first.
HIP_X, HIP_Y, P_X, U1, U3, GAMMA_1, GAMMA_2 = 0, 1, 6, 12, 14, 21, 22
FORWARD_1, BACKWARD_1, NORMAL_1, FORWARD_2, BACKWARD_2, NORMAL_2 = range(15, 21)
AMID, FIRST, LAST = 12, 0, -1


def failures(solved, points=None, *, walker=None, request=None, spring=None):
    """Names of the families that a changed gait fails."""
    points = solved.points if points is None else points
    trajectory = Trajectory.from_stacked(points, solved.request.step_time)
    certificate = certify(
        walker or solved.walker, request or solved.request, spring or solved.spring, trajectory
    )
    assert certificate.certified == (not certificate.failures())
    return {entry.family for entry in certificate.failures()}


def changed(solved, *changes):
    """The points with (row, column, difference) added."""
    points = solved.points.copy()
    for row, column, difference in changes:
        points[row, column] += difference
    return points


def test_the_gait_itself_is_certified(solved):
    assert failures(solved) == set()
    assert solved.gait.certificate.certified


def test_any_split_of_friction_inside_the_cone_is_as_good(solved):
    assert failures(solved, changed(solved, (FORWARD_1, AMID, 20.0), (BACKWARD_1, AMID, 20.0))) == set()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ([(HIP_X, AMID, 1e-4)], {"kinematics"}),
        ([(HIP_X, LAST, 1e-4)], {"kinematics"}),
        ([(HIP_X, slice(None), 1e-4)], {"periodicity_velocity"}),
        ([(U1, AMID, 0.01)], {"dynamics"}),
        ([(U3, LAST, 0.01)], {"dynamics"}),
        ([(U1, FIRST, 0.01)], {"periodicity_force"}),
        ([(NORMAL_1, AMID, 0.01)], {"dynamics"}),
        ([(NORMAL_1, FIRST, 0.01)], {"periodicity_force"}),
        ([(FORWARD_1, AMID, 1000.0), (BACKWARD_1, AMID, 1000.0)], {"friction_cone"}),
        ([(FORWARD_1, AMID, -500.0), (BACKWARD_1, AMID, -500.0)], {"unilateral_force"}),
        ([(NORMAL_2, AMID, 1.0)], {"dynamics", "normal_complementarity", "friction_complementarity"}),
        ([(GAMMA_2, AMID, -0.01)], {"slip_slack"}),
        ([(GAMMA_2, AMID, -5.0)], {"slip_slack", "slip_speed_sign"}),
    ],
)
def test_one_change(solved, changes, expected):
    assert failures(solved, changed(solved, *changes)) == expected


def test_a_lifted_stance_foot_bears_no_load(solved):
    lifted = failures(solved, changed(solved, (HIP_Y, AMID, 1e-4)))
    assert lifted == {"kinematics", "normal_complementarity"}
    sunk = failures(solved, changed(solved, (HIP_Y, AMID, -1e-4)))
    assert sunk == {"kinematics", "normal_complementarity", "penetration"}


@pytest.mark.parametrize(
    ("difference", "of_the_contact"), [(0.1, {"forward"}), (-0.1, {"backward"})], ids=["forward", "backward"]
)
def test_momentum_that_makes_the_stance_foot_slip(solved, difference, of_the_contact):
    # Where friction drives the slip, its product fails; where it brakes, the slack is too small.
    net = solved.points[FORWARD_1] - solved.points[BACKWARD_1]
    column = int(np.argmax(np.sign(difference) * net[1:-1])) + 1
    assert np.sign(difference) * net[column] > 10
    failed = failures(solved, changed(solved, (P_X, column, difference)))
    side = f"{next(iter(of_the_contact))}_slip_complementarity"
    assert failed - {"dynamics"} == {"kinematics", "slip_slack", side}


def test_slack_without_slip(solved):
    net = solved.points[FORWARD_1] - solved.points[BACKWARD_1]
    for column, side in ((int(np.argmax(net)), "forward"), (int(np.argmin(net)), "backward")):
        failed = failures(solved, changed(solved, (GAMMA_1, column, 0.01)))
        assert failed == {"friction_complementarity", f"{side}_slip_complementarity"}


def test_friction_on_the_swing_foot(solved):
    assert solved.points[GAMMA_2, AMID] > 0.1
    failed = failures(solved, changed(solved, (FORWARD_2, AMID, 1.0), (BACKWARD_2, AMID, 1.0)))
    assert failed == {"friction_cone", "friction_complementarity", "forward_slip_complementarity"}


def test_backward_walking(solved):
    assert "forward_momentum" in failures(solved, changed(solved, (P_X, AMID, -200.0)))


def test_the_spring_is_part_of_the_dynamics(solved):
    stiffer = KneeSpring(solved.spring.stiffness + 0.5, solved.spring.equilibrium)
    assert "dynamics" in failures(solved, spring=stiffer) <= {"dynamics", "periodicity_force"}
    flexed = KneeSpring(solved.spring.stiffness, solved.spring.equilibrium - 0.01)
    assert failures(solved, spring=flexed) == {"dynamics", "periodicity_force", "equilibrium_limits"}


def test_limits_of_the_walker_that_the_gait_is_held_against(solved):
    for limits, expected in (
        ({"hip_angle_limit": 0.05}, {"joint_limits"}),
        ({"stiffness_limit": solved.spring.stiffness - 1}, {"stiffness_limits"}),
        ({"friction_coefficient": 0.01}, {"friction_cone"}),
        ({"landing_speed": 2.0}, {"landing_speed"}),
        ({"stance_load": 0.99}, {"stance_load"}),
    ):
        assert failures(solved, walker=replace(solved.walker, **limits)) == expected


def test_the_step_that_was_asked_for(solved):
    longer = replace(solved.request, step_length=solved.request.step_length + 1e-4)
    assert failures(solved, request=longer) == {"speed"}
    shorter = replace(solved.request, step_length=solved.request.step_length - 1e-4)
    assert failures(solved, request=shorter) == set()
    hurried = replace(solved.request, step_time=solved.request.step_time - 0.01)
    assert {"kinematics", "dynamics"} <= failures(solved, request=hurried)
    coarser = replace(solved.request, points=24)
    assert {"kinematics", "dynamics"} <= failures(solved, request=coarser)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [HIP_X, 3, P_X, 11, U1, FORWARD_1, NORMAL_1, NORMAL_2])
def test_what_is_not_a_finite_number_fails(solved, row, value):
    points = solved.points.copy()
    points[row, AMID] = value
    with np.errstate(invalid="ignore"):
        assert failures(solved, points)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_slack_that_is_not_a_finite_number_fails(solved, value):
    points = solved.points.copy()
    points[GAMMA_2] = value
    with np.errstate(invalid="ignore"):
        assert failures(solved, points)


@pytest.mark.parametrize("spring", [KneeSpring(np.nan, np.pi), KneeSpring(0.0, np.nan)])
def test_a_spring_that_is_not_a_number_fails(solved, spring):
    assert failures(solved, spring=spring)


def test_a_mode_without_springs_has_none(solved):
    assert solved.spring.stiffness > 1
    plain = replace(solved.request, spring_mode=SpringMode.NONE)
    assert failures(solved, request=plain) == {"stiffness_limits"}


def test_a_mode_that_may_choose_the_equilibrium_may_choose_it_within_limits(solved):
    free = replace(solved.request, spring_mode=SpringMode.STIFFNESS_AND_EQUILIBRIUM)
    for equilibrium, expected in ((1.0, False), (-0.1, True), (3.2, True)):
        failed = failures(solved, request=free, spring=KneeSpring(solved.spring.stiffness, equilibrium))
        assert ("equilibrium_limits" in failed) == expected
