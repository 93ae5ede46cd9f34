"""What runs inside a worker process: jobs come in and events go out, over one pipe."""

import contextlib
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.solve.status import Progress, ProgressCallback

_LOGGER = logging.getLogger(__name__)
# A solver iterates faster than anybody can read: at most one progress event in this time, in [s].
PROGRESS_PERIOD = 0.1

# A module-level function, so that a spawned process can import it: job and progress to result.
Function = Callable[[Any, ProgressCallback], Any]


@dataclass(frozen=True)
class Ready:
    """The worker has started and takes a job."""


@dataclass(frozen=True)
class Finished:
    """The job is done.

    Attributes:
        result: What the function returned.
    """

    result: Any


@dataclass(frozen=True)
class Failed:
    """The function raised.

    Attributes:
        message: What, for people.
    """

    message: str


def serve(connection: "Connection[Any, Any]", function: Function) -> None:
    """Run jobs until the pipe is closed."""
    _become_independent(connection)
    connection.send(Ready())
    # A parent that has closed its end leaves nobody to work for.
    with contextlib.suppress(EOFError, OSError):
        while True:
            connection.send(_run(function, connection.recv(), connection))


def _run(function: Function, job: Any, connection: "Connection[Any, Any]") -> Finished | Failed:
    try:
        return Finished(function(job, _ProgressSender(connection)))
    except WalkOptimizerError as error:
        return Failed(str(error))
    except OSError:
        raise
    except Exception as error:  # whatever it is, the next job can still be done
        _LOGGER.exception("the solve failed unexpectedly:")
        return Failed(f"the solve failed unexpectedly: {error!r}")


def _become_independent(connection: "Connection[Any, Any]") -> None:
    """Live and die apart from the parent's terminal, but never longer than the parent."""
    # A group of its own: killing it ends a compiler that the job has started as well, and Ctrl-C in
    # the parent's terminal does not reach it.
    os.setsid()
    # The parent starts this process with SIGINT blocked; one that waits is dropped here.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    # Otherwise such a compiler would hold the pipe open after this process was killed.
    os.set_inheritable(connection.fileno(), False)
    threading.Thread(target=_die_with_parent, name="die_with_parent", daemon=True).start()


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os.killpg(0, signal.SIGKILL)


class _ProgressSender:
    """Sends progress over the pipe, thinned out; new stages are always told."""

    def __init__(self, connection: "Connection[Any, Any]") -> None:
        self._connection = connection
        self._stage = ""
        self._last = 0.0

    def __call__(self, progress: Progress) -> bool:
        now = time.monotonic()
        if progress.stage != self._stage or now - self._last >= PROGRESS_PERIOD:
            self._stage, self._last = progress.stage, now
            self._connection.send(progress)
        return True
