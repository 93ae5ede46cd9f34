"""Lays a program out as fatrop wants it: states X_k, controls U_k, gaps X_k+1 - F(X_k, U_k) = 0, path rows.

The controls of a stage are its own variables. Its state is what the stage before hands on, and with it
what everybody must know, carried along unchanged: the shared variables, and the last stage's state, on
which the first stage's rows depend. So every gap is linear, and periodicity is the last row block:
X_N hands on what was carried. Values are those of the program at its own variables, since the copies
agree along all steps of a Newton method that starts with copies that agree.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.solve.oracle import IntArray, Oracle
from walk_optimizer.transcription.program import StageOrder
from walk_optimizer.transcription.sparse import gather

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Block:
    """Where the parts of one stage stand among the columns; the last one has no controls.

    Attributes:
        handed: Copies of what the stage before hands on.
        shared: Copies of the shared variables.
        carried: Copies of what the last stage hands on.
        own: The stage's own variables.
    """

    handed: IntArray
    shared: IntArray
    carried: IntArray
    own: IntArray

    @property
    def state(self) -> IntArray:
        """Columns of the state."""
        return np.concatenate([self.handed, self.shared, self.carried])


class Staging:
    """The columns and rows of a staged program, and the places of the original's entries in it."""

    def __init__(self, oracle: Oracle, order: StageOrder) -> None:
        """Lay out.

        Args:
            oracle: The program in its free variables.
            order: Stages of these variables and of the rows.
        """
        self.order = order
        self.count = int(order.variables.max()) + 1
        rows, columns = _pattern(oracle.jacobian)
        stage = order.variables[columns]
        foreign = (stage >= 0) & (stage != order.rows[rows])
        self.handed = [np.unique(columns[foreign & (stage == k)]) for k in range(self.count)]
        self.own = [np.flatnonzero(order.variables == k) for k in range(self.count)]
        self.shared = np.flatnonzero(order.variables < 0)
        self.blocks, self.width = self._columns()
        # Where each variable itself stands, and its place among those that are copied together.
        self.main = np.empty(order.variables.size, dtype=np.int64)
        self.place = np.zeros_like(self.main)
        for block, own in zip(self.blocks, self.own, strict=False):
            self.main[own] = block.own
        self.main[self.shared] = self.blocks[0].shared
        for group in (*self.handed, self.shared):
            self.place[group] = np.arange(group.size)
        self.rows_of = [np.flatnonzero(order.rows == k) for k in range(self.count)]
        self.gaps, self.row_places, self.closing, self.height = self._rows()

    def _columns(self) -> tuple[list[Block], int]:
        blocks, begin = [], 0
        for k in range(self.count + 1):
            sizes = [
                self.handed[k - 1].size if k else 0,
                self.shared.size,
                self.handed[-1].size,
                self.own[k].size if k < self.count else 0,
            ]
            ends = begin + np.cumsum(sizes)
            parts = (np.arange(end - size, end) for size, end in zip(sizes, ends, strict=True))
            blocks.append(Block(*parts))
            begin = int(ends[-1])
        return blocks, begin

    def _rows(self) -> tuple[list[IntArray], IntArray, IntArray, int]:
        """Return rows of the gaps, new places of the program's rows, closing rows, and their number."""
        gaps, places, begin = [], np.empty(self.order.rows.size, dtype=np.int64), 0
        for block, rows in zip(self.blocks[1:], self.rows_of, strict=True):
            gaps.append(begin + np.arange(block.state.size))
            begin += block.state.size
            places[rows] = begin + np.arange(rows.size)
            begin += rows.size
        closing = begin + np.arange(self.handed[-1].size)
        return gaps, places, closing, begin + closing.size

    @property
    def structure(self) -> dict[str, object]:
        """The options that tell fatrop the structure."""
        return {
            "structure_detection": "manual",
            "N": self.count,
            "nx": [block.state.size for block in self.blocks],
            "nu": [block.own.size for block in self.blocks],
            "ng": [*(rows.size for rows in self.rows_of), self.closing.size],
        }

    def linear_entries(self) -> tuple[IntArray, IntArray, FloatArray]:
        """Return rows, columns and values of the gaps and of the closing rows."""
        rows, plus, minus = [], [], []
        for k, gap in enumerate(self.gaps):
            before, after = self.blocks[k], self.blocks[k + 1]
            rows.append(gap)
            plus.append(after.state)
            minus.append(np.concatenate([self.main[self.handed[k]], before.shared, before.carried]))
        rows.append(self.closing)
        plus.append(self.blocks[-1].handed)
        minus.append(self.blocks[-1].carried)
        both = np.concatenate(rows)
        values = np.concatenate([np.ones(both.size), -np.ones(both.size)])
        return np.tile(both, 2), np.concatenate([*plus, *minus]), values

    def columns_seen_by(self, stages: IntArray, variables: IntArray) -> IntArray:
        """Return the columns at which rows or variables of stages see variables: their own, or copies."""
        columns = self.main[variables].copy()
        of = self.order.variables[variables]
        firsts = {
            name: np.array([getattr(block, name)[:1].sum() for block in self.blocks[:-1]])
            for name in ("handed", "shared", "carried")
        }
        for name, where in (
            ("shared", (of < 0) & (stages >= 0)),
            ("handed", (of >= 0) & (of != stages) & (stages > 0)),
            ("carried", (of >= 0) & (of != stages) & (stages == 0)),
        ):
            columns[where] = firsts[name][stages[where]] + self.place[variables[where]]
        return columns

    def spread(self, x: FloatArray) -> FloatArray:
        """Return all columns for values of the free variables."""
        columns = np.empty(self.width)
        columns[self.main] = x
        for k, block in enumerate(self.blocks):
            columns[block.shared], columns[block.carried] = x[self.shared], x[self.handed[-1]]
            columns[block.handed] = x[self.handed[k - 1]] if k else x[:0]
        return columns


