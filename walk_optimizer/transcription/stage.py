"""Stages: what a chain is made of, and how it begins and ends."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StageKind:
    """One kind of stage.

    Attributes:
        name: Prefix of its functions: `<name>_value` (w, s, par) -> rows; `<name>_jacobian` adds the nonzeros
            of d rows with respect to (w, s); `<name>_cost` (w, s, par) -> cost; `<name>_gradient` adds its
            gradient by (w, s); `<name>_hessian` (w, s, par, sigma, lam) -> nonzeros of the upper triangle
            for sigma cost + lam' rows;
            `<name>_jacobian_pattern` and `<name>_hessian_pattern` have the patterns. par is the
            model's vector and one number of the stage's own.
        functions: These functions.
        width: Number of its variables w.
        rows: Number of its rows.
        state: Which of its variables are the state that it hands on.
        shared: Number of shared variables s that it takes.
        previous: Constant derivative of the rows with respect to the state handed to it, (rows, states).
    """

    name: str
    functions: dict[str, ca.Function]
    width: int
    rows: int
    state: slice
    shared: int
    previous: FloatArray

    @property
    def model_parameters(self) -> int:
        """Number of entries of the model's vector."""
        return int(self.functions[f"{self.name}_value"].numel_in(2)) - 1

    @property
    def states(self) -> int:
        """Number of entries of a state."""
        return int(self.previous.shape[1])


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage in a chain.

    Attributes:
        kind: Its kind.
        shared: Which of the chain's shared variables it takes, in the order of its functions.
        kept: Which of its rows take part, (rows,).
    """

    kind: StageKind
    shared: tuple[int, ...]
    kept: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Ends:
    """How a chain begins and ends, as functions of the last stage's state z.

    Attributes:
        name: Prefix of its functions: `<name>_value` (z, par) -> the state handed to the first stage,
            then further rows of the program; `<name>_jacobian` adds the nonzeros of the Jacobian;
            `<name>_hessian` (z, par, lam) -> nonzeros of the upper triangle for lam' rows; and
            `<name>_jacobian_pattern`, `<name>_hessian_pattern`. par is the model's vector and then
            numbers of the ends' own.
        functions: These functions.
    """

    name: str
    functions: dict[str, ca.Function]

    @property
    def parameters(self) -> int:
        """Number of entries of par."""
        return int(self.functions[f"{self.name}_value"].numel_in(1))

    @property
    def rows(self) -> int:
        """Number of its rows, the state handed to the first stage included."""
        return int(self.functions[f"{self.name}_value"].numel_out(0))
