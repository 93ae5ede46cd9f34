"""Runs each measurement in a process of its own: nothing is warm, memory is its own, time limits are real."""

import re
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Measured:
    """What a process returned.

    Attributes:
        value: What the function returned; None where it failed.
        error: Why it failed, one line.
        peak_memory: Largest resident memory of the process in [MB].
    """

    value: Any
    error: str = ""
    peak_memory: float = float("nan")


def run_isolated(function: Callable[..., Any], *arguments: Any, time_limit: float) -> Measured:
    """Call a function of a module in a new process; kill it when the time limit in [s] is over."""
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_call, args=(sender, function, arguments))
    process.start()
    sender.close()
    try:
        if not receiver.poll(time_limit):
            return Measured(None, f"not done after {time_limit:.0f} s")
        return receiver.recv()
    except EOFError:
        process.join()
        return Measured(None, f"process ended with code {process.exitcode}")
    finally:
        process.kill()
        process.join()


def _call(sender: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    try:
        value, error = function(*arguments), ""
    except Exception as problem:  # noqa: BLE001  # a failure is a row of the table
        traceback.print_exc()
        value, error = None, f"{type(problem).__name__}: {problem}".splitlines()[0]
    sender.send(Measured(value, error, peak_memory()))


def peak_memory() -> float:
    """Return the largest resident memory of this process in [MB].

    `ru_maxrss` would count what the parent had at the moment of the fork.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    match = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(match[1]) / 1024 if match else float("nan")
