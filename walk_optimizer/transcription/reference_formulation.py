"""The report's own formulation: squared Fischer-Burmeister equalities with the scaling of its eq. (7).

It is kept to be measured against. Where the report leaves something open, a comment says what is done
here. Its scaling constants follow from all points of the iterate; they are known functions of x whose
derivatives are left out, as the report leaves them out of its derivatives (section 3.3.3, eq. (17)).
"""

from functools import cache, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.complementarity import PAIRS_PER_POINT
from walk_optimizer.contact.feet import contact_pairs
from walk_optimizer.model import dynamics
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.boundary import periodic_ends
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.euler_stage import physical_rows
from walk_optimizer.transcription.problems import spring_bounds, state_bounds, to_scaled
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.scaling import point_units, spring_units
from walk_optimizer.transcription.stage import Stage, StageKind
from walk_optimizer.transcription.stage_functions import stage_functions

FloatArray = NDArray[np.float64]

PAIRS = 2 * PAIRS_PER_POINT
_STATE_ROWS = layout.STATE.stop
_ROWS = _STATE_ROWS + PAIRS
_SHARED = layout.SPRING_WIDTH + 2 * PAIRS
# c_1 and c_2 of eq. (7): "determined by tests", and not given.
C_1, C_2 = 1.0, 1.0
# Least maximum in eq. (7), in natural units: the gap of a foot that stands all along is zero, and the
# report does not say what becomes of its constant then.
LEAST_MAXIMUM = 1e-3
# Keeps the root differentiable where both sides are zero.
_ROUNDING = 1e-16


def squared_fischer_burmeister(a: ca.SX, b: ca.SX) -> ca.SX:
    """Return 1/2 (sqrt(a^2 + b^2) - (a + b))^2, zero where a >= 0, b >= 0, a b = 0 (report eq. (6))."""
    return (ca.sqrt(a**2 + b**2 + _ROUNDING) - (a + b)) ** 2 / 2


def reference_functions() -> list[ca.Function]:
    """Return the functions of one grid point; it shares the spring and the constants c_a, c_b."""
    walker, interval = SymbolicWalker(), ca.SX.sym("h")
    w, s = ca.SX.sym("w", layout.POINT_WIDTH), ca.SX.sym("s", layout.SPRING_WIDTH)
    constants = ca.SX.sym("c", 2 * PAIRS)
    par = ca.vertcat(walker.symbols, interval)
    column, spring = w * ca.vertcat(*point_units(walker)), s * ca.vertcat(*spring_units(walker))
    rows = physical_rows()(column, ca.SX.zeros(_STATE_ROWS), spring, interval, walker.symbols)
    dynamics_rows = rows[layout.DYNAMICS] / ca.vertcat(*point_units(walker)[:_STATE_ROWS])
    sides = _scaled_sides()(column, walker.symbols)
    both = constants * sides
    phi = squared_fischer_burmeister(both[:PAIRS], both[PAIRS:])
    cost = interval * ca.sumsqr(w[layout.U]) / 2
    shared, complete = ca.vertcat(s, constants), ca.vertcat(dynamics_rows, phi)
    return [
        *stage_functions("reference", w, shared, par, complete, cost),
        ca.Function("reference_sides", [w, par], [sides]),
    ]


def _scaled_sides() -> ca.Function:
    """Return (point, walker) -> the sides a (8,), then b (8,), of its pairs in natural units."""
    walker, column = SymbolicWalker(), ca.SX.sym("point", layout.POINT_WIDTH)
    point = layout.Point.of(column)
    qdot = dynamics.velocity(walker, point.q, point.p)
    a, b = contact_pairs(walker, point.q, qdot, point.reaction, point.slip_speed)
    a_units = [walker.leg_length, walker.weight, 1.0, 1.0]
    b_units = [walker.weight, 1.0, walker.weight, walker.weight]
    scaled = ca.vertcat(a, b) / ca.vertcat(*a_units * 2, *b_units * 2)
    return ca.Function("sides", [column, walker.symbols], [scaled])


