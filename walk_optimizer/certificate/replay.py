"""Replays torques through a tight integrator, apart from the collocation that made them.

The motion between impacts is integrated as an ordinary differential equation of high accuracy, with
the ground reactions that hold the feet under load solved for at every instant.
"""

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model import dynamics, ground
from walk_optimizer.model.linear import solved
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.phases import Modes

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_TOLERANCE = 1e-10  # of a step of the integrator, relative and in [rad], [m], [kg m/s]
# What SciPy's integrators accept.
_LEAST_RELATIVE_TOLERANCE = 100 * np.finfo(np.float64).eps
# Of an interval: what SciPy would begin with is so short that it costs a step more.
_FIRST_STEP = 0.5
_END = np.ones(1)
# Feet that stand or slip are held on the surface that they are on: of the ground its slope counts.
_ANY_TREAD = 1.0
# A foot under load that moves no faster than this sticks, in [m/s].
HELD_SPEED = 1e-6


def _rate_functions(modes: Modes) -> list[ca.Function]:
    """Return `rate`: (state, u, spring, walker) -> rate of the state (12,), feet that carry load being held.

    With qdot = M^-1 p, holding a foot means d/dt (J qdot) = 0 of the velocities that are held, both of
    a foot that sticks and the normal one of a foot that slips. With pdot = f + D lambda,
    J M^-1 D lambda = -J M^-1 (f - Mdot qdot) - Jdot qdot. D is J', but for a foot that slips its
    column also holds the friction against the slip, mu times the normal force.
    """
    walker = SymbolicWalker()
    q, p, u, spring = (ca.SX.sym(*one) for one in (("q", 6), ("p", 6), ("u", 3), ("spring", 2)))
    v = ca.SX.sym("v", 6)
    held = [_held(walker, q, leg, mode) for leg, mode in enumerate(modes) if mode is not FootMode.FREE]
    matrix = dynamics.mass_matrix(walker, q)
    force = dynamics.generalized_force(walker, q, v, spring) + ca.mtimes(ca.DM(dynamics.INPUT_MAP), u)
    rate = force
    if held:
        jacobian = ca.vertcat(*(rows for rows, _ in held))
        directions = ca.horzcat(*(columns for _, columns in held))
        inertial = solved(matrix, force - ca.mtimes(ca.jtimes(matrix, q, v), v))
        drift = ca.mtimes(ca.jtimes(jacobian, q, v), v)
        effective = ca.mtimes(jacobian, solved(matrix, directions))
        reaction = ca.solve(effective, -ca.mtimes(jacobian, inertial) - drift)
        rate = force + ca.mtimes(directions, reaction)
    inner = ca.Function("inner", [q, v, u, spring, walker.symbols], [rate])
    velocity = dynamics.velocity(walker, q, p)
    complete = ca.vertcat(velocity, inner(q, velocity, u, spring, walker.symbols))
    return [ca.Function("rate", [ca.vertcat(q, p), u, spring, walker.symbols], [complete])]


def _held(walker: SymbolicWalker, q: ca.SX, leg: int, mode: FootMode) -> tuple[ca.SX, ca.SX]:
    """Return the rows J of a foot's velocities that are held, and the columns D of what holds it."""
    rows = dynamics.foot_jacobian(walker, q, leg)
    if mode is FootMode.STICK:
        return rows, rows.T
    along, normal = ground.along_and_normal(walker, ca.vertsplit(rows))
    against = -1.0 if mode is FootMode.SLIP_FORWARD else 1.0
    return normal, (normal + against * walker.friction_coefficient * along).T


@cache
def _rates(modes: Modes, count: int) -> ca.Function:
    """Return `rate`, compiled, for as many states at once, in columns."""
    return compiled(_rate_functions, modes)["rate"].map(count)


def _replayed(
    walker: WalkerParameters,
    spring: KneeSpring,
    trajectory: RefinedTrajectory,
    modes: Modes,
    indices: IntArray,
    starts: FloatArray,
    places: FloatArray,
    tolerance: float,
) -> FloatArray:
    """Return the states (n, m, 12) at m places of n intervals with the same modes.

    All are integrated side by side from 0 to 1, each over its own length. The states are infinite where
    that does not come to an end.
    """
    # Here, not above: loading SciPy takes longer than all the rest of the optimiser.
    from scipy.integrate import solve_ivp

    count = indices.size
    # CasADi reads and writes these in place, one walker behind the other: to convert them takes longer than
    # to evaluate the rates.
    states, rates, torques = np.empty((count, 12)), np.empty((count, 12)), np.empty((count, 3))
    springs = np.tile([spring.stiffness, spring.equilibrium], (count, 1))
    walkers = np.tile(np.array(walker.vector(_ANY_TREAD), dtype=float), (count, 1))
    lengths = trajectory.lengths[indices, None]
    buffer, evaluate = _rates(modes, count).buffer()
    for number, array in enumerate((states, torques, springs, walkers)):
        buffer.set_arg(number, array.data)
    buffer.set_res(0, rates.data)

    def derivative(place: float, current: FloatArray) -> FloatArray:
        states[:] = current.reshape(count, 12)
        torques[:] = trajectory.torques_at(indices, place)
        evaluate()
        return (rates * lengths).ravel()

    # The integrator bounds the mean square of all errors, which may come from one interval alone.
    tolerance /= np.sqrt(count)
    result = solve_ivp(
        derivative,
        (0.0, 1.0),
        starts.ravel(),
        method="DOP853",
        t_eval=places,
        first_step=_FIRST_STEP,
        rtol=max(tolerance, _LEAST_RELATIVE_TOLERANCE),
        atol=tolerance,
    )
    if not result.success:
        return np.full((count, places.size, 12), np.inf)
    reached: FloatArray = result.y.reshape(count, 12, places.size).transpose(0, 2, 1)
    return reached


