"""A nonlinear program and its numbers."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class StageOrder:
    """Which stage of a chain each variable and each row belongs to.

    A row depends on variables of its own stage and of the one before it (the last one for those of the
    first), and on shared variables.

    Attributes:
        variables: Stage of each variable, (n,); -1 for shared ones.
        rows: Stage of each row, (m,).
    """

    variables: IntArray
    rows: IntArray


@dataclass(frozen=True, eq=False)
class Nlp:
    """A nonlinear program min f(x, p) with rows g(x, p), with exact sparse derivatives.

    Attributes:
        expressions: x, p, f and g for `casadi.nlpsol`.
        jacobian: (x, p) -> (g, dg/dx).
        hessian: (x, p, lam_f, lam_g) -> upper triangle of the Hessian of the Lagrangian.
        gradient: (x, p) -> (f, df/dx).
        stages: Its structure, for solvers that make use of one; None where it has none.
    """

    expressions: dict[str, ca.MX]
    jacobian: ca.Function
    hessian: ca.Function
    gradient: ca.Function
    stages: StageOrder | None = None


@dataclass(frozen=True, eq=False)
class Problem:
    """A nonlinear program with its parameters and bounds; all values are scaled.

    Attributes:
        nlp: Functions and derivatives.
        parameters: p.
        lower_x: Lower bounds of x.
        upper_x: Upper bounds of x.
        lower_g: Lower bounds of g.
        upper_g: Upper bounds of g.
    """

    nlp: Nlp
    parameters: FloatArray
    lower_x: FloatArray
    upper_x: FloatArray
    lower_g: FloatArray
    upper_g: FloatArray

    def infeasibility(self, x: FloatArray, g: FloatArray) -> float:
        """Return the largest violation of any bound at x with rows g; not a number if any value is not."""
        gaps = (self.lower_x - x, x - self.upper_x, self.lower_g - g, g - self.upper_g)
        return float(np.max([0.0, *(gap.max() for gap in gaps)]))
