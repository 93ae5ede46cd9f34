"""Where each quantity of the report's 23 N + 2 variables and 20 N + 1 constraints stands."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

# Rows of one grid point's column of variables.
Q = slice(0, 6)
P = slice(6, 12)
STATE = slice(0, 12)
U = slice(12, 15)
REACTION = slice(15, 21)
SLIP = slice(21, 23)
STATE_WIDTH = 12
POINT_WIDTH = 23
SPRING_WIDTH = 2

# Rows of one grid point's column of constraints: dynamics, the sides a of the pairs, the products a b, and,
# for given contacts, both sides of each foot's friction cone, mu lambda_y -+ (lambda_x+ - lambda_x-).
DYNAMICS = slice(0, 12)
PAIR_SIDES = slice(12, 20)
PRODUCTS = slice(20, 28)
CONE_SIDES = slice(28, 32)
ROW_WIDTH = 32
# The report's own; the rest is for given contacts.
REPORT_ROWS = slice(0, 28)


@dataclass(frozen=True)
class Point:
    """Named parts of one grid point's column of variables."""

    q: ca.SX
    p: ca.SX
    u: ca.SX
    reaction: ca.SX
    slip_speed: ca.SX

    @classmethod
    def of(cls, column: ca.SX) -> "Point":
        """Split a column, (23,)."""
        return cls(column[Q], column[P], column[U], column[REACTION], column[SLIP])


def pack(points: NDArray[np.float64], spring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the vector of all variables, (23 N + 2,), from points (23, N) and (K, q_eq)."""
    return np.concatenate([points.ravel(order="F"), spring])


def unpack(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points (23, N) and (K, q_eq) from the vector of all variables, (23 N + 2,)."""
    return x[:-SPRING_WIDTH].reshape(POINT_WIDTH, -1, order="F"), x[-SPRING_WIDTH:]
