"""The simulated walker against mechanics that are written apart from it."""

import numpy as np
import pytest

from walk_optimizer.model.functions import mass_matrices
from walk_optimizer.model.kinematics import RELABELLED
from walk_optimizer.model.mechanics import foot_arm, mechanics_at
from walk_optimizer.simulation.pinned_walker import PinnedWalker
from walk_optimizer.simulation.settings import KneeStop

TORQUE = np.array([3.0, -5.0, 2.0])


def full_state(model, x):
    """q and p, (6, 1) each, of joint angles and rates about a stance foot at the origin."""
    at_origin = np.concatenate([[0.0, 0.0], x[:4]])[:, None]
    hip = -foot_arm(model.walker, at_origin, 0).position[:, 0]
    q = np.concatenate([hip, x[:4]])[:, None]
    standing = foot_arm(model.walker, q, 0).jacobian[0]
    qdot = np.concatenate([-standing[:, 2:] @ x[4:], x[4:]])
    return q, (mass_matrices(model.walker, q)[0] @ qdot)[:, None]


@pytest.fixture
def states(rng):
    return rng.uniform([-0.4, 2.5, -0.4, 2.0, -3, -3, -3, -3], [0.4, 3.1, 0.4, 3.1, 3, 3, 3, 3], (20, 8))


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def test_accelerations_and_reaction_satisfy_the_hamiltonian_equations(loop, states):
    model, step = loop.reference.model, 1e-6
    for x in states:
        rate = model.rate(x, TORQUE)
        _, later = full_state(model, x + step * rate)
        _, before = full_state(model, x - step * rate)
        q, p = full_state(model, x)
        reaction = np.concatenate([model.reaction(x, TORQUE), [0.0, 0.0]])[:, None]
        mechanics = mechanics_at(model.walker, model.spring, q, p)
        expected = mechanics.momentum_rate(TORQUE[:, None], reaction)
        np.testing.assert_allclose((later - before) / (2 * step), expected, rtol=1e-5, atol=1e-3)


def test_power_is_what_motors_and_push_give(loop, states):
    model, step, push = loop.reference.model, 1e-6, 40.0
    for x in states:
        rate = model.rate(x, TORQUE, push)
        gained = (model.energy(x + step * rate) - model.energy(x - step * rate)) / (2 * step)
        motors = TORQUE @ [x[4] - x[6], x[5], x[7]]
        hip_speed = model.hip_gradient(x) @ rate
        np.testing.assert_allclose(gained, motors + push * hip_speed, rtol=1e-6, atol=1e-4)


def test_touch_down_stops_the_foot_and_keeps_momentum_about_it(loop, states):
    model = loop.reference.model
    for x in states:
        after, impulse = model.touch_down(x)
        q, p = full_state(model, x)
        _, p_after = full_state(model, after)
        impulses = np.concatenate([[0.0, 0.0], impulse])[:, None]
        kick = mechanics_at(model.walker, model.spring, q, p).generalized(impulses)
        np.testing.assert_allclose((p + kick)[list(RELABELLED)], p_after, rtol=1e-9, atol=1e-8)
        # Heights are measured from the stance foot, which is another one now.
        lifted = model.walker.weight * model.swing_foot(x)[1]
        assert model.energy(after) + lifted < model.energy(x)


def test_a_stop_only_pushes_a_knee_forward(loop):
    free = loop.reference.model
    stopped = PinnedWalker(free.walker, free.spring, KneeStop(20000.0, 1.0))
    x = loop.start.copy()
    for knee, pushed in ((np.pi - 0.01, False), (np.pi + 0.01, True)):
        x[3] = knee
        x[7] = 0.0
        difference = stopped.rate(x, TORQUE) - free.rate(x, TORQUE)
        assert difference[7] < -1.0 if pushed else not difference.any()
    x[7] = -5.0
    assert not (stopped.rate(x, TORQUE) - free.rate(x, TORQUE)).any(), "it must not pull on the way back"
