"""What each foot does, given as a schedule or read off a solution."""

import numpy as np
import pytest

from walk_optimizer.contact.schedule import (
    CONTACT_FAMILIES,
    LEAST_SLIP_SPEED,
    FootMode,
    double_impact,
    observed_schedule,
    single_impact,
)


def observe(gap, normal_force, cone_slack, slip):
    """What one foot does at one point, the other one being in the air."""
    sides = [np.array([[value], [other]]) for value, other in ((gap, 1), (normal_force, 0), (cone_slack, 0))]
    schedule = observed_schedule(*sides, np.array([[slip], [0.0]]))
    assert schedule.shape == (2, 1)
    assert schedule[1, 0] == FootMode.FREE
    return FootMode(schedule[0, 0])


@pytest.mark.parametrize(
    ("gap", "normal_force", "cone_slack", "slip", "expected"),
    [
        (0.1, 0.0, 0.0, 1.0, FootMode.FREE),
        (0.0, 1.0, 0.5, 0.0, FootMode.STICK),
        (0.0, 1.0, 0.0, 0.3, FootMode.SLIP_FORWARD),
        (0.0, 1.0, 0.0, -0.3, FootMode.SLIP_BACKWARD),
        # What relaxation leaves: products of 1e-8, neither side exactly zero.
        (0.05, 2e-7, 1e-8, 0.6, FootMode.FREE),
        (1e-8, 0.9, 0.4, 2.5e-8, FootMode.STICK),
        (1e-8, 0.9, 3e-8, 0.3, FootMode.SLIP_FORWARD),
        (1e-8, 0.9, 3e-8, -0.3, FootMode.SLIP_BACKWARD),
        # On the edge of its cone and all but still: it sticks.
        (0.0, 1.0, 0.0, 0.9 * LEAST_SLIP_SPEED, FootMode.STICK),
        (0.0, 1.0, 0.0, 1.1 * LEAST_SLIP_SPEED, FootMode.SLIP_FORWARD),
        # On the ground without load, or with neither side.
        (0.0, 0.0, 0.0, 0.3, FootMode.FREE),
    ],
)
def test_the_larger_side_of_a_pair_decides(gap, normal_force, cone_slack, slip, expected):
    assert observe(gap, normal_force, cone_slack, slip) is expected


def test_each_foot_and_point_is_judged_for_itself():
    gap = np.array([[0.0, 0.0, 0.2], [0.3, 0.0, 0.0]])
    normal_force = np.array([[1.0, 1.0, 0.0], [0.0, 0.5, 1.0]])
    cone_slack = np.array([[0.4, 0.0, 0.0], [0.0, 0.0, 0.3]])
    slip = np.array([[0.0, 0.2, 0.2], [0.9, -0.1, 0.0]])
    expected = [
        [FootMode.STICK, FootMode.SLIP_FORWARD, FootMode.FREE],
        [FootMode.FREE, FootMode.SLIP_BACKWARD, FootMode.STICK],
    ]
    np.testing.assert_array_equal(observed_schedule(gap, normal_force, cone_slack, slip), expected)


def test_plain_walking_stands_on_foot_1_and_swings_foot_2():
    np.testing.assert_array_equal(single_impact(3), [[FootMode.STICK] * 3, [FootMode.FREE] * 3])


def test_in_double_impact_the_foot_behind_still_stands_at_the_first_point():
    expected = [[FootMode.STICK] * 3, [FootMode.STICK, FootMode.FREE, FootMode.FREE]]
    np.testing.assert_array_equal(double_impact(3), expected)


def test_the_families_differ_and_cover_every_point():
    schedules = [family(7) for family in CONTACT_FAMILIES.values()]
    assert all(schedule.shape == (2, 7) for schedule in schedules)
    assert len({schedule.tobytes() for schedule in schedules}) == len(schedules)