def contact_modes(walker: WalkerParameters, spring: KneeSpring, trajectory: RefinedTrajectory) -> list[Modes]:
    """Return what each foot does in each interval, as its forces and velocities at the nodes show."""
    nodes = trajectory.states[:, 1:].reshape(-1, 12).T
    mechanics = mechanics_at(walker, spring, nodes[:6], nodes[6:])
    slips = [walker.terrain.along_and_normal(mechanics.foot_velocity(leg))[0] for leg in range(2)]
    first, second = (slip.reshape(trajectory.intervals, -1) for slip in slips)
    return [
        (_mode(forces[:, :2], one), _mode(forces[:, 2:], other))
        for forces, one, other in zip(trajectory.forces, first, second, strict=True)
    ]


def _mode(forces: FloatArray, slip: FloatArray) -> FootMode:
    """Return what a foot does with the forces (3, 2) in [N] and tangential velocities (3,) in [m/s]."""
    if not forces.any():
        return FootMode.FREE
    fastest = slip[np.argmax(np.abs(slip))]
    if abs(fastest) <= HELD_SPEED:
        return FootMode.STICK
    return FootMode.SLIP_FORWARD if fastest > 0 else FootMode.SLIP_BACKWARD


def interval_states(
    walker: WalkerParameters,
    spring: KneeSpring,
    trajectory: RefinedTrajectory,
    starts: FloatArray,
    places: FloatArray = _END,
    tolerance: float = _TOLERANCE,
) -> FloatArray:
    """Return where the torques of each interval lead from states of one or more walkers, (k, n, m, 12).

    All take the same steps, so that differences of near-by starts are those of the motion itself.

    Args:
        walker: The walker.
        spring: Its knee springs.
        trajectory: The step: its torques, and which feet carry load.
        starts: States at the start of each interval, (k, n, 12).
        places: Where in the interval the states are wanted, in [0, 1], (m,).
        tolerance: Of a step of the integrator, relative and in [rad], [m], [kg m/s].
    """
    modes = contact_modes(walker, spring, trajectory)
    states = np.empty((*starts.shape[:2], places.size, 12))
    for mode in dict.fromkeys(modes):
        own = np.array([index for index, one in enumerate(modes) if one == mode])
        indices = np.tile(own, len(starts))
        ends = _replayed(walker, spring, trajectory, mode, indices, starts[:, own], places, tolerance)
        states[:, own] = ends.reshape(len(starts), own.size, places.size, 12)
    return states


def interval_errors(
    walker: WalkerParameters, spring: KneeSpring, trajectory: RefinedTrajectory
) -> FloatArray:
    """Return the local error of each interval, (n,): largest in angles [rad] and hip position [m].

    Each interval is replayed from its own start.
    """
    ends = interval_states(walker, spring, trajectory, trajectory.states[None, :, 0])[0, :, 0]
    errors: FloatArray = np.abs(ends - trajectory.states[:, -1])[:, :6].max(axis=1)
    return errors


def replay_step(
    walker: WalkerParameters,
    spring: KneeSpring,
    trajectory: RefinedTrajectory,
    tolerance: float = _TOLERANCE,
) -> FloatArray:
    """Return the state (12,) at the end of the step when its torques are replayed from its start.

    Nothing is corrected on the way. At an impact inside the step the momentum jumps by J' impulse,
    as it does in the solution.
    """
    state: FloatArray = trajectory.states[0, 0]
    jumps = inner_jumps(trajectory)
    for index, modes in enumerate(contact_modes(walker, spring, trajectory)):
        state, one = state + jumps[index], np.array([index])
        state = _replayed(walker, spring, trajectory, modes, one, state[None], _END, tolerance)[0, 0]
    return state


def inner_jumps(trajectory: RefinedTrajectory) -> FloatArray:
    """Return by how much the states jump before each interval, (n, 12): at impacts inside the step."""
    jumps: FloatArray = np.zeros_like(trajectory.states[:, 0])
    for index in range(1, trajectory.intervals):
        if trajectory.impulses[index].any():
            jumps[index] = trajectory.states[index, 0] - trajectory.states[index - 1, -1]
    return jumps
