"""The walker in single support as compiled functions of leg angles and angular velocities.

Foot 1 stands at the origin, so that the angles theta = (q3, q4, q5, q6) determine the hip, and omega their
velocities the momenta. Of the collocation equations pdot = -dH/dq + B u + J_1' f the rows of the hip give
the ground reaction f, and the others the torques; one is left, for no torque acts on it.
"""

import casadi as ca

from walk_optimizer.contact.feet import cone_sides
from walk_optimizer.model import dynamics, ground
from walk_optimizer.model.kinematics import LEGS, RELABELLED, foot_position
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.transcription.radau import IMPULSE_DURATION
from walk_optimizer.transcription.scaling import point_units, spring_units, torque_unit

ANGLES, MOMENTA, SPRING = 4, 6, 2
# Rows of a node: u1, u2, u3 and the row without a torque, in units of torque, and the gap of foot 2.
POINT_ROWS = 5
# Rows of the ends: momentum of the four angles after the impact and the gap of foot 2 when it lands, which
# are 0; the step's length; both sides of the impulse's friction cone; the speed at which foot 2 lands.
END_ROWS = 9
# Legs exchanged, of the angles and of the momenta.
_EXCHANGED_ANGLES = [row - 2 for row in RELABELLED[2:]]
_EXCHANGED_MOMENTA = list(RELABELLED)


def node_functions() -> list[ca.Function]:
    """Return the functions of a node; derivatives are dense and transposed, so that C reads them by rows.

    With y = (theta, omega, momentum rate, K and q_eq), K and q_eq and the rows scaled, else in SI units:
    `condensed_momentum`: (theta and omega, walker) -> p (6,), dp.
    `condensed_point`: (y, walker) -> rows (5,), drows.
    `condensed_curvature`: (y, multipliers of rows and p, walker) -> Hessian of their sum (16, 16).
    """
    walker = SymbolicWalker()
    state, rate, spring = (ca.SX.sym(*one) for one in (("x", 2 * ANGLES), ("rate", MOMENTA), ("s", SPRING)))
    y, par = ca.vertcat(state, rate, spring), walker.symbols
    momentum = _momentum(walker, state[:ANGLES], state[ANGLES:])
    rows = _point_rows(walker, state, rate, spring * ca.vertcat(*spring_units(walker)))
    of_rows, of_momentum = ca.SX.sym("of_rows", POINT_ROWS), ca.SX.sym("of_momentum", MOMENTA)
    lagrangian = ca.dot(of_rows, rows) + ca.dot(of_momentum, momentum)
    return [
        ca.Function("condensed_momentum", [state, par], [momentum, _transposed(momentum, state)]),
        ca.Function("condensed_point", [y, par], [rows, _transposed(rows, y)]),
        ca.Function(
            "condensed_curvature",
            [y, of_rows, of_momentum, par],
            [ca.densify(ca.hessian(lagrangian, y)[0])],
        ),
    ]


def end_functions() -> list[ca.Function]:
    """Return the functions of the ends, of e = (theta and omega at the end, omega after the impact), (12,).

    `condensed_ends`: (e, walker) -> rows (9,), drows (9, 12), scaled but for the landing speed in [m/s].
    `condensed_ends_curvature`: (e, multipliers, walker) -> Hessian of their sum (12, 12).
    `condensed_impulse`: (e, walker) -> impulse on foot 1 of the next step in [N s], (2,).
    """
    walker, e, lam = SymbolicWalker(), ca.SX.sym("e", 3 * ANGLES), ca.SX.sym("lam", END_ROWS)
    rows, impulse = _end_rows(walker, e[:ANGLES], e[ANGLES : 2 * ANGLES], e[2 * ANGLES :])
    par = walker.symbols
    hessian = ca.densify(ca.hessian(ca.dot(lam, rows), e)[0])
    return [
        ca.Function("condensed_ends", [e, par], [rows, ca.densify(ca.jacobian(rows, e))]),
        ca.Function("condensed_ends_curvature", [e, lam, par], [hessian]),
        ca.Function("condensed_impulse", [e, par], [impulse]),
    ]


