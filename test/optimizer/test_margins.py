"""Gaits keep the margins that their walker asks for, on both grids and when they are replayed."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.grid import certify, stance_load_entries
from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.certificate.replay import replay_step
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.request import GaitRequest

# Left alone the optimum slides its foot along the ground at this speed, and unloads the other one.
REQUEST = GaitRequest.for_speed(1.087, "none", 30)
FREE, BOUNDED = WalkerParameters(), WalkerParameters(landing_speed=0.3, stance_load=0.85)


@pytest.fixture(scope="module")
def gaits():
    """The optimum left alone, and the one with margins."""
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


def least_loads(gait):
    """Least part of the weight on foot 1, on the report's grid behind the impact and on the refined one."""
    normal = gait.trajectory.reaction[2, 2:], gait.refined.trajectory.forces[:, :, 1]
    return [forces.min() / gait.walker.weight for forces in normal]


def test_the_stance_foot_keeps_its_load(gaits):
    assert max(least_loads(gaits[FREE])) < 0.83
    assert min(least_loads(gaits[BOUNDED])) >= BOUNDED.stance_load - 1e-6


def test_two_feet_share_the_load():
    load = 0.6 * BOUNDED.weight
    walker = replace(BOUNDED, stance_load=0.7)
    shared, alone = np.array([[load, 0.0], [load, load]]), np.array([[load, 0.0], [0.0, load]])
    assert [entry.met for entry in stance_load_entries(walker, shared[:, :1])] == [True]
    for normal in (shared, alone):
        (entry,) = stance_load_entries(walker, normal)
        assert entry.violation == pytest.approx(0.1 * walker.weight)


def test_it_costs_something(gaits):
    efforts = [gaits[walker].refined.trajectory.torque_effort for walker in (FREE, BOUNDED)]
    assert efforts[0] < efforts[1]


@pytest.mark.parametrize(
    ("margin", "more", "unit"), [("landing_speed", 0.31, "m/s"), ("stance_load", 0.1, "N")]
)
def test_certificates_refuse_gaits_that_do_not_keep_them(gaits, margin, more, unit):
    for gait in gaits.values():
        walker = replace(gait.walker, **{margin: max(getattr(gait.walker, margin), 0.83) + more})
        for certificate in (
            certify(walker, REQUEST, gait.spring, gait.trajectory),
            certify_refined(walker, REQUEST, gait.refined),
        ):
            failed = certificate.failures()
            assert [(entry.family, entry.unit) for entry in failed] == [(margin, unit)]
    families = {entry.family for entry in gaits[FREE].certificate.entries}
    assert margin not in families
