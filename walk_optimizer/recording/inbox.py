"""The bounded queue between those who publish and the thread that writes."""

import threading
import time
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """Takes items without ever waiting, and hands them over in whole batches.

    The lock is held for a few instructions only, whatever the disk does, and the taker empties the queue in
    one exchange. No item wakes it, but callers with a period say when they rest, and once a batch has
    gathered that does: so one of 1 ms does not notice it.
    """

    def __init__(self, limit: int, batch: int) -> None:
        """Create an open, empty queue.

        Args:
            limit: Items that may wait at the same time.
            batch: So many are worth waking up for.
        """
        self._limit, self._batch = limit, batch
        self._items: list[Item] = []
        self._rejected = 0
        self._closed = False
        self._resting = threading.Event()
        self._lock = threading.Lock()

    @property
    def rejected(self) -> int:
        """Items that were offered to the open queue, but found no place."""
        return self._rejected

    @property
    def closed(self) -> bool:
        """Whether the queue takes nothing any more."""
        return self._closed

    def __len__(self) -> int:
        """Items that wait."""
        return len(self._items)

    def offer(self, item: Item) -> bool:
        """Put an item into the queue if it has a place for it.

        Returns:
            Whether the item was taken; one that the open queue has no place for is counted.
        """
        with self._lock:
            if self.closed:
                return False
            if len(self._items) >= self._limit:
                self._rejected += 1
                return False
            self._items.append(item)
            return True

    def push(self, item: Item) -> bool:
        """Put an item into an open queue even if that is full.

        Returns:
            Whether the queue was open.
        """
        with self._lock:
            if not self.closed:
                self._items.append(item)
            return not self.closed

    def rest(self) -> None:
        """Say that no items are offered for a moment."""
        if len(self._items) >= self._batch:
            self._resting.set()

    def take(self, patience: float, pause: float = 0.0) -> tuple[list[Item], bool]:
        """Wait for a rest with a batch of items, and take all of them; if the queue is closed, at once.

        Args:
            patience: Longest wait in [s].
            pause: How long to leave the processors to others when a rest begins, in [s].

        Returns:
            The items in their order, maybe none; and whether the queue was closed by then, so that no
            further ones follow.
        """
        if self._resting.wait(patience) and not self.closed:
            time.sleep(pause)
        self._resting.clear()
        with self._lock:
            items, self._items = self._items, []
            return items, self.closed

    def close(self) -> None:
        """Take nothing any more; what waits can still be taken."""
        with self._lock:
            self._closed = True
        self._resting.set()
