"""Passes the iterations of CasADi's solvers to the monitor of the running solve."""

import casadi as ca
import numpy as np

from walk_optimizer.solve.solution import IterationState, Monitor
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Problem


class Watcher(ca.Callback):
    """An `iteration_callback`; belongs to one solver object, and is told which solve runs."""

    def __init__(self, expressions: dict[str, ca.MX], values: ca.Function | None = None) -> None:
        """Watch nothing yet.

        Args:
            expressions: x and g of the program.
            values: (x, p) -> (f, g), for a solver that tells its callback no more than x.
        """
        super().__init__()
        self._sizes = {"x": expressions["x"].numel(), "g": expressions["g"].numel(), "f": 1}
        self._values = values
        self.monitor: Monitor | None = None
        self.problem: Problem | None = None
        self.verdict: Status | None = None
        self.error: BaseException | None = None
        self.iteration = 0
        self.construct("watcher", {})

    def begin(self, problem: Problem, monitor: Monitor | None) -> None:
        """Watch a new solve."""
        self.problem, self.monitor, self.iteration = problem, monitor, -1
        self.verdict = self.error = None

    def end(self) -> None:
        """Let go of the solve, since its program keeps this watcher alive; raise what the monitor raised."""
        error, self.problem, self.monitor, self.error = self.error, None, None, None
        if error is not None:
            raise error

    def get_n_in(self) -> int:
        """Return the number of inputs: what a solver of CasADi returns."""
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        """Return the number of outputs."""
        return 1

    def get_sparsity_in(self, index: int) -> ca.Sparsity:
        """Return the pattern of an input; CasADi leaves empty ones out."""
        size = self._sizes.get(ca.nlpsol_out(index))
        return ca.Sparsity(0, 0) if size is None else ca.Sparsity.dense(size, 1)

    def eval(self, arguments: list[ca.DM]) -> list[int]:
        """Tell the monitor; return 1 to end the solve."""
        self.iteration += 1
        if self.monitor is None or self.problem is None:
            return [0]
        x, f, g = arguments[:3]
        if self._values is not None:
            f, g = self._values(x, self.problem.parameters)
        x, f, g = (np.asarray(one).ravel() for one in (x, f, g))
        state = IterationState(self.iteration, float(f[0]), self.problem.infeasibility(x, g))
        try:
            self.verdict = self.monitor(state)
        except BaseException as error:  # noqa: BLE001  # CasADi would swallow it; `end` raises it again
            self.error = error
        return [0 if self.verdict is None and self.error is None else 1]
