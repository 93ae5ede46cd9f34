"""Messages whose size never changes: serialised once, their numbers written anew for each publication.

rclpy looks at every field of a message to serialise it, which takes longer than all else that a tick of a
fast stream does.
"""

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.recording.ros_messages import serialize

FloatArray = NDArray[np.float64]

# The time of a message that begins with a header, behind the four bytes of CDR's encapsulation.
_STAMP = struct.Struct("=iI")
_STAMP_OFFSET = 4
_NANOSECONDS = 1_000_000_000


class MessageTemplate:
    """A serialised message with places for arrays of float64, and for the stamp of a header at its begin."""

    def __init__(self, message: Any, arrays: Sequence[str], size: int) -> None:
        """Serialise the message, and find out where its arrays are.

        Args:
            message: With all that stays the same; its arrays are overwritten.
            arrays: Fields that are written anew, sequences of float64.
            size: Length of each of them.
        """
        # No text contains these bytes: they are no ASCII.
        marks = [np.full(size, -np.pi - number) for number in range(len(arrays))]
        for name, mark in zip(arrays, marks, strict=True):
            setattr(message, name, mark.tolist())
        data = serialize(message)
        self._data = bytearray(data)
        begins = [data.index(mark.tobytes()) for mark in marks]
        self._places = [slice(begin, begin + 8 * size) for begin in begins]

    def filled(self, *arrays: FloatArray) -> bytes:
        """Return the message with other arrays of float64, each of the size that it was made for."""
        for place, values in zip(self._places, arrays, strict=True):
            self._data[place] = values.tobytes()
        return bytes(self._data)

    def stamped(self, time_ns: int, *arrays: FloatArray) -> bytes:
        """Return the message with other arrays, and the time in [ns] in the header that it begins with."""
        _STAMP.pack_into(self._data, _STAMP_OFFSET, *divmod(time_ns, _NANOSECONDS))
        return self.filled(*arrays)