def staged_oracle(oracle: Oracle, staging: Staging) -> Oracle:
    """Return a program in the columns and rows of its staging; its Hessian is whole, not a triangle."""
    order, z, lam = staging.order, ca.MX.sym("z", staging.width), ca.MX.sym("lam", staging.height)
    rows, columns, constants = staging.linear_entries()
    linear = ca.DM.triplet(rows.tolist(), columns.tolist(), ca.DM(constants), staging.height, staging.width)
    x, own_lam = z[staging.main.tolist()], lam[staging.row_places.tolist()]
    values = oracle.function("values", oracle.f, oracle.g, oracle.gradient, oracle.jacobian)
    f, g, gradient, jacobian = values(x, oracle.p)
    curvature = oracle.function("curvature", oracle.hessian, multipliers=True)
    hessian = curvature(x, oracle.p, oracle.sigma, own_lam)
    own_rows, variables = _pattern(jacobian)
    seen = staging.columns_seen_by(order.rows[own_rows], variables)
    first, second = _pattern(hessian)
    first_seen = staging.columns_seen_by(order.variables[second], first)
    second_seen = staging.columns_seen_by(order.variables[first], second)
    mirrored = np.flatnonzero(first != second)
    return Oracle(
        x=z,
        p=oracle.p,
        sigma=oracle.sigma,
        lam=lam,
        f=f,
        g=ca.densify(_spread(staging.row_places, g, staging.height) + ca.mtimes(linear, z)),
        gradient=ca.densify(_spread(staging.main, gradient, staging.width)),
        jacobian=gather(
            np.concatenate([staging.row_places[own_rows], rows]),
            np.concatenate([seen, columns]),
            ca.vertcat(jacobian.nz[:], ca.DM(constants)),
            (staging.height, staging.width),
        ),
        hessian=gather(
            np.concatenate([first_seen, second_seen[mirrored]]),
            np.concatenate([second_seen, first_seen[mirrored]]),
            ca.vertcat(hessian.nz[:], hessian.nz[mirrored.tolist()]),
            (staging.width, staging.width),
        ),
    )


def _spread(places: IntArray, values: ca.MX, size: int) -> ca.MX:
    """Return a vector with the values in their places."""
    return gather(places, np.zeros_like(places), values, (size, 1))


def _pattern(matrix: ca.MX) -> tuple[IntArray, IntArray]:
    """Return rows and columns of the nonzeros of a matrix."""
    rows, columns = matrix.sparsity().get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)
