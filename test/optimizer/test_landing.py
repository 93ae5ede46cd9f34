"""Gaits whose foot has to come down at a least speed do so, on both grids and when they are replayed."""

from dataclasses import replace

import pytest

from walk_optimizer.certificate import certify
from walk_optimizer.mechanics import mechanics_at
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.refined_certificate import certify_refined
from walk_optimizer.replay import replay_step
from walk_optimizer.request import GaitRequest

# Left alone the optimum slides its foot along the ground at this speed.
REQUEST = GaitRequest.for_speed(1.087, "none", 30)
FREE, BOUNDED = WalkerParameters(), WalkerParameters(landing_speed=0.3)


@pytest.fixture(scope="module")
def gaits():
    """The optimum left alone, and the one that has to land."""
    found = {walker: optimize(REQUEST, walker).gait for walker in (FREE, BOUNDED)}
    assert all(found.values())
    return found


def downward(gait, spring, state):
    """Speed of foot 2 towards level ground in [m/s] at a state (12,)."""
    mechanics = mechanics_at(gait.walker, spring, state[:6, None], state[6:, None])
    return -mechanics.foot_velocity(1)[1, 0]


def landing_speeds(gait):
    """On the report's grid, on the refined one, and where the refined step's replay ends."""
    last = gait.trajectory.stacked()[:12, -1]
    spring, trajectory = gait.refined.spring, gait.refined.trajectory
    ends = (trajectory.states[-1, -1], replay_step(gait.walker, spring, trajectory))
    return downward(gait, gait.spring, last), *(downward(gait, spring, end) for end in ends)


def test_the_foot_lands_at_least_so_fast(gaits):
    assert landing_speeds(gaits[FREE])[1] < 0.1
    on_grid, refined, replayed = landing_speeds(gaits[BOUNDED])
    assert on_grid >= BOUNDED.landing_speed - 1e-6
    assert refined >= BOUNDED.landing_speed - 1e-6
    assert replayed == pytest.approx(refined, abs=1e-3)


def test_it_costs_something(gaits):
    efforts = [gaits[walker].refined.trajectory.torque_effort for walker in (FREE, BOUNDED)]
    assert efforts[0] < efforts[1]


def test_certificates_refuse_a_foot_that_lands_too_slowly(gaits):
    for walker, gait in gaits.items():
        faster = replace(walker, landing_speed=walker.landing_speed + 0.31)
        for certificate in (
            certify(faster, REQUEST, gait.spring, gait.trajectory),
            certify_refined(faster, REQUEST, gait.refined),
        ):
            failed = certificate.failures()
            assert [entry.family for entry in failed] == ["landing_speed"]
            assert failed[0].unit == "m/s"
    families = {entry.family for entry in gaits[FREE].certificate.entries}
    assert "landing_speed" not in families
