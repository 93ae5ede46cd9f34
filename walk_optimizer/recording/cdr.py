"""Where a serialised message ends.

rmw_fastrtps estimates the size of a message from above, by up to 7 bytes for each empty sequence of
float64, and rclpy hands out the whole estimate: behind the message then lies whatever was in memory.
Readers that are strict about lengths refuse such a message, so its end is computed here.
"""

from typing import Any

from rosidl_parser.definition import (
    AbstractSequence,
    AbstractString,
    AbstractType,
    Array,
    BasicType,
    NamespacedType,
)

_ENCAPSULATION_LENGTH = 4

_SIZES = {
    **dict.fromkeys(("boolean", "octet", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}


def trim(message: Any, data: bytes) -> bytes:
    """Return a serialised message without what lies behind it.

    Args:
        message: The message.
        data: The message as rclpy serialises it: CDR with its four bytes of encapsulation.

    Returns:
        The bytes of the message; all of `data` for types whose length is not known here (wide
        strings and long doubles).
    """
    try:
        return data[: _ENCAPSULATION_LENGTH + _end_of_message(message, 0)]
    except KeyError:
        return data


def _end_of_message(message: Any, start: int) -> int:
    # A message without fields is sent as one byte.
    position = start if message.SLOT_TYPES else start + 1
    for name, kind in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        position = _end_of_value(getattr(message, name), kind, position)
    return position


def _end_of_value(value: Any, kind: AbstractType, start: int) -> int:
    """Return where a value ends that may begin at `start`, both in [byte] behind the encapsulation."""
    if isinstance(kind, BasicType):
        return _end_of_numbers(1, kind, start)
    if isinstance(kind, AbstractString):
        return _align(start, 4) + 4 + len(value.encode()) + 1
    if isinstance(kind, NamespacedType):
        return _end_of_message(value, start)
    if isinstance(kind, AbstractSequence):
        return _end_of_elements(value, kind.value_type, _align(start, 4) + 4)
    if isinstance(kind, Array):
        return _end_of_elements(value, kind.value_type, start)
    raise KeyError(kind)


def _end_of_elements(values: Any, kind: AbstractType, start: int) -> int:
    if isinstance(kind, BasicType):
        return _end_of_numbers(len(values), kind, start)
    for value in values:
        start = _end_of_value(value, kind, start)
    return start


def _end_of_numbers(count: int, kind: BasicType, start: int) -> int:
    size = _SIZES[kind.typename]
    return _align(start, size) + count * size if count else start


def _align(position: int, size: int) -> int:
    return -(-position // size) * size