@cache
def _kind() -> StageKind:
    previous = np.vstack([-np.eye(_STATE_ROWS), np.zeros((PAIRS, _STATE_ROWS))])
    functions = compiled(reference_functions)
    return StageKind("reference", functions, layout.POINT_WIDTH, _ROWS, layout.STATE, _SHARED, previous)


def scaling_constants(sides: ca.MX) -> ca.MX:
    """Return c_a and c_b, (16,), for sides a and b of all points, (16, N) (report eq. (7))."""
    numerators = ca.DM([C_1] * PAIRS + [C_2] * PAIRS)
    maxima = ca.vertcat(*(ca.mmax(row) for row in ca.vertsplit(sides)))
    return numerators / ca.fmax(maxima, LEAST_MAXIMUM)


@lru_cache(maxsize=4)
def _assembled(points: int) -> Nlp:
    """Return the program in x alone: the constants are put in, and their columns left out."""
    kept = np.ones(_ROWS, dtype=bool)
    stages = [Stage(_kind(), tuple(range(_SHARED)), kept)] * points
    whole = assemble(stages, periodic_ends(), _SHARED, np.zeros((0, _SHARED)))
    width = layout.POINT_WIDTH * points + layout.SPRING_WIDTH
    x, p = ca.MX.sym("x", width), whole.expressions["p"]
    columns = ca.reshape(x[: -layout.SPRING_WIDTH], layout.POINT_WIDTH, points)
    model = p[: _kind().model_parameters]
    own = p[_kind().model_parameters : _kind().model_parameters + points].T
    par = ca.vertcat(ca.repmat(model, 1, points), own)
    sides = _kind().functions["reference_sides"].map(points)(columns, par)
    complete = ca.vertcat(x, scaling_constants(sides))
    return _without_constants(whole, x, p, complete)


def _without_constants(whole: Nlp, x: ca.MX, p: ca.MX, complete: ca.MX) -> Nlp:
    """Return a program whose last variables are given functions of x with derivatives left out."""
    own = list(range(x.numel()))
    sigma, lam = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", whole.expressions["g"].numel())
    symbols = [whole.expressions["x"], p]
    f, g = ca.Function("values", symbols, [whole.expressions["f"], whole.expressions["g"]])(complete, p)
    rows, jacobian = whole.jacobian(complete, p)
    cost, gradient = whole.gradient(complete, p)
    hessian = whole.hessian(complete, p, sigma, lam)[own, own]
    names = ["x", "p"]
    return Nlp(
        expressions={"x": x, "p": p, "f": f, "g": g},
        jacobian=ca.Function("nlp_jac_g", [x, p], [rows, jacobian[:, own]], names, ["g", "jac_g_x"]),
        hessian=ca.Function(
            "nlp_hess_l",
            [x, p, sigma, lam],
            [hessian],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
        gradient=ca.Function("nlp_grad_f", [x, p], [cost, gradient[own]], names, ["f", "grad_f_x"]),
    )


def reference_problem(request: GaitRequest, walker: WalkerParameters) -> Problem:
    """Return the report's program: 23 N + 2 variables, 20 N + 1 rows.

    Bounds are those of the report alone (section IV): the signs of forces and slip speeds are left to
    the complementarity functions.
    """
    points = np.full((2, layout.POINT_WIDTH, request.points), np.inf) * np.array([-1, 1])[:, None, None]
    for bounds, of_state in zip(points, state_bounds(walker), strict=True):
        bounds[layout.STATE] = of_state[:, None]
    low, high = spring_bounds(request.spring_mode, walker)
    shortest = request.step_length / walker.leg_length
    zeros, intervals = np.zeros(_ROWS * request.points), np.full(request.points, request.interval)
    return Problem(
        nlp=_assembled(request.points),
        parameters=np.concatenate([walker.vector(request.step_length), intervals]),
        lower_x=to_scaled(walker, points[0], low),
        upper_x=to_scaled(walker, points[1], high),
        lower_g=np.append(zeros, shortest),
        upper_g=np.append(zeros, np.inf),
    )