def hip_functions() -> list[ca.Function]:
    """Return `condensed_hip`: (theta, omega, walker) -> position and velocity of the hip, (2,) each."""
    walker, theta, omega = SymbolicWalker(), ca.SX.sym("theta", ANGLES), ca.SX.sym("omega", ANGLES)
    hip = _hip(walker, theta)
    velocity = ca.jtimes(hip, theta, omega)
    return [ca.Function("condensed_hip", [theta, omega, walker.symbols], [hip, velocity])]


def _transposed(rows: ca.SX, variables: ca.SX) -> ca.SX:
    return ca.densify(ca.jacobian(rows, variables)).T


def _hip(walker: SymbolicWalker, theta: ca.SX) -> ca.SX:
    """Return where the hip is, (2,), with foot 1 at the origin."""
    return -foot_position(walker, ca.vertcat(0, 0, theta), 0)


def _coordinates(walker: SymbolicWalker, theta: ca.SX, omega: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return q and qdot, (6,) each."""
    hip = _hip(walker, theta)
    return ca.vertcat(hip, theta), ca.vertcat(ca.jtimes(hip, theta, omega), omega)


def _stance_jacobian(walker: SymbolicWalker, theta: ca.SX) -> ca.SX:
    """Return how foot 1 moves with the angles while the hip does not, (2, 4)."""
    return -ca.jacobian(_hip(walker, theta), theta)


def _momentum(walker: SymbolicWalker, theta: ca.SX, omega: ca.SX) -> ca.SX:
    """Return p = M(q) qdot, (6,)."""
    q, qdot = _coordinates(walker, theta, omega)
    symbols = ca.SX.sym("q", MOMENTA)
    return ca.mtimes(ca.substitute(dynamics.mass_matrix(walker, symbols), symbols, q), qdot)


def _point_rows(walker: SymbolicWalker, state: ca.SX, rate: ca.SX, spring: ca.SX) -> ca.SX:
    """Return the rows of a node: B u = pdot + dH/dq - J_1' f in the angles, with f from those of the hip."""
    theta, omega = state[:ANGLES], state[ANGLES:]
    q, qdot = _coordinates(walker, theta, omega)
    symbols = ca.SX.sym("q", MOMENTA)
    force = ca.substitute(dynamics.generalized_force(walker, symbols, qdot, spring), symbols, q)
    reaction = rate[:2] - force[:2]
    needed = rate[2:] - force[2:] - ca.mtimes(_stance_jacobian(walker, theta).T, reaction)
    first, second = (upper - 2 for upper, _ in LEGS)
    # u1 acts on both upper legs, against each other.
    torques = ca.vertcat((needed[first] - needed[second]) / 2, needed[first + 1], needed[second + 1])
    passive = needed[first] + needed[second]
    gap = ground.gap(walker, foot_position(walker, q, 1)) / walker.leg_length
    return ca.vertcat(ca.vertcat(torques, passive) / torque_unit(walker), gap)


def _end_rows(walker: SymbolicWalker, theta: ca.SX, omega: ca.SX, after: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the rows of the ends, (9,), and the impulse on the foot that lands, (2,).

    As foot 2 lands it becomes foot 1 of the next step: the legs change names, and the momentum jumps by
    J_1' times the impulse.
    """
    next_theta, symbols = theta[_EXCHANGED_ANGLES], ca.SX.sym("theta", ANGLES)
    jacobian = ca.substitute(_stance_jacobian(walker, symbols), symbols, next_theta)
    momentum = ca.substitute(_momentum(walker, symbols, after), symbols, next_theta)
    jump = momentum - _momentum(walker, theta, omega)[_EXCHANGED_MOMENTA]
    impulse = jump[:2]
    units = ca.vertcat(*point_units(walker)[8:12])
    left = (jump[2:] - ca.mtimes(jacobian.T, impulse)) / units
    foot = foot_position(walker, ca.vertcat(_hip(walker, theta), theta), 1)
    cone = ca.vertcat(*cone_sides(walker, *ground.along_and_normal(walker, impulse)))
    speed = -ground.along_and_normal(walker, ca.jtimes(foot, theta, omega))[1]
    lengths = ca.vertcat(ground.gap(walker, foot), foot[0]) / walker.leg_length
    return ca.vertcat(left, lengths, cone / (walker.weight * IMPULSE_DURATION), speed), impulse
