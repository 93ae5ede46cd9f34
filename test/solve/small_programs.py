"""Programs of two variables, for provoking each end of a solve."""

import casadi as ca
import numpy as np

from walk_optimizer.transcription.program import Nlp, Problem


def program(objective, rows, lower_g, upper_g, lower_x=(-np.inf, -np.inf), upper_x=(np.inf, np.inf)):
    """min objective(x) with lower_g <= rows(x) <= upper_g."""
    x, p = ca.MX.sym("x", 2), ca.MX.sym("p", 0)
    f, g = objective(x), rows(x)
    sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", g.numel())
    hessian = ca.hessian(sigma * f + ca.dot(lam, g), x)[0]
    nlp = Nlp(
        expressions={"x": x, "p": p, "f": f, "g": g},
        jacobian=ca.Function("nlp_jac_g", [x, p], [g, ca.jacobian(g, x)], ["x", "p"], ["g", "jac_g_x"]),
        hessian=ca.Function(
            "nlp_hess_l",
            [x, p, sigma, lam],
            [ca.triu(hessian)],
            ["x", "p", "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
        gradient=ca.Function(
            "nlp_grad_f", [x, p], [f, ca.densify(ca.gradient(f, x))], ["x", "p"], ["f", "grad_f_x"]
        ),
    )
    bounds = (np.array(one, dtype=float) for one in (lower_x, upper_x, lower_g, upper_g))
    return Problem(nlp, np.zeros(0), *bounds)


def rosenbrock(lower_g=(-10.0,), upper_g=(10.0,)):
    """The banana valley, optimum at (1, 1), with a row x + y that need not matter."""
    return program(
        lambda x: (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2, lambda x: x[0] + x[1], lower_g, upper_g
    )


def contradiction():
    """A circle of radius 1 and a line that passes it by at a distance."""
    return program(
        ca.sumsqr,
        lambda x: ca.vertcat(ca.sumsqr(x), x[0] + x[1]),
        lower_g=(1.0, 5.0),
        upper_g=(1.0, np.inf),
    )


def logarithm():
    """An objective without a value where the only start is."""
    return program(lambda x: ca.log(x[0]) + x[1] ** 2, lambda x: x[0] + x[1], (-10.0,), (10.0,))


START = np.array([-1.2, 1.0])
