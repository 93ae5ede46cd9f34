"""Assembles the sparse nonlinear program of a chain of stages.

A stage is one grid point, one collocation interval or one impact. Each hands a state on to the next;
what the first one gets, and further rows, come from the last state by way of the ends. A stage's rows
depend nonlinearly on its own variables and on the shared ones (spring, durations), and linearly on the
state handed to it, so the program's derivatives are those of single stages, evaluated by a map and
gathered into place.
"""

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.transcription.program import Nlp, StageOrder
from walk_optimizer.transcription.sparse import IntArray, gather, pattern, picked
from walk_optimizer.transcription.stage import Ends, Stage, StageKind

FloatArray = NDArray[np.float64]
# Rows, columns and values of some entries of a matrix.
Entries = tuple[IntArray, IntArray, ca.MX]


def assemble(stages: Sequence[Stage], ends: Ends, shared_count: int, shared_rows: FloatArray) -> Nlp:
    """Return the nonlinear program of a chain.

    Variables are those of all stages, then the shared ones. Rows are the kept ones of all stages, then
    those of the ends, then the linear rows in the shared variables. Parameters are the model's vector,
    the own number of each stage, and the ends' own numbers.

    Args:
        stages: The chain.
        ends: How it begins and ends.
        shared_count: Number of shared variables.
        shared_rows: Coefficients of further linear rows in the shared variables, (rows, shared_count).
    """
    graph = _Graph(stages, ends, shared_count, shared_rows)
    x, p = graph.x, graph.p
    sigma, lam = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", graph.row_count)
    names = ["x", "p"]
    return Nlp(
        expressions={"x": x, "p": p, "f": graph.cost(), "g": graph.value()},
        jacobian=ca.Function("nlp_jac_g", [x, p], list(graph.jacobian()), names, ["g", "jac_g_x"]),
        hessian=ca.Function(
            "nlp_hess_l",
            [x, p, sigma, lam],
            [graph.hessian(sigma, lam)],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
        gradient=ca.Function("nlp_grad_f", [x, p], list(graph.gradient()), names, ["f", "grad_f_x"]),
        stages=graph.stage_order(),
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
        variables = picked(graph.x, self.columns)
        w, s = variables[: self.kind.width, :], variables[self.kind.width :, :]
        own = graph.p[(graph.model_parameters + self.members).tolist()].T
        par = ca.vertcat(ca.repmat(graph.p[: graph.model_parameters], 1, count), own)
        outputs = self.kind.functions[f"{self.kind.name}_{name}"].map(count)(w, s, par, *extra)
        return list(outputs) if isinstance(outputs, tuple | list) else [outputs]

    def jacobian_places(self) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the nonzeros of the stages' Jacobians, stage by stage."""
        rows, columns = pattern(self.kind.functions[f"{self.kind.name}_jacobian_pattern"])
        return self.row_indices[rows].ravel(order="F"), self.columns[columns].ravel(order="F")

    def hessian_places(self) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the nonzeros of the stages' Hessians, stage by stage."""
        rows, columns = pattern(self.kind.functions[f"{self.kind.name}_hessian_pattern"])
        return self.columns[rows].ravel(order="F"), self.columns[columns].ravel(order="F")


class _Graph:
    """The symbols of the whole program, and its values and derivatives as expressions of them."""

    def __init__(
        self, stages: Sequence[Stage], ends: Ends, shared_count: int, shared_rows: FloatArray
    ) -> None:
        self.stages, self.ends, self.shared_rows = stages, ends, shared_rows
        first = stages[0].kind
        self.states, self.model_parameters = first.states, first.model_parameters
        self.end_rows = ends.rows - self.states
        widths, heights = ([getattr(one.kind, name) for one in stages] for name in ("width", "rows"))
        self.column_offset = np.concatenate([[0], np.cumsum(widths)[:-1]])
        self.row_offset = np.concatenate([[0], np.cumsum(heights)[:-1]])
        self.shared_offset, self.all_rows = int(sum(widths)), int(sum(heights))
        self.kept = np.flatnonzero(np.concatenate([one.kept for one in stages]))
        own_parameters = ends.parameters - self.model_parameters
        self.x = ca.MX.sym("x", self.shared_offset + shared_count)
        self.p = ca.MX.sym("p", self.model_parameters + len(stages) + own_parameters)
        kinds = dict.fromkeys(one.kind for one in stages)
        self.groups = [
            _Group(kind, np.array([i for i, one in enumerate(stages) if one.kind is kind]), self)
            for kind in kinds
        ]
        offsets = [
            column + one.kind.state.start for column, one in zip(self.column_offset, stages, strict=True)
        ]
        self.state_columns = np.array(offsets) + np.arange(self.states)[:, None]

    @property
    def row_count(self) -> int:
        """Rows of the program."""
        return int(self.kept.size) + self.end_rows + int(self.shared_rows.shape[0])

    def stage_order(self) -> StageOrder:
        """Return the stage of each variable and row; the ends' rows belong to the last stage."""
        count, kinds = np.arange(len(self.stages)), [one.kind for one in self.stages]
        shared = np.full(self.x.numel() - self.shared_offset, -1)
        own_rows = np.repeat(count, [kind.rows for kind in kinds])[self.kept]
        ends, linear = np.full(self.end_rows, count[-1]), np.zeros(self.shared_rows.shape[0], dtype=int)
        variables = np.concatenate([np.repeat(count, [kind.width for kind in kinds]), shared])
        return StageOrder(variables, np.concatenate([own_rows, ends, linear]))

    def _ends(self, name: str, *extra: ca.MX) -> ca.MX:
        """Evaluate a function of the ends at the last state."""
        last_state = self.x[self.state_columns[:, -1].tolist()]
        own = self.p[self.model_parameters + len(self.stages) :]
        par = ca.vertcat(self.p[: self.model_parameters], own)
        return self.ends.functions[f"{self.ends.name}_{name}"](last_state, par, *extra)

    def _end_pattern(self, name: str) -> tuple[IntArray, IntArray]:
        return pattern(self.ends.functions[f"{self.ends.name}_{name}_pattern"])

    def _rows(self, own: Sequence[ca.MX], end: ca.MX) -> ca.MX:
        """Return g from the groups' own rows, and the rows of the ends."""
        states = ca.horzcat(end[: self.states], picked(self.x, self.state_columns[:, :-1]))
        every_row = ca.MX.zeros(self.all_rows, 1)
        for group, rows in zip(self.groups, own, strict=True):
            before = states[:, group.members.tolist()]
            complete = rows + ca.mtimes(_sparse(group.kind.previous), before)
            every_row[group.row_indices.ravel(order="F").tolist()] = ca.vec(complete)
        shared = self.x[self.shared_offset :]
        linear = ca.mtimes(ca.DM(self.shared_rows), shared)
        return ca.vertcat(every_row[self.kept.tolist()], end[self.states :], linear)

    def value(self) -> ca.MX:
        """Return g."""
        return self._rows([group.mapped(self, "value")[0] for group in self.groups], self._ends("value"))

    def cost(self) -> ca.MX:
        """Return f."""
        return sum(ca.sum2(group.mapped(self, "cost")[0]) for group in self.groups)

    def jacobian(self) -> tuple[ca.MX, ca.MX]:
        """Return g and its Jacobian."""
        outputs = [group.mapped(self, "jacobian") for group in self.groups]
        end, end_nonzeros = self._ends("jacobian")
        g = self._rows([rows for rows, _ in outputs], end)
        entries = [
            (*group.jacobian_places(), ca.vec(nonzeros))
            for group, (_, nonzeros) in zip(self.groups, outputs, strict=True)
        ]
        entries += [*self._handed_on(), *self._closing(end_nonzeros), *self._last_rows(end_nonzeros)]
        return g, self._gathered_rows(entries)

    def gradient(self) -> tuple[ca.MX, ca.MX]:
        """Return f and its gradient."""
        outputs = [group.mapped(self, "gradient") for group in self.groups]
        columns = np.concatenate([group.columns.ravel(order="F") for group in self.groups])
        values = ca.vertcat(*(ca.vec(gradient) for _, gradient in outputs))
        gathered = gather(columns, np.zeros_like(columns), values, (self.x.numel(), 1))
        return sum(ca.sum2(cost) for cost, _ in outputs), ca.densify(gathered)

    def _handed_on(self) -> list[Entries]:
        """Return the constant derivatives of each stage but the first by the state handed to it."""
        entries = []
        for group in self.groups:
            after = group.members[group.members > 0]
            rows, columns = np.nonzero(group.kind.previous)
            values = np.tile(group.kind.previous[rows, columns], after.size)
            own_rows = self.row_offset[after][:, None] + rows
            handed = self.state_columns[columns[:, None], after - 1].T
            entries.append((own_rows.ravel(), handed.ravel(), ca.DM(values)))
        return entries

    def _closing(self, end_nonzeros: ca.MX) -> list[Entries]:
        """Return the derivatives of the first stage by the last one's state."""
        previous = self.stages[0].kind.previous
        rows, states = np.nonzero(previous)
        end_rows, end_columns = self._end_pattern("jacobian")
        pairs = [(k, n) for k, state in enumerate(states) for n in np.flatnonzero(end_rows == state)]
        if not pairs:
            return []
        entry, nonzero = np.array(pairs).T
        values = ca.DM(previous[rows[entry], states[entry]]) * end_nonzeros[nonzero.tolist()]
        return [(rows[entry], self.state_columns[end_columns[nonzero], -1], values)]

    def _last_rows(self, end_nonzeros: ca.MX) -> list[Entries]:
        """Return the derivatives of the ends' further rows and of the linear rows."""
        end_rows, end_columns = self._end_pattern("jacobian")
        further = np.flatnonzero(end_rows >= self.states)
        rows = self.all_rows + end_rows[further] - self.states
        columns = self.state_columns[end_columns[further], -1]
        linear_rows, linear_columns = np.nonzero(self.shared_rows)
        coefficients = self.shared_rows[linear_rows, linear_columns]
        linear_places = self.all_rows + self.end_rows + linear_rows, self.shared_offset + linear_columns
        return [
            (rows, columns, end_nonzeros[further.tolist()]),
            (*linear_places, ca.DM(coefficients)),
        ]

    def _gathered_rows(self, entries: Sequence[Entries]) -> ca.MX:
        """Return the sparse matrix of the entries in the rows that take part."""
        rows, columns = (np.concatenate([one[k] for one in entries]) for k in range(2))
        values = ca.vertcat(*(one[2] for one in entries))
        last = self.end_rows + self.shared_rows.shape[0]
        kept = np.concatenate([self.kept, self.all_rows + np.arange(last)])
        place = np.full(self.all_rows + last, -1)
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
            multipliers = picked(spread, group.row_indices)
            weight = ca.repmat(sigma, 1, group.members.size)
            places.append(group.hessian_places())
            values.append(ca.vec(group.mapped(self, "hessian", weight, multipliers)[0]))
        first = self.stages[0].kind
        handed = ca.mtimes(_sparse(first.previous.T), spread[: first.rows])
        further = lam[self.kept.size : self.kept.size + self.end_rows]
        values.append(self._ends("hessian", ca.vertcat(handed, further)))
        end_rows, end_columns = self._end_pattern("hessian")
        places.append((self.state_columns[end_rows, -1], self.state_columns[end_columns, -1]))
        rows, columns = (np.concatenate(parts) for parts in zip(*places, strict=True))
        return gather(rows, columns, ca.vertcat(*values), (self.x.numel(), self.x.numel()))


def _sparse(matrix: FloatArray) -> ca.DM:
    return ca.sparsify(ca.DM(matrix))
