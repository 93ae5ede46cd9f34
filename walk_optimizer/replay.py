"""Replays torques through a tight integrator, apart from the collocation that made them.

The motion between impacts is integrated as an ordinary differential equation of high accuracy, with
the ground reactions that hold the standing feet solved for at every instant.
"""

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from walk_optimizer.model import dynamics
from walk_optimizer.model.kinematics import foot_position
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.refined_trajectory import RefinedTrajectory

FloatArray = NDArray[np.float64]

_TOLERANCES = {"rtol": 1e-10, "atol": 1e-10}
# Feet that stand are held where they are: the ground plays no part.
_ANY_TREAD = 1.0
Standing = tuple[bool, bool]


@cache
def _rate_function(standing: Standing) -> ca.Function:
    """Return (state, u, spring, walker) -> rate of the state (12,) with the feet that stand held.

    With qdot = M^-1 p, holding a foot means d/dt (J qdot) = 0, and pdot = f + J' lambda, so
    J M^-1 J' lambda = -J M^-1 (f - Mdot qdot) - Jdot qdot.
    """
    walker = SymbolicWalker()
    q, p, u, spring = (ca.SX.sym(*one) for one in (("q", 6), ("p", 6), ("u", 3), ("spring", 2)))
    v = ca.SX.sym("v", 6)
    feet = [foot_position(walker, q, leg) for leg in range(2) if standing[leg]]
    matrix = dynamics.mass_matrix(walker, q)
    force = dynamics.generalized_force(walker, q, v, spring) + ca.mtimes(ca.DM(dynamics.INPUT_MAP), u)
    rate = force
    if feet:
        jacobian = ca.jacobian(ca.vertcat(*feet), q)
        inertial = ca.solve(matrix, force - ca.mtimes(ca.jtimes(matrix, q, v), v))
        drift = ca.mtimes(ca.jtimes(jacobian, q, v), v)
        effective = ca.mtimes(jacobian, ca.solve(matrix, jacobian.T))
        reaction = ca.solve(effective, -ca.mtimes(jacobian, inertial) - drift)
        rate = force + ca.mtimes(jacobian.T, reaction)
    inner = ca.Function("inner", [q, v, u, spring, walker.symbols], [rate])
    velocity = dynamics.velocity(walker, q, p)
    complete = ca.vertcat(velocity, inner(q, velocity, u, spring, walker.symbols))
    return ca.Function("rate", [ca.vertcat(q, p), u, spring, walker.symbols], [complete])


def replay_interval(
    walker: WalkerParameters, spring: KneeSpring, trajectory: RefinedTrajectory, index: int, state: FloatArray
) -> FloatArray:
    """Return the state (12,) at the end of an interval when its torques act on a state at its start."""
    rate = _rate_function(_standing(trajectory, index))
    parameters = ((spring.stiffness, spring.equilibrium), walker.vector(_ANY_TREAD))
    length = float(trajectory.lengths[index])

    def derivative(time: float, current: FloatArray) -> FloatArray:
        torque = trajectory.torque(index, time / length)
        return np.array(rate(current, torque, *parameters), dtype=float).ravel()

    end: FloatArray = solve_ivp(derivative, (0.0, length), state, method="DOP853", **_TOLERANCES).y[:, -1]
    return end


def _standing(trajectory: RefinedTrajectory, index: int) -> Standing:
    """Return which feet carry load in an interval."""
    loads = np.abs(trajectory.forces[index]).max(axis=0)
    return bool(loads[:2].any()), bool(loads[2:].any())


def interval_errors(
    walker: WalkerParameters, spring: KneeSpring, trajectory: RefinedTrajectory
) -> FloatArray:
    """Return the local error of each interval, (n,): largest in angles [rad] and hip position [m].

    Each interval is replayed from its own start.
    """
    ends = [
        replay_interval(walker, spring, trajectory, index, trajectory.states[index, 0])
        for index in range(trajectory.intervals)
    ]
    errors: FloatArray = np.abs(np.array(ends) - trajectory.states[:, -1])[:, :6].max(axis=1)
    return errors


def replay_step(walker: WalkerParameters, spring: KneeSpring, trajectory: RefinedTrajectory) -> FloatArray:
    """Return the state (12,) at the end of the step when its torques are replayed from its start.

    Nothing is corrected on the way. At an impact inside the step the momentum jumps by J' impulse,
    as it does in the solution.
    """
    state: FloatArray = trajectory.states[0, 0]
    for index in range(trajectory.intervals):
        jump = trajectory.states[index, 0] - trajectory.states[index - 1, -1]
        if index and trajectory.impulses[index].any():
            state = state + jump
        state = replay_interval(walker, spring, trajectory, index, state)
    return state
