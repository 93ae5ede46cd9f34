"""The bounded queue between those who publish and the thread that writes."""

import threading
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Inbox(Generic[Item]):
    """Takes items without ever waiting, and hands them over in whole batches.

    The lock is held for a few instructions only, whatever the disk does, and the taker empties the
    queue in one exchange: so a caller with a period of 1 ms does not notice it.
    """

    def __init__(self, limit: int) -> None:
        """Create an open, empty queue.

        Args:
            limit: Items that may wait at the same time.
        """
        self._limit = limit
        self._items: list[Item] = []
        self._rejected = 0
        self._closed = False
        self._changed = threading.Condition()

    @property
    def rejected(self) -> int:
        """Items that were offered, but found no place."""
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
            Whether the item was taken; one that was not is counted.
        """
        with self._changed:
            if self._closed or len(self._items) >= self._limit:
                self._rejected += 1
                return False
            self._items.append(item)
            self._changed.notify()
            return True

    def push(self, item: Item) -> bool:
        """Put an item into an open queue even if that is full.

        Returns:
            Whether the queue was open.
        """
        with self._changed:
            if not self._closed:
                self._items.append(item)
                self._changed.notify()
            return not self._closed

    def take(self, timeout: float) -> tuple[list[Item], bool]:
        """Wait for items and take all of them.

        Args:
            timeout: Longest wait in [s].

        Returns:
            The items in their order, none after the timeout; and whether the queue was closed by
            then, so that no further ones follow.
        """
        with self._changed:
            if not self._items and not self._closed:
                self._changed.wait(timeout)
            items, self._items = self._items, []
            return items, self._closed

    def close(self) -> None:
        """Take nothing any more; what waits can still be taken."""
        with self._changed:
            self._closed = True
            self._changed.notify()
