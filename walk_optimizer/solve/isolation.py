"""Runs a solver that can't be interrupted in a child process, which can be killed."""

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from walk_optimizer.solve.back_end import ended
from walk_optimizer.solve.sharing import start_fork
from walk_optimizer.solve.solution import FloatArray, IterationState, Monitor, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Problem

# How often the monitor is asked whether to go on, in [s].
_PERIOD = 0.1


def isolated(
    function: Callable[[], Solution], problem: Problem, start: FloatArray, monitor: Monitor | None
) -> Solution:
    """Return what a function returns in a child process, unless the monitor ends it before.

    The child is a fork, so that it has the program without building it again. What happens inside
    is not seen from here: the monitor is told of the start again and again.

    Args:
        function: Solves the program.
        problem: The program.
        start: First iterate.
        monitor: May stop the solve.
    """
    at_start = ended(problem, start, Status.SOLVER_ERROR, 0, "the solver's process ended")
    state = IterationState(0, at_start.objective, at_start.infeasibility)
    receiver, sender = multiprocessing.get_context("fork").Pipe(duplex=False)
    process = start_fork(_run, function, sender)
    sender.close()
    try:
        while True:
            verdict = None if monitor is None else monitor(state)
            if verdict is not None:
                return Solution(verdict, start, state.objective, state.infeasibility, 0, "ended from outside")
            if receiver.poll(_PERIOD):
                return _received(receiver, at_start)
    finally:
        process.kill()
        process.join()
        receiver.close()


def _received(receiver: "Connection[Any, Any]", at_start: Solution) -> Solution:
    try:
        values = receiver.recv()
    except EOFError:
        return at_start
    if isinstance(values, str):
        return Solution(Status.SOLVER_ERROR, at_start.x, np.nan, np.inf, 0, values)
    return Solution(Status(values[0]), *values[1:])


def _run(function: Callable[[], Solution], sender: "Connection[Any, Any]") -> None:
    try:
        one = function()
    except Exception as error:  # noqa: BLE001  # whatever the solver raised, the parent is told
        sender.send(f"{type(error).__name__}: {error}".splitlines()[0])
    else:
        sender.send((one.status.value, one.x, one.objective, one.infeasibility, one.iterations, one.detail))
