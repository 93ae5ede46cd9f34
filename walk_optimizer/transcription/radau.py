"""The collocation interval of the refined grid: three-point Radau IIA, and the impact between phases.

States are cubic in each interval, torques and forces quadratic through the three collocation
points. Feet that stand are held by their velocity at the collocation points (index 2), for which
Radau IIA keeps order 5 in the states at the ends of intervals [Hairer1996, table VII.4.1].
"""

from functools import cache

import casadi as ca
import numpy as np

from walk_optimizer.contact.feet import cone_sides
from walk_optimizer.model import dynamics, ground
from walk_optimizer.model.kinematics import foot_position
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.layout import STATE_WIDTH
from walk_optimizer.transcription.scaling import point_units, spring_units
from walk_optimizer.transcription.stage import StageKind
from walk_optimizer.transcription.stage_functions import stage_functions
from walk_optimizer.transcription.tableau import DIFFERENTIATION, QUADRATURE, STAGES

# Variables of an interval: states, then torques, then ground reactions (x, y of foot 1, of foot 2).
INTERVAL_WIDTH = STAGES * (STATE_WIDTH + 3 + 4)
TORQUE_START = STAGES * STATE_WIDTH
FORCE_START = TORQUE_START + 3 * STAGES
# Rows of a collocation point besides its 12 of dynamics, and of an impact besides its 12 of momentum:
# gaps, tangential and normal velocities, both sides of the friction cone; foot 1, foot 2 of each.
CONTACT_ROWS = 10
INTERVAL_ROWS = STAGES * (STATE_WIDTH + CONTACT_ROWS)
IMPACT_WIDTH = STATE_WIDTH + 4
IMPACT_ROWS = STATE_WIDTH + CONTACT_ROWS
# Impulses are of the order of body weight times this duration in [s].
IMPULSE_DURATION = 0.1


def contact_rows(walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, force: ca.SX) -> ca.SX:
    """Return gaps, velocities and friction cones of both feet, (10,), in SI units.

    Args:
        walker: The walker.
        q: Coordinates, (6,).
        qdot: Velocities, (6,).
        force: Ground reaction or impulse, (4,): x, y of foot 1, then of foot 2.
    """
    feet = [foot_position(walker, q, leg) for leg in range(2)]
    velocities = [ground.along_and_normal(walker, ca.jtimes(foot, q, qdot)) for foot in feet]
    cones: list[ca.SX] = []
    for leg in range(2):
        tangential, normal = ground.along_and_normal(walker, force[2 * leg : 2 * leg + 2])
        cones += cone_sides(walker, tangential, normal)
    gaps = [ground.gap(walker, foot) for foot in feet]
    return ca.vertcat(*gaps, *(v[0] for v in velocities), *(v[1] for v in velocities), *cones)


def contact_units(walker: SymbolicWalker, force: ca.SX) -> ca.SX:
    """Return the units of `contact_rows`, (10,)."""
    return ca.vertcat(*[walker.leg_length] * 2, *[1.0] * 4, *[force] * 4)


def _point_function() -> ca.Function:
    """Return (q, p, u, force, spring, walker) -> rate (12,), contact rows (10,), all in SI units."""
    walker = SymbolicWalker()
    q, p, u, force, spring = (ca.SX.sym(*one) for one in (("q", 6), ("p", 6), ("u", 3), ("f", 4), ("s", 2)))
    qdot = dynamics.velocity(walker, q, p)
    pdot = dynamics.momentum_rate(walker, q, qdot, u, ca.reshape(force, 2, 2), spring)
    contacts = contact_rows(walker, q, qdot, force)
    return ca.Function("point", [q, p, u, force, spring, walker.symbols], [ca.vertcat(qdot, pdot), contacts])


