"""A program in its free variables, with functions under the names that CasADi's solvers look up.

Variables whose bounds are equal are no variables: they become parameters.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.transcription.program import Nlp, Problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def free_variables(problem: Problem) -> IntArray:
    """Return the indices of the variables whose bounds differ."""
    return np.flatnonzero(problem.lower_x != problem.upper_x)


def extended_parameters(problem: Problem) -> FloatArray:
    """Return the parameters of a program in its free variables: its own, then the values of fixed ones."""
    fixed = np.where(problem.lower_x == problem.upper_x, problem.lower_x, 0.0)
    return np.concatenate([problem.parameters, fixed])


@dataclass(frozen=True, eq=False)
class Oracle:
    """Symbols of a program, and its values and derivatives as expressions of them.

    Attributes:
        x: Free variables.
        p: Parameters, see `extended_parameters`.
        sigma: Multiplier of f.
        lam: Multipliers of g.
        f: Objective.
        g: Rows.
        gradient: df/dx, dense.
        jacobian: dg/dx.
        hessian: Upper triangle of the Hessian of sigma f + lam' g.
    """

    x: ca.MX
    p: ca.MX
    sigma: ca.MX
    lam: ca.MX
    f: ca.MX
    g: ca.MX
    gradient: ca.MX
    jacobian: ca.MX
    hessian: ca.MX

    @classmethod
    def of(cls, nlp: Nlp, free: IntArray) -> "Oracle":
        """Return the oracle of a program in its free variables."""
        width, count = nlp.expressions["x"].numel(), nlp.expressions["p"].numel()
        x, p = ca.MX.sym("x", free.size), ca.MX.sym("p", count + width)
        sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", nlp.expressions["g"].numel())
        pattern = ca.Sparsity.triplet(width, free.size, free.tolist(), list(range(free.size)))
        whole, own = p[count:] + ca.mtimes(ca.DM(pattern, 1), x), p[:count]
        _, f_gradient = nlp.gradient(whole, own)
        _, jacobian = nlp.jacobian(whole, own)
        hessian = nlp.hessian(whole, own, sigma, lam)
        columns = free.tolist()
        return cls(
            x, p, sigma, lam,
            f=_value(nlp, "f", whole, own),
            g=_value(nlp, "g", whole, own),
            gradient=f_gradient[columns],
            jacobian=jacobian[:, columns],
            hessian=hessian[columns, columns],
        )  # fmt: skip

    @property
    def expressions(self) -> dict[str, ca.MX]:
        """What `casadi.nlpsol` takes."""
        return {"x": self.x, "p": self.p, "f": self.f, "g": self.g}

    @property
    def lagrangian_gradient(self) -> ca.MX:
        """The gradient of sigma f + lam' g, dense."""
        return ca.densify(self.sigma * self.gradient + ca.mtimes(self.jacobian.T, self.lam))

    def function(self, name: str, *outputs: ca.MX, multipliers: bool = False) -> ca.Function:
        """Return (x, p) -> outputs, or with multipliers (x, p, sigma, lam) -> outputs."""
        inputs = [self.x, self.p] + [self.sigma, self.lam] * multipliers
        return ca.Function(name, inputs, list(outputs))

    def values(self) -> dict[str, ca.Function]:
        """Return what every solver looks up: f, g, df/dx, and the gradients that end a solve."""
        no_sensitivity = ca.MX.zeros(self.p.numel())
        ending = (self.f, self.g, self.lagrangian_gradient, no_sensitivity)
        return {
            "nlp_f": self.function("nlp_f", self.f),
            "nlp_g": self.function("nlp_g", self.g),
            "nlp_grad_f": self.function("nlp_grad_f", self.gradient),
            "nlp_grad": self.function("nlp_grad", *ending, multipliers=True),
        }


def _value(nlp: Nlp, name: str, x: ca.MX, p: ca.MX) -> ca.MX:
    """Return f or g at other symbols than the program's own."""
    symbols = [nlp.expressions["x"], nlp.expressions["p"]]
    return ca.Function(name, symbols, [nlp.expressions[name]])(x, p)
