"""One grid point of the report's transcription: implicit Euler and contact (report section III)."""

import casadi as ca

from walk_optimizer.contact.complementarity import contact_pairs, net_force
from walk_optimizer.model import dynamics
from walk_optimizer.model.kinematics import RELABELLED, foot_position
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.scaling import point_units, row_units, spring_units


def physical_rows() -> ca.Function:
    """Return (point, state before, spring, h, walker) -> the 28 rows of a grid point, all in SI units.

    The rows are the dynamics, the sides a of the pairs and their products a b.
    """
    walker = SymbolicWalker()
    column, previous = ca.SX.sym("point", layout.POINT_WIDTH), ca.SX.sym("previous", 12)
    spring, interval = ca.SX.sym("spring", 2), ca.SX.sym("h")
    point = layout.Point.of(column)
    qdot = dynamics.velocity(walker, point.q, point.p)
    force = net_force(point.reaction)
    pdot = dynamics.momentum_rate(walker, point.q, qdot, point.u, force, spring)
    state = ca.vertcat(point.q, point.p)
    a, b = contact_pairs(walker, point.q, qdot, point.reaction, point.slip_speed)
    rows = ca.vertcat(state - previous - interval * ca.vertcat(qdot, pdot), a, a * b)
    inputs = [column, previous, spring, interval, walker.symbols]
    return ca.Function("physical_rows", inputs, [rows])


def stage_functions() -> list[ca.Function]:
    """Return the functions of one grid point, in scaled variables, for code generation.

    `stage_rows(w, z, s, par)` gives the 28 rows, `stage_jacobian` the nonzeros of their Jacobian
    with respect to (w, s), `stage_hessian(..., sigma, lam)` the nonzeros of the upper triangle of
    sigma d2/d(w,s)2 (|u|^2 / 2) + d2/d(w,s)2 (lam' rows). The state z of the point before enters
    linearly and needs no derivative code. par is the walker's vector and the time step h in [s].
    """
    walker = SymbolicWalker()
    interval, lam, sigma = ca.SX.sym("h"), ca.SX.sym("lam", layout.ROW_WIDTH), ca.SX.sym("sigma")
    w, z, s = ca.SX.sym("w", layout.POINT_WIDTH), ca.SX.sym("z", 12), ca.SX.sym("s", 2)
    units = ca.vertcat(*point_units(walker))
    spring = s * ca.vertcat(*spring_units(walker))
    rows = physical_rows()(w * units, z * units[:12], spring, interval, walker.symbols)
    rows = rows / ca.vertcat(*row_units(walker))
    variables = ca.vertcat(w, s)
    lagrangian = sigma * ca.sumsqr(w[layout.U]) / 2 + ca.dot(lam, rows)
    parameters = ca.vertcat(walker.symbols, interval)
    inputs = [w, z, s, parameters]
    jacobian = ca.jacobian(rows, variables)
    hessian = ca.triu(ca.hessian(lagrangian, variables)[0])
    return [
        ca.Function("stage_rows", inputs, [rows]),
        ca.Function("stage_jacobian", inputs, [rows, jacobian.nz[:]]),
        ca.Function("stage_hessian", [*inputs, sigma, lam], [hessian.nz[:]]),
        ca.Function("stage_jacobian_pattern", inputs, [jacobian]),
        ca.Function("stage_hessian_pattern", [*inputs, sigma, lam], [hessian]),
    ]


def boundary_functions() -> list[ca.Function]:
    """Return the functions that join the last point to the first, in scaled variables.

    `boundary_rows(w, par)` of the last point gives the state before point 1 (legs relabelled, hip
    moved back by one step, 12 rows) and the step length, the place where foot 2 lands: 13 rows.
    The stance foot of the next step then stands at the origin, which pins the walker's place.
    """
    walker = SymbolicWalker()
    w, lam = ca.SX.sym("w", layout.POINT_WIDTH), ca.SX.sym("lam", 13)
    parameters = ca.vertcat(walker.symbols, ca.SX.sym("h"))
    units = ca.vertcat(*point_units(walker))
    point = layout.Point.of(w * units)
    step_length = foot_position(walker, point.q, 1)[0]
    q = point.q[list(RELABELLED)]
    q[0] -= step_length
    state = ca.vertcat(q, point.p[list(RELABELLED)]) / units[:12]
    rows = ca.vertcat(state, step_length / walker.leg_length)
    jacobian = ca.jacobian(rows, w)
    hessian = ca.triu(ca.hessian(ca.dot(lam, rows), w)[0])
    return [
        ca.Function("boundary_rows", [w, parameters], [rows]),
        ca.Function("boundary_jacobian", [w, parameters], [rows, jacobian.nz[:]]),
        ca.Function("boundary_hessian", [w, parameters, lam], [hessian.nz[:]]),
        ca.Function("boundary_jacobian_pattern", [w, parameters], [jacobian]),
        ca.Function("boundary_hessian_pattern", [w, parameters, lam], [hessian]),
    ]
