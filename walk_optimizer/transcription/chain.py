"""Assembles the sparse nonlinear program of a periodic chain of stages.

A stage is one grid point, one collocation interval or one impact. Each hands a state on to the next,
and the last to the first with the legs relabelled. A stage's rows depend nonlinearly on its own
variables and on the shared ones (spring, durations), and linearly on the state handed to it, so the
program's derivatives are those of single stages, evaluated by a map and gathered into place.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import DYNAMIC_PARAMETERS
from walk_optimizer.transcription.boundary import boundary_functions
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.program import Nlp

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

STATE_WIDTH = 12
_WALKER_PARAMETERS = len(DYNAMIC_PARAMETERS)


@dataclass(frozen=True, eq=False)
class StageKind:
    """One kind of stage.

    Attributes:
        name: Prefix of its functions: `<name>_value` (w, s, par) -> rows, cost; `<name>_jacobian`
            adds the nonzeros of d rows and of d cost with respect to (w, s); `<name>_hessian`
            (w, s, par, sigma, lam) -> nonzeros of the upper triangle for sigma cost + lam' rows;
            `<name>_jacobian_pattern` and `<name>_hessian_pattern` have the patterns. par is the
            walker's vector and one number of the stage's own.
        functions: These functions.
        width: Number of its variables w.
        rows: Number of its rows.
        state: Which of its variables are the state that it hands on, 12 of them.
        shared: Number of shared variables s that it takes.
        previous: Constant derivative of the rows with respect to the state handed to it, (rows, 12).
    """

    name: str
    functions: dict[str, ca.Function]
    width: int
    rows: int
    state: slice
    shared: int
    previous: FloatArray


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


def assemble(stages: Sequence[Stage], shared_count: int, shared_rows: FloatArray) -> Nlp:
    """Return the nonlinear program of a chain.

    Variables are those of all stages, then the shared ones. Rows are the kept ones of all stages,
    then the step length, then the linear rows in the shared variables. Parameters are the walker's
    vector and the own number of each stage.

    Args:
        stages: The chain.
        shared_count: Number of shared variables.
        shared_rows: Coefficients of further linear rows in the shared variables, (rows, shared_count).
    """
    graph = _Graph(stages, shared_count, shared_rows)
    x, p = graph.x, graph.p
    sigma, lam = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", graph.row_count)
    g, f = graph.values()
    jacobian_g, jacobian, cost, gradient = graph.derivatives()
    names = ["x", "p"]
    return Nlp(
        expressions={"x": x, "p": p, "f": f, "g": g},
        jacobian=ca.Function("nlp_jac_g", [x, p], [jacobian_g, jacobian], names, ["g", "jac_g_x"]),
        hessian=ca.Function(
            "nlp_hess_l",
            [x, p, sigma, lam],
            [graph.hessian(sigma, lam)],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
        gradient=ca.Function("nlp_grad_f", [x, p], [cost, gradient], names, ["f", "grad_f_x"]),
    )


class _Group:
    """All stages of one kind: where their variables, rows and patterns stand in the program."""

    def __init__(self, kind: StageKind, members: IntArray, graph: "_Graph") -> None:
        self.kind, self.members = kind, members
        shared = np.array([graph.stages[i].shared for i in members], dtype=np.int64).T
        own = graph.column_offset[members] + np.arange(kind.width)[:, None]
        self.columns = np.vstack([own, graph.shared_offset + shared.reshape(kind.shared, members.size)])
        self.row_indices = graph.row_offset[members] + np.arange(kind.rows)[:, None]

    def mapped(self, graph: "_Graph", name: str, *extra: ca.MX) -> list[ca.MX]:
        """Evaluate a function of the kind for all of its stages."""
        count = self.members.size
        variables = _picked(graph.x, self.columns)
        w, s = variables[: self.kind.width, :], variables[self.kind.width :, :]
        own = graph.p[(_WALKER_PARAMETERS + self.members).tolist()].T
        par = ca.vertcat(ca.repmat(graph.p[:_WALKER_PARAMETERS], 1, count), own)
        outputs = self.kind.functions[f"{self.kind.name}_{name}"].map(count)(w, s, par, *extra)
        return list(outputs) if isinstance(outputs, tuple | list) else [outputs]

    def jacobian_places(self) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the nonzeros of the stages' Jacobians, stage by stage."""
        rows, columns = _pattern(self.kind.functions[f"{self.kind.name}_jacobian_pattern"])
        return self.row_indices[rows].ravel(order="F"), self.columns[columns].ravel(order="F")

    def hessian_places(self) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the nonzeros of the stages' Hessians, stage by stage."""
        rows, columns = _pattern(self.kind.functions[f"{self.kind.name}_hessian_pattern"])
        return self.columns[rows].ravel(order="F"), self.columns[columns].ravel(order="F")


