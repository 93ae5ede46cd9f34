"""What a running command shows on stderr, and how Ctrl-C reaches a solve."""

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from walk_optimizer.solve.status import Progress

_REFRESH = 0.1
_CLEAR_LINE = "\r\x1b[K"


class StatusLine:
    """One line on stderr that is rewritten; where stderr is no terminal, only lasting lines appear."""

    def __init__(self) -> None:
        """Look at what stderr is."""
        self._terminal = sys.stderr.isatty()
        self._shown = 0.0

    def update(self, text: str) -> None:
        """Rewrite the line, ten times a second at most."""
        now = time.monotonic()
        if self._terminal and now - self._shown >= _REFRESH:
            self._shown = now
            print(f"{_CLEAR_LINE}{text}", end="", file=sys.stderr, flush=True)

    def lasting(self, text: str) -> None:
        """Print a line that stays."""
        self.clear()
        print(text, file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Wipe the line."""
        if self._terminal:
            print(_CLEAR_LINE, end="", file=sys.stderr, flush=True)


class SolveProgress:
    """A progress callback of a solve that shows it and passes on an interrupt."""

    def __init__(self, interrupt: "Interrupt") -> None:
        """Show nothing yet."""
        self._line = StatusLine()
        self._interrupt = interrupt
        self._stage = ""

    def __call__(self, progress: Progress) -> bool:
        """Show where the solve stands; return False when it shall end."""
        if progress.stage != self._stage:
            self._stage = progress.stage
            self._line.lasting(f"  {progress.elapsed:6.1f} s  {progress.stage}")
        self._line.update(
            f"  {progress.elapsed:6.1f} s  {progress.stage}: iteration {progress.iteration}, "
            f"F {progress.objective:.4g} (N m)^2, infeasibility {progress.infeasibility:.1e}"
        )
        return not self._interrupt.requested

    def close(self) -> None:
        """Leave a clean line."""
        self._line.clear()


class Interrupt:
    """Whether Ctrl-C was pressed."""

    requested = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Remember the first Ctrl-C; a second one does not wait."""
        if self.requested:
            signal.default_int_handler(number, frame)
        self.requested = True


@contextmanager
def interruptible() -> Iterator[Interrupt]:
    """Let a solve end at its next iteration on Ctrl-C, then raise KeyboardInterrupt.

    An exception in the middle of a solver's callback would be swallowed or torn by compiled code.
    """
    interrupt = Interrupt()
    former = signal.signal(signal.SIGINT, interrupt.handle)
    try:
        yield interrupt
    finally:
        signal.signal(signal.SIGINT, former)
    if interrupt.requested:
        raise KeyboardInterrupt
