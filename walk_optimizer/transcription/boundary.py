"""Closes the chain of a step: the legs change names, and the hip moves back by one step length."""

import casadi as ca

from walk_optimizer.model.kinematics import RELABELLED, foot_position
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.transcription.scaling import point_units


def boundary_functions() -> list[ca.Function]:
    """Return the functions that join the last state of a step to its first, in scaled variables.

    `boundary_value(z, walker)` gives the state before the step (12 rows) and the step length, the
    place where foot 2 lands. The stance foot of the next step then stands at the origin, which pins
    the walker's place. `boundary_jacobian` adds the nonzeros of the Jacobian, `boundary_hessian`
    gives those of the upper triangle for multipliers (13,) of the rows.
    """
    walker = SymbolicWalker()
    z, lam = ca.SX.sym("z", 12), ca.SX.sym("lam", 13)
    units = ca.vertcat(*point_units(walker)[:12])
    physical = z * units
    q, p = physical[:6], physical[6:]
    step_length = foot_position(walker, q, 1)[0]
    relabelled = q[list(RELABELLED)]
    relabelled[0] -= step_length
    state = ca.vertcat(relabelled, p[list(RELABELLED)]) / units
    rows = ca.vertcat(state, step_length / walker.leg_length)
    jacobian = ca.jacobian(rows, z)
    hessian = ca.triu(ca.hessian(ca.dot(lam, rows), z)[0])
    inputs = [z, walker.symbols]
    return [
        ca.Function("boundary_value", inputs, [rows]),
        ca.Function("boundary_jacobian", inputs, [rows, jacobian.nz[:]]),
        ca.Function("boundary_hessian", [*inputs, lam], [hessian.nz[:]]),
        ca.Function("boundary_jacobian_pattern", inputs, [jacobian]),
        ca.Function("boundary_hessian_pattern", [*inputs, lam], [hessian]),
    ]
