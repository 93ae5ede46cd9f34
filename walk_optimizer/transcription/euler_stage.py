"""One grid point of the report's transcription: implicit Euler and contact (report section III)."""

from functools import cache

import casadi as ca
import numpy as np

from walk_optimizer.contact.feet import contact_pairs, net_force, reaction_cones
from walk_optimizer.model import dynamics
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.scaling import point_units, row_units, spring_units
from walk_optimizer.transcription.stage import StageKind
from walk_optimizer.transcription.stage_functions import stage_functions


def euler_rows(
    state: ca.SX, previous: ca.SX, rate: ca.SX, interval: ca.SX, pairs: tuple[ca.SX, ca.SX]
) -> ca.SX:
    """Return the rows of a grid point of any model: implicit Euler, then contact.

    Args:
        state: At the point, (n,).
        previous: At the point before, (n,).
        rate: Time derivative of the state at the point, (n,).
        interval: Time step h in [s].
        pairs: Both sides a and b of the complementarity pairs, (m,) each.

    Returns:
        Dynamics (n,), the sides a (m,) and the products a b (m,).
    """
    a, b = pairs
    return ca.vertcat(state - previous - interval * rate, a, a * b)


def physical_rows() -> ca.Function:
    """Return (point, state before, spring, h, walker) -> the rows of a grid point, (32,), in SI units."""
    walker = SymbolicWalker()
    column, previous = ca.SX.sym("point", layout.POINT_WIDTH), ca.SX.sym("previous", 12)
    spring, interval = ca.SX.sym("spring", 2), ca.SX.sym("h")
    point = layout.Point.of(column)
    qdot = dynamics.velocity(walker, point.q, point.p)
    force = net_force(walker, point.reaction)
    pdot = dynamics.momentum_rate(walker, point.q, qdot, point.u, force, spring)
    state = ca.vertcat(point.q, point.p)
    pairs = contact_pairs(walker, point.q, qdot, point.reaction, point.slip_speed)
    rows = euler_rows(state, previous, ca.vertcat(qdot, pdot), interval, pairs)
    inputs = [column, previous, spring, interval, walker.symbols]
    return ca.Function("physical_rows", inputs, [ca.vertcat(rows, reaction_cones(walker, point.reaction))])


def euler_functions() -> list[ca.Function]:
    """Return the functions of one grid point, in scaled variables; its own number is h in [s].

    The state of the point before is left out: it enters the dynamics as `PREVIOUS` has it.
    """
    walker, interval = SymbolicWalker(), ca.SX.sym("h")
    w, s = ca.SX.sym("w", layout.POINT_WIDTH), ca.SX.sym("s", layout.SPRING_WIDTH)
    units = ca.vertcat(*point_units(walker))
    spring = s * ca.vertcat(*spring_units(walker))
    rows = physical_rows()(w * units, ca.SX.zeros(12), spring, interval, walker.symbols)
    cost = interval * ca.sumsqr(w[layout.U]) / 2
    par = ca.vertcat(walker.symbols, interval)
    return stage_functions("euler", w, s, par, rows / ca.vertcat(*row_units(walker)), cost)


# The dynamics rows are state - state before - h rate, in units of the state.
PREVIOUS = np.vstack([-np.eye(12), np.zeros((layout.ROW_WIDTH - 12, 12))])


@cache
def euler_kind() -> StageKind:
    """Return the grid point as a kind of stage."""
    functions = compiled(euler_functions)
    shared = layout.SPRING_WIDTH
    return StageKind("euler", functions, layout.POINT_WIDTH, layout.ROW_WIDTH, layout.STATE, shared, PREVIOUS)
