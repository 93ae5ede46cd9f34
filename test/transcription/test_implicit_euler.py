"""The dynamics rows against implicit Euler done independently, and the order of the method."""

import numpy as np
import pytest
from model.pinocchio_walker import PinocchioWalker
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transcription.euler_stage import physical_rows

WALKER = WalkerParameters()
SPRING = KneeSpring(80.0, 2.8)
ROWS = physical_rows()
Q = np.array([0.0, 0.98, 0.2, 2.8, -0.3, 2.9])
QDOT = np.array([0.8, -0.1, -0.9, 0.5, 1.2, -1.5])


def rows(point, before, interval):
    spring = [SPRING.stiffness, SPRING.equilibrium]
    return np.asarray(ROWS(point, before, spring, interval, WALKER.vector())).ravel()


def test_a_step_solved_for_velocities_by_other_means_leaves_no_residual():
    other = PinocchioWalker(WALKER, SPRING)
    interval, u = 0.004, np.array([12.0, -7.0, 3.0])
    reaction = np.array([20.0, 60.0, 500.0, 35.0, 5.0, 240.0])
    before_q, before_p = Q, other.mass_matrix(Q) @ QDOT
    net = reaction.reshape(2, 3)[:, [0, 2]] - reaction.reshape(2, 3)[:, [1, 1]] * [1, 0]

    def impulse_defect(qdot):
        q = before_q + interval * qdot
        rate = other.force(q, qdot) + np.array([0, 0, u[0], u[1], -u[0], u[2]])
        rate += np.einsum("fai,fa->i", other.foot_jacobians(q), net)
        return other.mass_matrix(q) @ qdot - before_p - interval * rate

    qdot, _, ended, message = fsolve(impulse_defect, QDOT, xtol=1e-13, full_output=True)
    assert ended == 1, message
    q = before_q + interval * qdot
    slip = np.abs((other.foot_jacobians(q) @ qdot)[:, 0])
    point = np.concatenate([q, other.mass_matrix(q) @ qdot, u, reaction, slip])
    residual = rows(point, np.concatenate([before_q, before_p]), interval)
    np.testing.assert_allclose(residual[:12], 0, atol=1e-9)
    np.testing.assert_allclose(residual[12], other.feet(q)[1, 0], atol=1e-12)
    np.testing.assert_allclose(residual[16], other.feet(q)[1, 1], atol=1e-12)
    assert min(residual[[14, 15]]) == pytest.approx(0, abs=1e-12), "gamma is |slip| of foot 1"


def euler(start, duration, steps):
    """The state after implicit Euler steps of the free system, from the program's rows."""
    state = start
    for _ in range(steps):
        before = state

        def residual(unknown, before=before):
            return rows(np.concatenate([unknown, np.zeros(11)]), before, duration / steps)[:12]

        state, _, ended, message = fsolve(residual, before, xtol=1e-12, full_output=True)
        assert ended == 1, message
    return state


def test_implicit_euler_is_of_first_order():
    spring = (SPRING.stiffness, SPRING.equilibrium)

    def rate(_, state):
        q, p = state[:6, None], state[6:, None]
        return np.concatenate([evaluate(name, WALKER, q, p, spring)[0] for name in ("velocity", "force")])

    start = np.concatenate([Q, PinocchioWalker(WALKER).mass_matrix(Q) @ QDOT])
    duration = 0.05
    exact = solve_ivp(rate, (0.0, duration), start, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    errors = [np.linalg.norm((euler(start, duration, steps) - exact)[:6]) for steps in (30, 60, 120)]
    assert errors[0] < 0.1
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.12)
