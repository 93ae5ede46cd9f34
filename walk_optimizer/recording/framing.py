"""The records of an MCAP file in a row: checksums on, and on again behind damage.

The readers of the MCAP library either need the index at the end of the file, which a killed
recording has not, or stop at the first thing they cannot parse. This one walks from the front,
names every stretch it cannot trust, and goes on at the next chunk that is whole.
"""

import re
import struct
import zlib
from collections.abc import Iterator
from mmap import mmap

from mcap.opcode import Opcode
from mcap.records import DataEnd, McapRecord

from walk_optimizer.recording.records import (
    RECORD_HEAD,
    Block,
    Damage,
    DamageKind,
    UnreadableError,
    parse_record,
    read_block,
    read_record,
)

MAGIC = b"\x89MCAP0\r\n"

_FOOTER_LENGTH = RECORD_HEAD.size + 8 + 8 + 4

# Opcode of a chunk and a length below 2^40 bytes: what a chunk can begin with.
_CHUNK_START = re.compile(rb"\x06.{5}\x00\x00\x00", re.DOTALL)

# Start time, end time, size and checksum of a chunk stand before the name of its compression.
_CHUNK_HEAD_LENGTH = 8 + 8 + 8 + 4


def read_blocks(data: mmap) -> Iterator[Block | Damage]:
    """Walk the data section of a file from its front.

    Args:
        data: The whole file, at least as long as the magic bytes.

    Yields:
        Every record that can be trusted, every damage, in the order of the file. After damage it
        goes on at the next chunk; it ends at the end of the data section or of the file.
    """
    offset: int | None = len(MAGIC)
    chunked = False
    # Where to look for the next chunk: behind the last record that a checksum vouches for, because
    # one with a wrong length may have swallowed the beginning of what follows.
    trusted = 0
    if data[: len(MAGIC)] != MAGIC:
        yield Damage(0, DamageKind.RECORD, "the magic bytes at the start are wrong")
    while offset is not None:
        try:
            block, end = read_block(data, offset, chunked)
        except UnreadableError as error:
            resume = error.end if error.end is not None else find_chunk(data, trusted)
            # What reaches beyond the end with a chunk behind it is no cut, but a wrong length.
            wrong_length = error.kind is DamageKind.CUT_OFF and resume is not None
            yield Damage(offset, DamageKind.RECORD if wrong_length else error.kind, str(error))
            trusted, offset = offset + 1, resume
            continue
        yield block
        if block.compression is not None:
            chunked, trusted = True, end
        if block.records and isinstance(block.records[0], DataEnd):
            yield from _check_ending(data, block)
            return
        offset = end


def read_summary(data: mmap) -> list[McapRecord] | None:
    """Return the schemas and channels that the end of a file repeats.

    Args:
        data: The whole file.

    Returns:
        The records, or None when the end is missing or damaged, or has no such part.
    """
    footer = len(data) - len(MAGIC) - _FOOTER_LENGTH
    if footer < len(MAGIC) or data[-len(MAGIC) :] != MAGIC:
        return None
    if RECORD_HEAD.unpack_from(data, footer) != (Opcode.FOOTER, 8 + 8 + 4):
        return None
    start, _, checksum = struct.unpack_from("<QQI", data, footer + RECORD_HEAD.size)
    # The checksum covers the summary and all of the footer before the checksum itself.
    covered = data[start : len(data) - len(MAGIC) - 4] if 0 < start <= footer else b""
    if not covered or (checksum and zlib.crc32(covered) != checksum):
        return None
    return _summary_records(data, start, footer)


def find_chunk(data: mmap, start: int) -> int | None:
    """Return where the next chunk begins whose lengths agree with each other.

    Args:
        data: The whole file.
        start: Where to begin looking, in [byte].

    Returns:
        The place in [byte] from the start of the file, or None.
    """
    match = _CHUNK_START.search(data, start)
    while match is not None:
        if _is_chunk(data, match.start()):
            return match.start()
        match = _CHUNK_START.search(data, match.start() + 1)
    return None


def _is_chunk(data: mmap, offset: int) -> bool:
    end = offset + RECORD_HEAD.size + int(RECORD_HEAD.unpack_from(data, offset)[1])
    name = offset + RECORD_HEAD.size + _CHUNK_HEAD_LENGTH
    if end > len(data) or name + 4 > end:
        return False
    content = name + 4 + int(struct.unpack_from("<I", data, name)[0]) + 8
    return content <= end and content + int(struct.unpack_from("<Q", data, content - 8)[0]) == end


def _check_ending(data: mmap, block: Block) -> Iterator[Damage]:
    (data_end,) = block.records
    checksum = data_end.data_section_crc if isinstance(data_end, DataEnd) else 0
    with memoryview(data) as view, view[: block.offset] as section:
        actual = zlib.crc32(section) if checksum else 0
    if actual != checksum:
        reason = f"the checksum of the data section is {actual:08x}, the file says {checksum:08x}"
        yield Damage(block.offset, DamageKind.CHECKSUM, reason)
    if read_summary(data) is None:
        reason = "no index at the end, or a damaged one; other readers may refuse the file or lose messages"
        yield Damage(block.offset, DamageKind.INDEX, reason)


def _summary_records(data: mmap, start: int, end: int) -> list[McapRecord] | None:
    records: list[McapRecord] = []
    try:
        while start < end:
            opcode, body, start = read_record(data, start)
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                records.append(parse_record(opcode, body))
    except UnreadableError:
        return None
    return records
