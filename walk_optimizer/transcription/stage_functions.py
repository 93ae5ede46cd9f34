"""Makes the functions of a stage, for code generation, from its scaled rows and cost."""

import casadi as ca


def stage_functions(name: str, w: ca.SX, s: ca.SX, par: ca.SX, rows: ca.SX, cost: ca.SX) -> list[ca.Function]:
    """Return the functions that `StageKind` describes.

    Args:
        name: Prefix of their names.
        w: The stage's variables, scaled.
        s: The shared variables that it takes, scaled.
        par: The walker's vector and the stage's own number.
        rows: Its rows without the part of the state handed to it.
        cost: Its part of the objective.
    """
    sigma, lam = ca.SX.sym("sigma"), ca.SX.sym("lam", rows.numel())
    variables, inputs = ca.vertcat(w, s), [w, s, par]
    jacobian = ca.jacobian(rows, variables)
    gradient = ca.densify(ca.gradient(cost, variables))
    hessian = ca.triu(ca.hessian(sigma * cost + ca.dot(lam, rows), variables)[0])
    return [
        ca.Function(f"{name}_value", inputs, [rows]),
        ca.Function(f"{name}_jacobian", inputs, [rows, jacobian.nz[:]]),
        ca.Function(f"{name}_cost", inputs, [cost]),
        ca.Function(f"{name}_gradient", inputs, [cost, gradient]),
        ca.Function(f"{name}_hessian", [*inputs, sigma, lam], [hessian.nz[:]]),
        ca.Function(f"{name}_jacobian_pattern", inputs, [ca.SX.ones(jacobian.sparsity())]),
        ca.Function(f"{name}_hessian_pattern", [*inputs, sigma, lam], [ca.SX.ones(hessian.sparsity())]),
    ]
