"""Assembles the sparse nonlinear program of all grid points from the functions of one.

The stage functions are evaluated for all points by a map; a constant 0/1 matrix then gathers their
nonzeros into the compressed columns of the whole Jacobian and Hessian.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.transcription import layout
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.euler_stage import boundary_functions, stage_functions
from walk_optimizer.transcription.program import Nlp

_PARAMETERS = 8


@dataclass(frozen=True)
class _Triplets:
    """Row and column of each value that the stage functions return, in the whole matrix."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]

    def gather(self, values: ca.MX, shape: tuple[int, int]) -> ca.MX:
        """Return the sparse matrix of the values; those of one place are added."""
        places, which = np.unique(self.columns * shape[0] + self.rows, return_inverse=True)
        pattern = ca.Sparsity.triplet(*shape, (places % shape[0]).tolist(), (places // shape[0]).tolist())
        if places.size == which.size:
            nonzeros = values[np.argsort(which).tolist()]
        else:
            sparsity = ca.Sparsity.triplet(places.size, which.size, which.tolist(), list(range(which.size)))
            nonzeros = ca.mtimes(ca.DM(sparsity, np.ones(which.size)), values)
        return ca.MX(pattern, nonzeros)


class _Graph:
    """The symbols of the whole program and the maps of its stage functions."""

    def __init__(self, rows: NDArray[np.bool_]) -> None:
        """Prepare the symbols; `rows`, (28, N), tells which rows of each point take part."""
        self.points = rows.shape[1]
        self.stage = compiled(stage_functions)
        self.boundary = compiled(boundary_functions)
        self.kept = np.flatnonzero(rows.ravel(order="F"))
        self.x = ca.MX.sym("x", layout.POINT_WIDTH * self.points + layout.SPRING_WIDTH)
        self.p = ca.MX.sym("p", _PARAMETERS)
        self.w = ca.reshape(self.x[: -layout.SPRING_WIDTH], layout.POINT_WIDTH, self.points)
        self.spring = self.x[-layout.SPRING_WIDTH :]

    @property
    def row_count(self) -> int:
        """Rows of the program: those that take part and the step length."""
        return self.kept.size + 1

    def _mapped(self, name: str, *extra: ca.MX) -> ca.MX:
        before = self.boundary["boundary_rows"](self.w[:, -1], self.p)[:12]
        states = ca.horzcat(before, self.w[layout.STATE, :-1])
        everywhere = (ca.repmat(value, 1, self.points) for value in (self.spring, self.p))
        return self.stage[name].map(self.points)(self.w, states, *everywhere, *extra)

    def rows(self) -> ca.MX:
        """Return g."""
        step_length = self.boundary["boundary_rows"](self.w[:, -1], self.p)[12]
        return ca.vertcat(ca.vec(self._mapped("stage_rows"))[self.kept.tolist()], step_length)

    def jacobian(self) -> tuple[ca.MX, ca.MX]:
        """Return g and its Jacobian."""
        rows, nonzeros = self._mapped("stage_jacobian")
        end, end_nonzeros = self.boundary["boundary_jacobian"](self.w[:, -1], self.p)
        g = ca.vertcat(ca.vec(rows)[self.kept.tolist()], end[12])
        triplets, kept = self._jacobian_triplets()
        constant = -np.ones(12 * (self.points - 1))
        end_sign = self._boundary_sign()
        values = ca.vertcat(ca.vec(nonzeros), ca.DM(constant), end_sign * end_nonzeros)
        return g, triplets.gather(values[kept.tolist()], (self.row_count, self.x.numel()))

    def _boundary_sign(self) -> ca.DM:
        """The state before point 1 enters its dynamics with a minus, the step length is a row as it is."""
        rows, _ = _pattern(self.boundary["boundary_jacobian_pattern"])
        return ca.DM(np.where(rows < 12, -1.0, 1.0))

    def _jacobian_triplets(self) -> tuple[_Triplets, NDArray[np.int64]]:
        """Return the places of the kept values, and which values are kept."""
        rows, columns = _stacked(self.stage["stage_jacobian_pattern"], self.points)
        point, state = np.repeat(np.arange(1, self.points), 12), np.tile(np.arange(12), self.points - 1)
        rows = np.append(rows, layout.ROW_WIDTH * point + state)
        columns = np.append(columns, layout.POINT_WIDTH * (point - 1) + state)
        end_rows, end_columns = _pattern(self.boundary["boundary_jacobian_pattern"])
        last = layout.ROW_WIDTH * self.points
        rows = np.append(rows, np.where(end_rows < 12, end_rows, last))
        columns = np.append(columns, layout.POINT_WIDTH * (self.points - 1) + end_columns)
        place = np.full(last + 1, -1)
        place[self.kept] = np.arange(self.kept.size)
        place[last] = self.kept.size
        kept = np.flatnonzero(place[rows] >= 0)
        return _Triplets(place[rows[kept]], columns[kept]), kept

    def hessian(self, sigma: ca.MX, lam: ca.MX) -> ca.MX:
        """Return the upper triangle of the Hessian of sigma f + lam' g."""
        spread = ca.MX.zeros(layout.ROW_WIDTH * self.points, 1)
        spread[self.kept.tolist()] = lam[:-1]
        multipliers = ca.reshape(spread, layout.ROW_WIDTH, self.points)
        weight = ca.repmat(sigma / self.points, 1, self.points)
        nonzeros = self._mapped("stage_hessian", weight, multipliers)
        end_multipliers = ca.vertcat(-multipliers[layout.DYNAMICS, 0], lam[-1])
        end = self.boundary["boundary_hessian"](self.w[:, -1], self.p, end_multipliers)
        rows, columns = _stacked_square(self.stage["stage_hessian_pattern"], self.points)
        end_rows, end_columns = _pattern(self.boundary["boundary_hessian_pattern"])
        offset = layout.POINT_WIDTH * (self.points - 1)
        triplets = _Triplets(np.append(rows, offset + end_rows), np.append(columns, offset + end_columns))
        return triplets.gather(ca.vertcat(ca.vec(nonzeros), end), (self.x.numel(), self.x.numel()))


def _pattern(function: ca.Function) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the nonzeros of a function's first output."""
    rows, columns = function.sparsity_out(0).get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)


def _global_column(column: NDArray[np.int64], points: int) -> NDArray[np.int64]:
    """Return the column in x of each of a stage's 23 + 2 columns, for all points, point by point."""
    point = np.repeat(np.arange(points), column.size)
    local = np.tile(column, points)
    is_spring = local >= layout.POINT_WIDTH
    return np.where(is_spring, layout.POINT_WIDTH * (points - 1) + local, layout.POINT_WIDTH * point + local)


def _stacked(function: ca.Function, points: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the places of the stage Jacobians' nonzeros in the Jacobian of all rows."""
    rows, columns = _pattern(function)
    offset = layout.ROW_WIDTH * np.repeat(np.arange(points), rows.size)
    return offset + np.tile(rows, points), _global_column(columns, points)


def _stacked_square(function: ca.Function, points: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the places of the stage Hessians' nonzeros in the Hessian of the program."""
    rows, columns = _pattern(function)
    return _global_column(rows, points), _global_column(columns, points)


def assemble(rows: NDArray[np.bool_]) -> Nlp:
    """Return the nonlinear program with the chosen constraint rows.

    The objective is F / (N u_unit^2), the mean of |u|^2 / 2 in units of torque.

    Args:
        rows: Which rows of the layout take part at each grid point, (28, N). The step length
            is always the last row.
    """
    graph = _Graph(rows)
    x, p = graph.x, graph.p
    torques = graph.w[layout.U, :]
    objective = ca.sumsqr(torques) / (2 * graph.points)
    sigma, lam = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", graph.row_count)
    above, below = layout.U.start, layout.POINT_WIDTH - layout.U.stop
    columns = ca.vertcat(
        ca.MX.zeros(above, graph.points), torques / graph.points, ca.MX.zeros(below, graph.points)
    )
    gradient = ca.vertcat(ca.vec(columns), ca.MX.zeros(layout.SPRING_WIDTH, 1))
    names = ["x", "p"]
    return Nlp(
        expressions={"x": x, "p": p, "f": objective, "g": graph.rows()},
        jacobian=ca.Function("nlp_jac_g", [x, p], list(graph.jacobian()), names, ["g", "jac_g_x"]),
        hessian=ca.Function(
            "nlp_hess_l",
            [x, p, sigma, lam],
            [graph.hessian(sigma, lam)],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
        gradient=ca.Function("nlp_grad_f", [x, p], [objective, gradient], names, ["f", "grad_f_x"]),
    )
