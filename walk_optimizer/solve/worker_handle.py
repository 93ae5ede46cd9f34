"""The parent's end of one worker process: start it, give it a job, kill it."""

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import wait
from typing import Any

from walk_optimizer.solve.status import Progress
from walk_optimizer.solve.worker_process import Failed, Finished, Function, Ready, serve

# A process that has not said that it is ready after this time in [s] never will.
START_LIMIT = 120.0


class WorkerLostError(Exception):
    """The process ended before it answered."""


class WorkerOverdueError(Exception):
    """The process had not answered in time; it has been killed."""


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Keep Ctrl-C from a process that starts here until it has left the terminal's group."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class WorkerHandle:
    """One spawned process; `kill` and `alive` may be used from any thread, the rest from one."""

    def __init__(self, function: Function) -> None:
        """Start the process; it imports what it needs while this returns."""
        # spawn: a fork of a process with threads and a middleware is undefined behaviour.
        context = multiprocessing.get_context("spawn")
        self._connection, other_end = context.Pipe()
        self._process = context.Process(target=serve, args=(other_end, function), name="solve_worker")
        with _interrupts_blocked():
            self._process.start()
        other_end.close()
        self._ready = False

    @property
    def alive(self) -> bool:
        """Whether the process can take a job; may be asked from any thread."""
        # The sentinel is a pipe, which forks of a killed process may hold open for some more moments.
        return not self._connection.closed and not wait([self._process.sentinel], timeout=0)

    def run(self, job: Any, time_limit: float, on_progress: Callable[[Progress], None]) -> Finished | Failed:
        """Do a job.

        Args:
            job: For the function.
            time_limit: From when the process has started, in [s].
            on_progress: Called with each progress event.

        Raises:
            WorkerLostError: the process ended.
            WorkerOverdueError: the limit is over, and the process killed.
        """
        self.wait_until_ready()
        with self._lost_if_broken():
            self._connection.send(job)
            deadline = time.monotonic() + time_limit
            while True:
                event = self._receive(deadline)
                if isinstance(event, Finished | Failed):
                    return event
                if isinstance(event, Progress):
                    on_progress(event)

    def wait_until_ready(self) -> None:
        """Wait until the process has imported what it needs.

        Raises:
            WorkerLostError: the process ended.
            WorkerOverdueError: it takes too long, and is killed.
        """
        if not self._ready:
            with self._lost_if_broken():
                self._receive(time.monotonic() + START_LIMIT)
            self._ready = True

    def kill(self) -> None:
        """End the process and whatever it has started, at once."""
        if self._process.pid is not None and self._process.exitcode is None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        # Should it not have made its group yet.
        with contextlib.suppress(ValueError):
            self._process.kill()

    def end(self) -> None:
        """Kill the process and clear up."""
        self.kill()
        self._process.join()
        self._connection.close()

    @contextlib.contextmanager
    def _lost_if_broken(self) -> Iterator[None]:
        try:
            yield
        except (EOFError, OSError) as error:
            self.end()
            raise WorkerLostError from error

    def _receive(self, deadline: float) -> Ready | Progress | Finished | Failed:
        if not self._connection.poll(max(deadline - time.monotonic(), 0.0)):
            self.end()
            raise WorkerOverdueError
        return self._connection.recv()  # type: ignore[no-any-return]
