"""Shares independent pieces of work out between this process and forks of it."""

import contextlib
import ctypes
import multiprocessing
import os
import signal
import warnings
from collections.abc import Callable
from contextvars import ContextVar
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

_One = TypeVar("_One")

# How often a process that waits for others asks whether to go on, in [s].
_PERIOD = 0.1
_PR_SET_PDEATHSIG = 1

# How many other processes have a share of the work that is going on here.
_OTHERS: ContextVar[int] = ContextVar("others", default=0)


def start_fork(target: Callable[..., None], *arguments: Any) -> BaseProcess:
    """Start a fork of this process, which has all that was built here without building it again.

    It lives no longer than this process, even if this one is killed.
    """
    process = multiprocessing.get_context("fork").Process(
        target=_run_in_fork, args=(os.getpid(), target, *arguments)
    )
    with warnings.catch_warnings():
        # Only this thread's memory is used in the child, whatever other threads there are.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    return process


def _run_in_fork(parent: int, target: Callable[..., None], *arguments: Any) -> None:
    # A parent that is killed can't end its forks any more; the kernel can.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # It ended before the kernel was asked.
        return
    # Ctrl-C in a terminal is the parent's to deal with.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    target(*arguments)


class Shares(Generic[_One]):
    """Pieces of work by number, each taken by the process that is free first."""

    def __init__(self, work: Callable[[int], _One], count: int) -> None:
        """Take the work.

        Args:
            work: Does piece 0 to count - 1; its results can be pickled.
            count: Number of pieces.
        """
        self._work, self._count = work, count
        self._next = multiprocessing.get_context("fork").Value("i", 0)

    def done(
        self, processes: int, stopped: Callable[[], bool], waiting: Callable[[], object]
    ) -> dict[int, _One]:
        """Return the results by number; those of a stop or of a fork that was lost are missing.

        Args:
            processes: How many work on it, this one included.
            stopped: Whether to leave the rest, asked after each piece and while waiting for others.
            waiting: Called again and again while this process waits for others.
        """
        others = max(0, min(processes, self._count) - 1)
        before = _OTHERS.set(_OTHERS.get() + others)
        forks: list[tuple[BaseProcess, Connection[Any, Any]]] = []
        try:
            forks.extend(self._fork() for _ in range(others))
            results = self._taken(stopped)
            for _, connection in forks:
                while not stopped():
                    if connection.poll(_PERIOD):
                        results |= _received(connection)
                        break
                    waiting()
        finally:
            for process, connection in forks:
                process.kill()
                process.join()
                connection.close()
            _OTHERS.reset(before)
        return results

    def _taken(self, stopped: Callable[[], bool]) -> dict[int, _One]:
        """Work until nothing is left, or a stop."""
        results: dict[int, _One] = {}
        while (number := self._taken_number()) < self._count:
            results[number] = self._work(number)
            if stopped():
                break
        return results

    def _taken_number(self) -> int:
        with self._next.get_lock():
            number: int = self._next.value
            self._next.value += 1
        return number

    def _fork(self) -> "tuple[BaseProcess, Connection[Any, Any]]":
        receiver, sender = multiprocessing.get_context("fork").Pipe(duplex=False)
        process = start_fork(self._run, sender)
        sender.close()
        return process, receiver

    def _run(self, sender: "Connection[Any, Any]") -> None:
        # What fails here is done once more by the parent, where it can be told what it was.
        with contextlib.suppress(Exception):
            sender.send(self._taken(lambda: False))


def _received(connection: "Connection[Any, Any]") -> dict[int, Any]:
    """Return the results of a fork; none of one that was lost."""
    try:
        results: dict[int, Any] = connection.recv()
    except (EOFError, OSError):  # It ended before the first byte, or after it.
        return {}
    return results


def free_processors() -> int:
    """Return how many processors a piece of work may use: those that no other process of it is busy on."""
    return max(1, processor_count() - _OTHERS.get())


def processor_count() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0))
