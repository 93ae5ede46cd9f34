"""Gaits that the library blends in a thread, so that the node answers others meanwhile."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from walk_optimizer.gait import Gait
from walk_optimizer.library.entries import Source
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.worker import BusyError

# A blend takes about a tenth of a second, and as little memory as a gait.
_WAITING_LIMIT = 16
_REMEMBERED = 64

Found = tuple[Gait, Source]


class Blends:
    """Looks gaits up one after the other; equal requests once, and the last ones are remembered."""

    def __init__(self, find: Callable[[GaitRequest], Found]) -> None:
        """Start the thread.

        Args:
            find: Looks a gait up, and blends it if need be.
        """
        self._find = find
        self._known: dict[GaitRequest, Future[Found]] = {}
        self._thread = ThreadPoolExecutor(1, "blends")

    def find(self, request: GaitRequest) -> "Future[Found]":
        """Return what will be the gait and its source, or a GaitNotFoundError.

        Raises:
            BusyError: too many others wait.
        """
        known = self._known.get(request)
        if known is None:
            waiting = sum(not future.done() for future in self._known.values())
            if waiting >= _WAITING_LIMIT:
                raise BusyError(f"busy: {waiting} speeds are being interpolated; ask again later")
            known = self._known[request] = self._thread.submit(self._find, request)
            for old in list(self._known)[:-_REMEMBERED]:
                del self._known[old]
        return known

    def forget(self) -> None:
        """Look again when asked again: the library has changed."""
        self._known = {}

    def give_up(self) -> None:
        """Drop what waits; whoever waits for it gets a CancelledError."""
        for future in self._known.values():
            future.cancel()
        self.forget()

    def close(self) -> None:
        """End the thread after what it does now."""
        self._thread.shutdown(wait=False, cancel_futures=True)