def interval_functions() -> list[ca.Function]:
    """Return the functions of a collocation interval; its own number is its part of the phase [-].

    The shared variables are K, q_eq and the duration of the phase in [s].
    """
    walker, part = SymbolicWalker(), ca.SX.sym("part")
    w, s = ca.SX.sym("w", INTERVAL_WIDTH), ca.SX.sym("s", 3)
    units = ca.vertcat(*point_units(walker))
    state_unit, torque_unit, force_unit = units[:12], units[12], walker.weight
    states = ca.reshape(w[:TORQUE_START], STATE_WIDTH, STAGES)
    torques = ca.reshape(w[TORQUE_START:FORCE_START], 3, STAGES)
    forces = ca.reshape(w[FORCE_START:], 4, STAGES)
    spring, length = s[:2] * ca.vertcat(*spring_units(walker)), part * s[2]
    point, rows, contacts, cost = _point_function(), [], [], 0
    for i in range(STAGES):
        state = states[:, i] * state_unit
        inputs = (torques[:, i] * torque_unit, forces[:, i] * force_unit, spring, walker.symbols)
        rate, contact = point(state[:6], state[6:], *inputs)
        rows.append(ca.mtimes(states, ca.DM(DIFFERENTIATION[i, 1:])) - length * rate / state_unit)
        contacts.append(contact / contact_units(walker, force_unit))
        cost += length * QUADRATURE[i] * ca.sumsqr(torques[:, i]) / 2
    par = ca.vertcat(walker.symbols, part)
    return stage_functions("interval", w, s, par, ca.vertcat(*rows, *contacts), cost)


def impact_functions() -> list[ca.Function]:
    """Return the functions of an impact: momentum jumps by J' impulse, feet that take part stop.

    Its variables are the state after it and the impulses, it takes no number of its own.
    """
    walker, unused = SymbolicWalker(), ca.SX.sym("unused")
    w, s = ca.SX.sym("w", IMPACT_WIDTH), ca.SX.sym("s", 0)
    units = ca.vertcat(*point_units(walker)[:12])
    impulse_unit = walker.weight * IMPULSE_DURATION
    state, impulse = w[:STATE_WIDTH] * units, w[STATE_WIDTH:] * impulse_unit
    q, p = ca.SX.sym("q", 6), ca.SX.sym("p", 6)
    force = ca.SX.sym("force", 4)
    qdot = dynamics.velocity(walker, q, p)
    jump = sum(dynamics.foot_jacobian(walker, q, leg).T @ force[2 * leg : 2 * leg + 2] for leg in range(2))
    map_ = ca.Function(
        "impact_map", [q, p, force, walker.symbols], [jump, contact_rows(walker, q, qdot, force)]
    )
    change, contacts = map_(state[:6], state[6:], impulse, walker.symbols)
    momentum = w[:STATE_WIDTH] - ca.vertcat(ca.SX.zeros(6), change) / units
    rows = ca.vertcat(momentum, contacts / contact_units(walker, impulse_unit))
    par = ca.vertcat(walker.symbols, unused)
    return stage_functions("impact", w, s, par, rows, ca.SX(0))


@cache
def interval_kind() -> StageKind:
    """Return the collocation interval as a kind of stage."""
    previous = np.zeros((INTERVAL_ROWS, STATE_WIDTH))
    previous[: STAGES * STATE_WIDTH] = np.kron(DIFFERENTIATION[:, :1], np.eye(STATE_WIDTH))
    state = slice((STAGES - 1) * STATE_WIDTH, STAGES * STATE_WIDTH)
    functions = compiled(interval_functions)
    return StageKind("interval", functions, INTERVAL_WIDTH, INTERVAL_ROWS, state, 3, previous)


@cache
def impact_kind() -> StageKind:
    """Return the impact as a kind of stage."""
    previous = np.zeros((IMPACT_ROWS, STATE_WIDTH))
    previous[:STATE_WIDTH] = -np.eye(STATE_WIDTH)
    functions = compiled(impact_functions)
    return StageKind("impact", functions, IMPACT_WIDTH, IMPACT_ROWS, slice(0, STATE_WIDTH), 0, previous)
