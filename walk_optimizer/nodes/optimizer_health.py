"""What `gait_optimizer` tells about its health: its workers, and how requests ended."""

from collections import Counter
from collections.abc import Callable

from walk_optimizer.nodes.diagnostics import Diagnostics, Finding, Level
from walk_optimizer.solve.status import SolveReport, Status
from walk_optimizer.solve.worker import PoolState

# Ends that say nothing against the optimiser.
_GOOD = (Status.SOLVED, Status.CANCELLED)


class OptimizerHealth:
    """Counts how requests end, and judges that and the pool of workers."""

    def __init__(self, pool: Callable[[], PoolState], workers: int, queue_limit: int) -> None:
        """Begin to count.

        Args:
            pool: Returns what the pool is doing.
            workers: Processes that it should have.
            queue_limit: Requests that may wait.
        """
        self._pool, self._workers, self._queue_limit = pool, workers, queue_limit
        self._ends: Counter[Status] = Counter()
        self._last: SolveReport | None = None

    def join(self, diagnostics: Diagnostics) -> None:
        """Add the checks to those of the node."""
        diagnostics.add("workers", self.workers)
        diagnostics.add("solves", self.solves)

    def note(self, report: SolveReport) -> None:
        """Count how a request ended."""
        self._ends[report.status] += 1
        self._last = report

    def workers(self) -> Finding:
        """Return whether all workers live and the queue has room."""
        state = self._pool()
        values = {
            "workers": state.workers,
            "running": state.running,
            "waiting": state.waiting,
            "queue_limit": self._queue_limit,
        }
        if state.workers < self._workers:
            lost = f"{self._workers - state.workers} of {self._workers} workers have ended"
            return Finding(Level.WARN, f"{lost}; the next request starts them again", values)
        if state.waiting >= self._queue_limit:
            return Finding(Level.WARN, "the queue is full: further requests are told busy", values)
        return Finding(Level.OK, "solving" if state.running else "waiting for requests", values)

    def solves(self) -> Finding:
        """Return how requests have ended, above all the last one."""
        cancelled, solved = self._ends[Status.CANCELLED], self._ends[Status.SOLVED]
        values: dict[str, object] = {
            "solved": solved,
            "cancelled": cancelled,
            "failed": self._ends.total() - solved - cancelled,
        }
        if self._last is None:
            return Finding(Level.OK, "no request has ended yet", values)
        values |= {"last_status": self._last.status.value, "last_solve_time": self._last.solve_time}
        ended = f"the last request ended: {self._last.message}"
        return Finding(Level.OK if self._last.status in _GOOD else Level.WARN, ended, values)
