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

    def has_eval_buffer(self) -> bool:
        """Tell CasADi to hand over memory: copies would take a tenth of a short iteration."""
        return True

    def eval_buffer(self, arguments: list[memoryview], results: list[memoryview]) -> int:
        """Tell the monitor; the result is 1 to end the solve."""
        self.iteration += 1
        if self.monitor is not None and self.problem is not None:
            state = IterationState(self.iteration, *self._values_at(self.problem, arguments))
            try:
                self.verdict = self.monitor(state)
            except BaseException as error:  # noqa: BLE001  # CasADi would swallow it; `end` raises it again
                self.error = error
        np.frombuffer(results[0])[:] = self.verdict is not None or self.error is not None
        return 0

    def _values_at(self, problem: Problem, arguments: list[memoryview]) -> tuple[float, float]:
        """Return objective and infeasibility."""
        x = np.frombuffer(arguments[0])
        if self._values is not None:
            f, g = (np.asarray(one).ravel() for one in self._values(x, problem.parameters))
        else:
            f, g = (np.frombuffer(one) for one in arguments[1:3])
        return float(f[0]), problem.infeasibility(x, g)