class _Graph:
    """The symbols of the whole program, and its values and derivatives as expressions of them."""

    def __init__(self, stages: Sequence[Stage], shared_count: int, shared_rows: FloatArray) -> None:
        self.stages, self.shared_rows = stages, shared_rows
        self.boundary = compiled(boundary_functions)
        widths, heights = ([getattr(one.kind, name) for one in stages] for name in ("width", "rows"))
        self.column_offset = np.concatenate([[0], np.cumsum(widths)[:-1]])
        self.row_offset = np.concatenate([[0], np.cumsum(heights)[:-1]])
        self.shared_offset, self.all_rows = int(sum(widths)), int(sum(heights))
        self.kept = np.flatnonzero(np.concatenate([one.kept for one in stages]))
        self.x = ca.MX.sym("x", self.shared_offset + shared_count)
        self.p = ca.MX.sym("p", _WALKER_PARAMETERS + len(stages))
        kinds = dict.fromkeys(one.kind for one in stages)
        self.groups = [
            _Group(kind, np.array([i for i, one in enumerate(stages) if one.kind is kind]), self)
            for kind in kinds
        ]
        offsets = [
            column + one.kind.state.start for column, one in zip(self.column_offset, stages, strict=True)
        ]
        self.state_columns = np.array(offsets) + np.arange(STATE_WIDTH)[:, None]
        self.last_state = self.x[self.state_columns[:, -1].tolist()]

    @property
    def row_count(self) -> int:
        """Rows of the program."""
        return int(self.kept.size) + 1 + int(self.shared_rows.shape[0])

    def _rows(self, own: Sequence[ca.MX], end: ca.MX) -> ca.MX:
        """Return g from the groups' own rows, and the boundary's 13 rows of the last state."""
        states = ca.horzcat(end[:STATE_WIDTH], _picked(self.x, self.state_columns[:, :-1]))
        every_row = ca.MX.zeros(self.all_rows, 1)
        for group, rows in zip(self.groups, own, strict=True):
            before = states[:, group.members.tolist()]
            complete = rows + ca.mtimes(_sparse(group.kind.previous), before)
            every_row[group.row_indices.ravel(order="F").tolist()] = ca.vec(complete)
        shared = self.x[self.shared_offset :]
        linear = ca.mtimes(ca.DM(self.shared_rows), shared)
        return ca.vertcat(every_row[self.kept.tolist()], end[STATE_WIDTH], linear)

    def values(self) -> tuple[ca.MX, ca.MX]:
        """Return g and f."""
        outputs = [group.mapped(self, "value") for group in self.groups]
        end = self.boundary["boundary_value"](self.last_state, self.p[:_WALKER_PARAMETERS])
        f = sum(ca.sum2(cost) for _, cost in outputs)
        return self._rows([rows for rows, _ in outputs], end), f

    def derivatives(self) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX]:
        """Return g, its Jacobian, f and its gradient."""
        outputs = [group.mapped(self, "jacobian") for group in self.groups]
        walker = self.p[:_WALKER_PARAMETERS]
        end, end_nonzeros = self.boundary["boundary_jacobian"](self.last_state, walker)
        g = self._rows([one[0] for one in outputs], end)
        places = [group.jacobian_places() for group in self.groups]
        values = [ca.vec(one[2]) for one in outputs]
        for rows, columns, more in (
            *self._handed_on(),
            self._closing(end_nonzeros),
            *self._ends(end_nonzeros),
        ):
            places.append((rows, columns))
            values.append(more)
        jacobian = self._gathered_rows(places, ca.vertcat(*values))
        f = sum(ca.sum2(one[1]) for one in outputs)
        return g, jacobian, f, self._gradient([one[3] for one in outputs])

    def _gradient(self, gradients: Sequence[ca.MX]) -> ca.MX:
        columns = np.concatenate([group.columns.ravel(order="F") for group in self.groups])
        values = ca.vertcat(*(ca.vec(one) for one in gradients))
        gathered = gather(columns, np.zeros_like(columns), values, (self.x.numel(), 1))
        return ca.densify(gathered)

    def _handed_on(self) -> list[tuple[IntArray, IntArray, ca.MX]]:
        """Return the constant derivatives of each stage but the first by the state handed to it."""
        entries = []
        for i in range(1, len(self.stages)):
            previous = self.stages[i].kind.previous
            rows, columns = np.nonzero(previous)
            place = (self.row_offset[i] + rows, self.state_columns[columns, i - 1])
            entries.append((*place, ca.DM(previous[rows, columns])))
        return [_joined(entries)] if entries else []

    def _closing(self, end_nonzeros: ca.MX) -> tuple[IntArray, IntArray, ca.MX]:
        """Return the derivatives of the first stage by the last one's state."""
        previous = self.stages[0].kind.previous
        rows, states = np.nonzero(previous)
        end_rows, end_columns = _pattern(self.boundary["boundary_jacobian_pattern"])
        pairs = [(k, n) for k, state in enumerate(states) for n in np.flatnonzero(end_rows == state)]
        entry, nonzero = np.array(pairs).T
        values = ca.DM(previous[rows[entry], states[entry]]) * end_nonzeros[nonzero.tolist()]
        return rows[entry], self.state_columns[end_columns[nonzero], -1], values

    def _ends(self, end_nonzeros: ca.MX) -> list[tuple[IntArray, IntArray, ca.MX]]:
        """Return the derivatives of the step length and of the linear rows."""
        end_rows, end_columns = _pattern(self.boundary["boundary_jacobian_pattern"])
        landing = np.flatnonzero(end_rows == STATE_WIDTH)
        columns = self.state_columns[end_columns[landing], -1]
        rows = np.full(landing.size, self.all_rows)
        linear_rows, linear_columns = np.nonzero(self.shared_rows)
        coefficients = self.shared_rows[linear_rows, linear_columns]
        return [
            (rows, columns, end_nonzeros[landing.tolist()]),
            (self.all_rows + 1 + linear_rows, self.shared_offset + linear_columns, ca.DM(coefficients)),
        ]

    def _gathered_rows(self, places: Sequence[tuple[IntArray, IntArray]], values: ca.MX) -> ca.MX:
        """Return the sparse matrix of the values in the rows that take part."""
        rows, columns = (np.concatenate(parts) for parts in zip(*places, strict=True))
        kept = np.concatenate([self.kept, self.all_rows + np.arange(1 + self.shared_rows.shape[0])])
        place = np.full(self.all_rows + 1 + self.shared_rows.shape[0], -1)
        place[kept] = np.arange(kept.size)
        inside = np.flatnonzero(place[rows] >= 0)
        shape = (self.row_count, self.x.numel())
        return gather(place[rows[inside]], columns[inside], values[inside.tolist()], shape)

    def hessian(self, sigma: ca.MX, lam: ca.MX) -> ca.MX:
        """Return the upper triangle of the Hessian of sigma f + lam' g."""
        spread = ca.MX.zeros(self.all_rows, 1)
        spread[self.kept.tolist()] = lam[: self.kept.size]
        places, values = [], []
        for group in self.groups:
            multipliers = _picked(spread, group.row_indices)
            weight = ca.repmat(sigma, 1, group.members.size)
            places.append(group.hessian_places())
            values.append(ca.vec(group.mapped(self, "hessian", weight, multipliers)[0]))
        first = self.stages[0].kind
        handed = ca.mtimes(_sparse(first.previous.T), spread[: first.rows])
        end_multipliers = ca.vertcat(handed, lam[self.kept.size])
        walker = self.p[:_WALKER_PARAMETERS]
        values.append(self.boundary["boundary_hessian"](self.last_state, walker, end_multipliers))
        end_rows, end_columns = _pattern(self.boundary["boundary_hessian_pattern"])
        places.append((self.state_columns[end_rows, -1], self.state_columns[end_columns, -1]))
        rows, columns = (np.concatenate(parts) for parts in zip(*places, strict=True))
        return gather(rows, columns, ca.vertcat(*values), (self.x.numel(), self.x.numel()))


