"""One record of an MCAP file, read with distrust: either it can be used, or it says why not."""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from io import BytesIO
from mmap import mmap

import zstandard
from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk

RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of the body, which stand before every record."""

LARGEST_CHUNK = (1 << 30) + (1 << 26)
"""Largest content of a chunk that is opened, in [byte]: the most a recorder can be set to, and a message."""

# What the parsers of the MCAP library and of the compressions let out on bytes that make no sense.
_PARSE_ERRORS = (
    McapError,
    ValueError,
    struct.error,
    RuntimeError,
    MemoryError,
    OverflowError,
    zstandard.ZstdError,
)

_PARSERS: Mapping[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.METADATA: Metadata.read,
    Opcode.DATA_END: DataEnd.read,
}

_MESSAGE_INDEX_HEAD_LENGTH = 2 + 4
_MESSAGE_INDEX_ENTRY_LENGTH = 8 + 8


class DamageKind(Enum):
    """What is wrong with a stretch of a file."""

    CHUNK = "chunk"
    """A chunk whose content does not match its checksum, or does not decompress."""
    RECORD = "record"
    """A record that makes no sense; reading went on at the next whole chunk."""
    CUT_OFF = "cut_off"
    """The file ends before its last message."""
    INDEX = "index"
    """All messages are there, but the index behind them is damaged or missing."""
    CHECKSUM = "checksum"
    """The checksum over the whole data section is wrong."""


LOSING_MESSAGES = frozenset({DamageKind.CHUNK, DamageKind.RECORD, DamageKind.CUT_OFF})
"""Damage that leaves open how many messages there were."""


@dataclass(frozen=True)
class Damage:
    """A stretch of a file that cannot be trusted.

    Attributes:
        offset: Where it begins, in [byte] from the start of the file.
        kind: What is wrong.
        reason: The same for people.
    """

    offset: int
    kind: DamageKind
    reason: str


@dataclass(frozen=True)
class Block:
    """A record of the data section: a chunk opened, or a record outside of chunks.

    Attributes:
        offset: Where it begins, in [byte] from the start of the file.
        records: What the chunk held, or the record.
        compression: Compression of the chunk, empty for none; None for a record outside of chunks.
        indexed_messages: Messages that an index record lists for the chunk before it.
        is_attachment: Whether the record is a file that was put into this one.
    """

    offset: int
    records: tuple[McapRecord, ...]
    compression: str | None = None
    indexed_messages: int = 0
    is_attachment: bool = False


class UnreadableError(Exception):
    """A record cannot be used; `end` is where the next one begins, if that is known."""

    def __init__(self, kind: DamageKind, reason: str, end: int | None = None) -> None:
        super().__init__(reason)
        self.kind = kind
        self.end = end


def read_block(data: mmap, offset: int, chunked: bool) -> tuple[Block, int]:
    """Return the record at a place, and where the next one begins.

    Args:
        data: The whole file.
        offset: Where the record begins, in [byte] from the start of the file.
        chunked: Whether the file keeps its messages in chunks, as far as is known.

    Raises:
        UnreadableError: If the record cannot be used.
    """
    opcode, body, end = read_record(data, offset)
    if opcode == Opcode.MESSAGE_INDEX:
        return Block(offset, (), indexed_messages=_count_index(body)), end
    if opcode == Opcode.ATTACHMENT:
        return Block(offset, (), is_attachment=True), end
    if opcode == Opcode.MESSAGE and not chunked:
        return Block(offset, (_parse_message(body),)), end
    if opcode not in _PARSERS:
        # With chunks, a message beside them can only be an opcode that has been damaged.
        raise UnreadableError(DamageKind.RECORD, f"no record with opcode {opcode} belongs here")
    record = parse_record(opcode, body)
    if isinstance(record, Chunk):
        return Block(offset, _open_chunk(record, end), record.compression), end
    return Block(offset, (record,)), end


def read_record(data: mmap, offset: int) -> tuple[int, bytes, int]:
    """Return the opcode and the body of a record, and where the next one begins.

    Args:
        data: The whole file.
        offset: Where the record begins, in [byte] from the start of the file.

    Raises:
        UnreadableError: If the file ends before the record does.
    """
    start = offset + RECORD_HEAD.size
    if start > len(data):
        raise UnreadableError(DamageKind.CUT_OFF, f"the file ends after {len(data)} bytes, unfinished")
    opcode, length = RECORD_HEAD.unpack_from(data, offset)
    if start + length > len(data):
        reason = f"the file ends after {len(data)} bytes, within a record of {length} bytes"
        raise UnreadableError(DamageKind.CUT_OFF, reason)
    return opcode, data[start : start + length], start + length


def parse_record(opcode: int, body: bytes) -> McapRecord:
    """Return a record other than a message from its body.

    Raises:
        UnreadableError: If the body is not exactly such a record.
    """
    stream = ReadDataStream(BytesIO(body))
    try:
        record = _PARSERS[opcode](stream)
    except _PARSE_ERRORS as error:
        raise UnreadableError(DamageKind.RECORD, f"a record cannot be parsed: {error!r}") from error
    if stream.count != len(body):
        reason = f"a {type(record).__name__} takes {stream.count} bytes, its record has {len(body)}"
        raise UnreadableError(DamageKind.RECORD, reason)
    return record


def _parse_message(body: bytes) -> Message:
    try:
        return Message.read(ReadDataStream(BytesIO(body)), len(body))
    except _PARSE_ERRORS as error:
        raise UnreadableError(DamageKind.RECORD, f"a message cannot be parsed: {error!r}") from error


def _open_chunk(chunk: Chunk, end: int) -> tuple[McapRecord, ...]:
    try:
        content = replace(chunk, compression="", data=_decompress(chunk))
        return tuple(breakup_chunk(content, validate_crc=True))
    except _PARSE_ERRORS as error:
        raise UnreadableError(DamageKind.CHUNK, f"a chunk is damaged: {error}", end) from error


def _decompress(chunk: Chunk) -> bytes:
    """Return the content of a chunk, which takes no more memory than the chunk says and than is allowed."""
    size = chunk.uncompressed_size
    if size > LARGEST_CHUNK:
        raise ValueError(f"it claims {size} bytes, at most {LARGEST_CHUNK} are opened")
    if chunk.compression not in _DECOMPRESSORS:
        raise ValueError(f"its compression {chunk.compression!r} is none of zstd, lz4")
    data = _DECOMPRESSORS[chunk.compression](chunk.data, size)
    if len(data) != size:
        raise ValueError(f"it holds {len(data)} bytes{' or more' * (len(data) > size)}, it says {size}")
    return data


def _unzstd(data: bytes, size: int) -> bytes:
    claimed = zstandard.frame_content_size(data)
    # Without a claim no more than `size` is made; with one, all of it, whatever `size` is.
    if claimed not in (-1, size):
        raise ValueError(f"its zstd frame claims {claimed} bytes, the chunk {size}")
    return zstandard.decompress(data, size)


def _unlz4(data: bytes, size: int) -> bytes:
    content: bytes = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    return content


_DECOMPRESSORS: Mapping[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, _: data,
    "zstd": _unzstd,
    "lz4": _unlz4,
}


def _count_index(body: bytes) -> int:
    entries, rest = divmod(len(body) - _MESSAGE_INDEX_HEAD_LENGTH, _MESSAGE_INDEX_ENTRY_LENGTH)
    if rest or entries < 0:
        raise UnreadableError(DamageKind.RECORD, f"an index record cannot have {len(body)} bytes")
    claimed = int(struct.unpack_from("<I", body, 2)[0])
    if claimed != entries * _MESSAGE_INDEX_ENTRY_LENGTH:
        raise UnreadableError(DamageKind.RECORD, f"an index of {entries} entries claims {claimed} bytes")
    return entries