def gather(rows: IntArray, columns: IntArray, values: ca.MX, shape: tuple[int, int]) -> ca.MX:
    """Return the sparse matrix with the values in their places; those of one place are added."""
    places, which = np.unique(columns * shape[0] + rows, return_inverse=True)
    pattern = ca.Sparsity.triplet(*shape, (places % shape[0]).tolist(), (places // shape[0]).tolist())
    if places.size == which.size:
        return ca.MX(pattern, values[np.argsort(which).tolist()])
    adder = ca.Sparsity.triplet(places.size, which.size, which.tolist(), list(range(which.size)))
    return ca.MX(pattern, ca.mtimes(ca.DM(adder, np.ones(which.size)), values))


def _picked(vector: ca.MX, indices: IntArray) -> ca.MX:
    """Return the entries of a vector in the shape of an array of indices."""
    return ca.reshape(vector[indices.ravel(order="F").tolist()], *indices.shape)


def _sparse(matrix: FloatArray) -> ca.DM:
    return ca.sparsify(ca.DM(matrix))


def _joined(entries: Sequence[tuple[IntArray, IntArray, ca.DM]]) -> tuple[IntArray, IntArray, ca.MX]:
    rows, columns, values = zip(*entries, strict=True)
    return np.concatenate(rows), np.concatenate(columns), ca.vertcat(*values)


def _pattern(function: ca.Function) -> tuple[IntArray, IntArray]:
    """Return rows and columns of the nonzeros of a function's first output."""
    rows, columns = function.sparsity_out(0).get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)
