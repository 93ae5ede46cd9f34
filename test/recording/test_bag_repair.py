"""Damage of every kind: found, named, and repaired without touching the original."""

import errno
import os
import random
import shutil
import struct
import tracemalloc
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import lz4.frame
import pytest
import yaml
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Chunk, DataEnd, Footer, Header
from mcap.writer import Writer
from recording.samples import (
    GAIT,
    JOINTS,
    PERIOD_NS,
    START_NS,
    STORE,
    joint_state,
    number_of,
    string,
    write_bag,
)
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, ReaderError, StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

from walk_optimizer.recording import (
    BagWriter,
    Compression,
    RecorderSettings,
    describe_bag,
    format_bag,
    read_messages,
    repair_bag,
)
from walk_optimizer.recording.errors import (
    BagExistsError,
    CompressedBagError,
    ForeignTopicError,
    NotABagError,
)
from walk_optimizer.recording.framing import MAGIC
from walk_optimizer.recording.playback import topic_names
from walk_optimizer.recording.records import DamageKind

COUNT = 300
CHUNK_BYTES = 8192
EXAMPLES = settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))


@dataclass(frozen=True)
class Sample:
    """A whole file, and where its chunks are by the word of the MCAP library."""

    data: bytes
    chunks: tuple[tuple[int, int, int], ...]  # start and end in [byte], joint states


@cache
def sample(compression: Compression) -> Sample:
    with TemporaryDirectory() as folder:
        chunked = RecorderSettings(chunk_bytes=CHUNK_BYTES, compression=compression)
        path = write_bag(Path(folder) / "walk", range(COUNT), chunked) / "walk_0.mcap"
        data = path.read_bytes()
        with path.open("rb") as stream:
            reader = make_reader(stream)
            indexes = reader.get_summary().chunk_indexes
            times = [message.log_time for _, _, message in reader.iter_messages(topics=[JOINTS.name])]
    assert len(indexes) > 5
    chunks = tuple(
        (
            index.chunk_start_offset,
            index.chunk_start_offset + index.chunk_length,
            sum(index.message_start_time <= time <= index.message_end_time for time in times),
        )
        for index in indexes
    )
    assert sum(count for _, _, count in chunks) == COUNT
    return Sample(data, chunks)


def joint_numbers(bag: Path) -> list[int]:
    """Numbers of the joint states in a bag, read by rosbags, which validates the metadata too."""
    with AnyReader([bag]) as reader:
        return [number_of(raw) for c, _, raw in reader.messages() if c.topic == JOINTS.name]


def flip(data: bytes, bit: int) -> bytes:
    flipped = bytearray(data)
    flipped[bit // 8] ^= 1 << bit % 8
    return bytes(flipped)


def check_repair(data: bytes, compression: Compression) -> tuple[list[int], list[DamageKind]]:
    """Repair a file and return what is left of the joint states, and the damage found."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "walk_0.mcap"
        path.write_bytes(data)
        info = describe_bag(path)
        report = repair_bag(path)
        assert path.read_bytes() == data
        assert sorted(item.name for item in Path(folder).iterdir()) == ["walk_0.mcap", "walk_0_repaired"]
        repaired = describe_bag(report.destination)
        assert repaired.is_whole
        assert repaired.message_count == report.recovered_messages == info.message_count
        if repaired.message_count:
            assert repaired.compressions == ("" if compression is Compression.NONE else compression.value,)
        numbers = joint_numbers(report.destination) if report.recovered_messages else []
    return numbers, [damage.kind for damage in info.files[0].damage]


@pytest.mark.parametrize("compression", list(Compression))
@EXAMPLES
@given(st.data())
def test_a_cut_anywhere_costs_no_closed_chunk(compression, data):
    whole = sample(compression)
    cut = data.draw(st.integers(0, len(whole.data) - 1))
    numbers, damage = check_repair(whole.data[:cut], compression)
    assert numbers == list(range(sum(count for _, end, count in whole.chunks if end <= cut)))
    # Cut behind the data, the file lacks its index only.
    assert damage in ([DamageKind.CUT_OFF], [DamageKind.INDEX])


@pytest.mark.parametrize("compression", list(Compression))
@EXAMPLES
@given(st.data())
def test_a_flipped_bit_anywhere_is_found_and_costs_one_chunk_at_most(compression, data):
    whole = sample(compression)
    bit = data.draw(st.integers(0, 8 * len(whole.data) - 1))
    numbers, damage = check_repair(flip(whole.data, bit), compression)
    hit = [item for item in whole.chunks if item[0] <= bit // 8 < item[1]]
    assert damage
    assert numbers == sorted(set(numbers))
    assert len(numbers) >= COUNT - sum(count for _, _, count in hit)


@pytest.mark.parametrize("compression", list(Compression))
@EXAMPLES
@given(st.data())
def test_any_bytes_over_any_stretch_leave_messages_in_order(compression, data):
    whole = sample(compression)
    start = data.draw(st.integers(0, len(whole.data)))
    gone = data.draw(st.integers(0, 5000))
    put = data.draw(st.binary(max_size=300))
    numbers, _ = check_repair(whole.data[:start] + put + whole.data[start + gone :], compression)
    # The stretch can touch all chunks between its ends; the others are whole.
    hit = [item for item in whole.chunks if item[0] < start + gone + 1 and start <= item[1]]
    first_hit = start < whole.chunks[0][1]
    assert numbers == sorted(set(numbers))
    assert first_hit or len(numbers) >= COUNT - sum(count for _, _, count in hit)


@pytest.mark.parametrize("compression", list(Compression))
def test_a_flipped_bit_in_a_message_is_found_by_its_checksum(tmp_path, compression):
    whole = sample(compression)
    start, end, count = whole.chunks[2]
    (tmp_path / "walk.mcap").write_bytes(flip(whole.data, 8 * (start + end) // 2))
    info = describe_bag(tmp_path / "walk.mcap")
    report = repair_bag(tmp_path / "walk.mcap")
    assert (report.damaged_chunks, report.damaged_records, report.cut_off) == (1, 0, False)
    assert report.lost_messages == count
    assert report.recovered_messages == COUNT + 1 - count
    assert info.files[0].damage[0].offset == start
    assert not info.is_whole
    assert f"walk.mcap, byte {start}: a chunk is damaged" in format_bag(info)
    assert f"{COUNT + 1 - count} messages recovered" in str(report)
    assert f"at least {count} messages lost" in str(report)


def test_a_chunk_length_beyond_the_end_costs_that_chunk_only():
    whole = sample(Compression.NONE)
    start, _, count = whole.chunks[1]
    numbers, damage = check_repair(flip(whole.data, 8 * (start + 1) + 30), Compression.NONE)
    assert len(numbers) == COUNT - count
    assert damage == [DamageKind.RECORD, DamageKind.CHECKSUM]


def test_topics_of_a_damaged_first_chunk_come_from_the_end_of_the_file():
    whole = sample(Compression.ZSTD)
    start, end, count = whole.chunks[0]
    numbers, _ = check_repair(flip(whole.data, 4 * (start + end)), Compression.ZSTD)
    assert numbers == list(range(count, COUNT))


def test_messages_whose_topic_is_lost_are_counted(tmp_path):
    """The first chunk holds the topics; damaged in a file without its end, it takes them along."""
    whole = sample(Compression.NONE)
    start, end, first = whole.chunks[0]
    data = flip(whole.data, 4 * (start + end))[: whole.chunks[3][1]]
    (tmp_path / "walk.mcap").write_bytes(data)
    report = repair_bag(tmp_path / "walk.mcap")
    assert report.recovered_messages == 0
    assert report.lost_messages == first + 1 + sum(count for _, _, count in whole.chunks[1:4])


def test_a_split_bag_keeps_its_files_and_its_texts(tmp_path):
    bag = write_bag(tmp_path / "walk.v2", range(2000), RecorderSettings(max_file_bytes=100_000))
    last = sorted(bag.glob("*.mcap"), key=lambda path: int(path.stem.split("_")[1]))[-1]
    last.write_bytes(last.read_bytes()[:-50])
    before = {path.name: path.read_bytes() for path in bag.iterdir()}
    report = repair_bag(bag)
    assert {path.name: path.read_bytes() for path in bag.iterdir()} == before
    assert report.destination == tmp_path / "walk.v2_repaired"
    assert report.recovered_messages == 2001
    assert joint_numbers(report.destination) == list(range(2000))
    assert len(describe_bag(report.destination).files) == len(before) - 1
    assert dict(describe_bag(report.destination).custom_data)["repaired_from"] == "walk.v2"
    assert [message.topic.qos for message in read_messages(report.destination)][:2] == [
        message.topic.qos for message in read_messages(bag)
    ][:2]


def without_index(data: bytes) -> bytes:
    """Return a file with a bare end, as a disk without space for more leaves it."""
    footer = len(data) - len(MAGIC) - struct.calcsize("<QQI")
    (summary,) = struct.unpack_from("<Q", data, footer)
    end = RecordBuilder()
    DataEnd(0).write(end)
    whole_end = len(end.end())
    DataEnd(0).write(end)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(end)
    return data[: summary - whole_end] + end.end() + MAGIC


def test_a_file_without_index_is_told_and_repaired(tmp_path):
    with BagWriter(tmp_path / "walk", RecorderSettings(min_free_bytes=0), topics=[JOINTS, GAIT]) as writer:
        for number in range(100):
            # Two threads take their times, and one is overtaken.
            writer.write(JOINTS.name, joint_state(number), START_NS + number * PERIOD_NS)
            writer.write(GAIT.name, string("gait"), START_NS + number * PERIOD_NS - 1)
    path = tmp_path / "walk" / "walk_0.mcap"
    path.write_bytes(without_index(path.read_bytes()))
    with pytest.raises(ReaderError, match="Use an indexed file"):
        joint_numbers(tmp_path / "walk")
    info = describe_bag(tmp_path / "walk")
    assert (info.is_whole, info.message_count) == (False, 200)
    assert "damaged (1 x index); `bag repair` writes a whole bag" in format_bag(info)
    assert "no index at the end" in format_bag(info)
    repaired = repair_bag(tmp_path / "walk").destination
    assert describe_bag(repaired).is_whole
    assert joint_numbers(repaired) == list(range(100))


@pytest.mark.parametrize(
    ("key", "value", "fault"),
    [
        ("message_count", 57, "is out of date: it tells of 57 messages, the files hold 2001"),
        ("message_count", "many", "is out of date: it tells of 0 messages, the files hold 2001"),
        ("relative_file_paths", ["walk_0.mcap"], "lacks files: walk_1.mcap"),
        (
            "relative_file_paths",
            ["walk/walk_0.mcap", "walk_1.mcap", "x.mcap"],
            "names files that are not there: x.mcap",
        ),
        (None, None, "is missing or can't be read"),
    ],
)
def test_metadata_that_differ_from_the_files_are_told_and_repaired(tmp_path, key, value, fault):
    bag = write_bag(tmp_path / "walk", range(2000), RecorderSettings(max_file_bytes=400_000))
    assert [path.name for path in sorted(bag.glob("*.mcap"))] == ["walk_0.mcap", "walk_1.mcap"]
    assert describe_bag(bag).is_whole
    content = yaml.safe_load((bag / "metadata.yaml").read_text())
    content["rosbag2_bagfile_information"][key] = value
    (bag / "metadata.yaml").write_text(yaml.safe_dump(content) if key else "")
    info = describe_bag(bag)
    assert not info.is_whole
    assert [text.partition("metadata.yaml ")[2] for text in info.metadata_faults] == [fault]
    assert "damaged (metadata.yaml); `bag repair` writes a whole bag" in format_bag(info)
    assert f"  metadata.yaml {fault}" in format_bag(info)
    repaired = repair_bag(bag).destination
    assert describe_bag(repaired).is_whole
    assert joint_numbers(repaired) == list(range(2000))


def test_damage_is_not_told_twice(tmp_path):
    """Metadata that tell of messages which a damaged chunk has lost are right."""
    bag = write_bag(tmp_path / "walk", range(COUNT), RecorderSettings(chunk_bytes=CHUNK_BYTES))
    whole = sample(Compression.NONE)
    (bag / "walk_0.mcap").write_bytes(flip(whole.data, 8 * (sum(whole.chunks[2][:2]) // 2)))
    assert describe_bag(bag).count_damage(DamageKind.CHUNK) == 1
    assert describe_bag(bag).metadata_faults == ()


def test_a_bag_without_readable_metadata_is_still_a_bag(tmp_path):
    bag = write_bag(tmp_path / "walk", range(10))
    for text in (
        "",
        "rosbag2_bagfile_information: [",
        "rosbag2_bagfile_information: 3",
        "[" * 1000,
        "&a [*a]",
        f"rosbag2_bagfile_information: {{ros_distro: {'j' * (1 << 22)}}}",
        "rosbag2_bagfile_information: {? [a] : b, ? {} : c}",
    ):
        (bag / "metadata.yaml").write_text(text)
        info = describe_bag(bag)
        assert (info.message_count, info.has_metadata) == (11, False)
    (bag / "metadata.yaml").unlink()
    os.mkfifo(bag / "metadata.yaml")
    assert not describe_bag(bag).has_metadata
    report = repair_bag(bag)
    assert report.recovered_messages == 11
    with Reader(report.destination) as reader:
        assert reader.message_count == 11


def test_repair_overwrites_nothing(tmp_path):
    bag = write_bag(tmp_path / "walk", range(10))
    repair_bag(bag)
    with pytest.raises(BagExistsError, match="walk_repaired exists already"):
        repair_bag(bag)
    assert repair_bag(bag, tmp_path / "elsewhere").recovered_messages == 11


@pytest.mark.parametrize(("folder", "name"), [("walk/notes", ".."), ("walk", "."), (".", "walk/notes/..")])
def test_a_repaired_bag_lies_beside_its_source_however_that_is_named(tmp_path, monkeypatch, folder, name):
    bag = write_bag(tmp_path / "walk", range(10))
    (bag / "notes").mkdir()
    monkeypatch.chdir(tmp_path / folder)
    report = repair_bag(Path(name))
    assert report.destination == tmp_path / "walk_repaired"
    assert dict(describe_bag(report.destination).custom_data)["repaired_from"] == "walk"


def test_a_failed_repair_leaves_nothing(tmp_path, monkeypatch):
    bag = write_bag(tmp_path / "walk", range(10))
    monkeypatch.setattr("walk_optimizer.recording.repair._copy", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        repair_bag(bag)
    assert [path.name for path in tmp_path.iterdir()] == ["walk"]


def test_repair_is_advised_only_where_something_can_be_saved(tmp_path):
    whole = write_bag(tmp_path / "walk", range(2000)) / "walk_0.mcap"
    for size, words in (
        (0, "damaged (1 x cut_off); nothing was recorded that could be saved"),
        (
            whole.stat().st_size // 2,
            "damaged (1 x cut_off); `bag repair` writes a whole bag from what is left",
        ),
    ):
        cut = tmp_path / f"cut_{size}.mcap"
        cut.write_bytes(whole.read_bytes()[:size])
        assert words in format_bag(describe_bag(cut))


def bag_of_rosbags(path: Path, plugin: StoragePlugin, mode: CompressionMode = CompressionMode.NONE) -> Path:
    writer = RosbagsWriter(path, version=9, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection(JOINTS.name, JOINTS.type_name, typestore=STORE)
        for number in range(100):
            writer.write(connection, START_NS + number * PERIOD_NS, joint_state(number))
    return path


READERS = pytest.mark.parametrize("use", [describe_bag, repair_bag, lambda path: list(read_messages(path))])


@READERS
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("missing", "There is no .*walk"),
        ("empty folder", "walk holds no .mcap file; name a bag directory or an .mcap file"),
        ("text", "walk is no MCAP file: it begins with b'a shoppi'"),
        ("noise", "walk is no MCAP file"),
        ("sqlite", "walk holds no .mcap file: its storage is 'sqlite3', not 'mcap'; `ros2 bag convert`"),
        ("named pipe", "walk is no regular file"),
        ("size unknown", "walk is no MCAP file: it begins with"),
        ("name too long", "Cannot read .* characters .*: File name too long"),
    ],
)
def test_what_is_no_bag_gives_one_typed_error(tmp_path, use, kind, words):
    path = tmp_path / "walk"
    if kind == "empty folder":
        path.mkdir()
    elif kind == "text":
        path.write_text("a shopping list")
    elif kind == "noise":
        path.write_bytes(random.Random(1).randbytes(100_000))
    elif kind == "sqlite":
        bag_of_rosbags(path, StoragePlugin.SQLITE3)
    elif kind == "named pipe":
        os.mkfifo(path)
    elif kind == "size unknown":
        path.symlink_to("/proc/cpuinfo")
    elif kind == "name too long":
        path = tmp_path / ("walk" * 100)
    with pytest.raises(NotABagError, match=words):
        use(path)
    assert not (tmp_path / "walk_repaired").exists()


@READERS
@pytest.mark.parametrize("name", [".", "walk_0.mcap"])
def test_what_may_not_be_looked_at_is_told(tmp_path, monkeypatch, use, name):
    bag = write_bag(tmp_path / "walk", range(10))

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    # Root may look everywhere, so the operating system is made to refuse.
    monkeypatch.setattr(Path, "iterdir" if name == "." else "stat", refuse)
    with pytest.raises(NotABagError, match=r"Cannot read .*walk.*: Permission denied"):
        use(bag / name)


@READERS
@pytest.mark.parametrize("mode", [CompressionMode.MESSAGE, CompressionMode.FILE])
def test_a_bag_that_rosbag2_compressed_is_refused(tmp_path, use, mode):
    bag = bag_of_rosbags(tmp_path / "walk", StoragePlugin.MCAP, mode)
    words = f"walk was compressed by rosbag2 in mode {mode.name}, allowed are .*`ros2 bag convert` it first"
    with pytest.raises(CompressedBagError, match=words):
        use(bag)
    assert [path.name for path in tmp_path.iterdir()] == ["walk"]


def test_a_single_file_of_compressed_messages_is_refused_too(tmp_path):
    bag = bag_of_rosbags(tmp_path / "walk", StoragePlugin.MCAP, CompressionMode.MESSAGE)
    with pytest.raises(CompressedBagError, match="compressed by rosbag2 in mode MESSAGE"):
        repair_bag(bag / "walk.mcap")


@pytest.mark.parametrize(
    ("custom_data", "expected"),
    [
        ("[1, 2]", ()),
        ("hello", ()),
        ("5", ()),
        ("{1: 2, a: [b], e: null}", (("1", "2"),)),
        ("{a: b}", (("a", "b"),)),
    ],
)
def test_custom_data_that_make_no_sense_are_none(tmp_path, custom_data, expected):
    bag = write_bag(tmp_path / "walk", range(10))
    text = f"rosbag2_bagfile_information: {{custom_data: {custom_data}, ros_distro: [x]}}"
    (bag / "metadata.yaml").write_text(text)
    info = describe_bag(bag)
    assert (info.custom_data, info.ros_distro, info.message_count) == (expected, "", 11)


def test_a_file_on_its_own_still_tells_where_it_comes_from(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DISTRO", "humble")
    info = describe_bag(write_bag(tmp_path / "walk", range(10)) / "walk_0.mcap")
    assert (info.ros_distro, info.has_metadata) == ("humble", False)


def test_a_bag_of_another_writer_is_described_and_read(tmp_path):
    bag_of_rosbags(tmp_path / "walk", StoragePlugin.MCAP)
    info = describe_bag(tmp_path / "walk")
    assert info.is_whole
    assert (info.message_count, info.start_time_ns, info.duration_ns) == (100, START_NS, 99 * PERIOD_NS)
    assert [number_of(message.data) for message in read_messages(tmp_path / "walk")] == list(range(100))
    assert next(read_messages(tmp_path / "walk")).topic.type_name == JOINTS.type_name


def test_a_file_without_chunks_is_read(tmp_path):
    with (tmp_path / "walk.mcap").open("wb") as stream:
        writer = Writer(stream, use_chunking=False)
        writer.start("ros2")
        schema = writer.register_schema(JOINTS.type_name, "ros2msg", JOINTS.definition.encode())
        channel = writer.register_channel(JOINTS.name, "cdr", schema)
        for number in range(10):
            writer.add_message(channel, number, joint_state(number), number)
        writer.finish()
    assert describe_bag(tmp_path / "walk.mcap").is_whole
    shutil.copy(tmp_path / "walk.mcap", tmp_path / "cut.mcap")
    data = (tmp_path / "walk.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    numbers = [number_of(message.data) for message in read_messages(tmp_path / "cut.mcap")]
    assert 0 < len(numbers) < 10
    assert numbers == list(range(len(numbers)))


def file_with_chunk(path: Path, compression: str, data: bytes, size: int) -> Path:
    """Write a file of one chunk that claims a size in [byte] and has no checksum."""
    records = RecordBuilder()
    Header(profile="ros2", library="").write(records)
    Chunk(compression, data, 0, 0, uncompressed_crc=0, uncompressed_size=size).write(records)
    path.write_bytes(MAGIC + records.end())
    return path


@pytest.mark.parametrize(
    ("compression", "compress"),
    [
        ("lz4", lambda data: lz4.frame.compress(data, store_size=False)),
        ("zstd", zstandard.ZstdCompressor(write_content_size=False).compress),
        ("zstd", zstandard.ZstdCompressor().compress),
    ],
)
def test_a_chunk_takes_no_more_memory_than_it_says(tmp_path, compression, compress):
    bomb = file_with_chunk(tmp_path / "bomb.mcap", compression, compress(bytes(1 << 26)), size=1000)
    tracemalloc.start()
    info = describe_bag(bomb)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert info.files[0].damage[0].kind is DamageKind.CHUNK
    assert peak < 1 << 23


@pytest.mark.parametrize(
    ("compression", "size", "words"),
    [
        ("zstd", 1 << 40, "it claims 1099511627776 bytes, at most 1140850688 are opened"),
        ("", 5, "it holds 3 bytes, it says 5"),
        ("brotli", 3, "its compression 'brotli' is none of zstd, lz4"),
    ],
)
def test_a_chunk_that_cannot_be_is_not_opened(tmp_path, compression, size, words):
    info = describe_bag(file_with_chunk(tmp_path / "walk.mcap", compression, b"abc", size))
    assert words in info.files[0].damage[0].reason


def foreign_file(path: Path, *channels: tuple[str, str], attached: bool = False) -> Path:
    """Write messages of several types and encodings on one topic, as other programs may."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("")
        for time_ns, (type_name, encoding) in enumerate(channels):
            schema = writer.register_schema(type_name, "ros2msg", b"string data")
            writer.add_message(writer.register_channel("/t", encoding, schema), time_ns, string("a"), time_ns)
        if attached:
            writer.add_attachment(0, 0, "notes.txt", "text/plain", b"notes")
            writer.add_metadata("notes", {"by": "hand"})
        writer.finish()
    return path


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        (
            [("std_msgs/msg/String", "cdr"), ("std_msgs/msg/Float64", "cdr")],
            "topic '/t' has 2 types, 'std_msgs/msg/String' and 'std_msgs/msg/Float64', allowed is one",
        ),
        ([("std_msgs/msg/String", "protobuf")], "topic '/t' is encoded as 'protobuf', allowed is cdr"),
    ],
)
def test_topics_that_are_none_of_ros_are_not_repaired_nor_played(tmp_path, channels, words):
    path = foreign_file(tmp_path / "foreign.mcap", *channels)
    with pytest.raises(ForeignTopicError, match=words):
        repair_bag(path)
    with pytest.raises(ForeignTopicError, match=words):
        topic_names(describe_bag(path), None)
    types = ", ".join(name for name, _ in channels)
    assert f"  /t  {types}  {len(channels)}" in format_bag(describe_bag(path))
    assert [path.name for path in tmp_path.iterdir()] == ["foreign.mcap"]


def test_what_a_repaired_bag_cannot_hold_is_told(tmp_path):
    report = repair_bag(foreign_file(tmp_path / "a.mcap", ("std_msgs/msg/String", "cdr"), attached=True))
    assert report.recovered_messages == 1
    assert str(report).endswith("; 2 attachments and metadata of other programs left out")
    assert "left out" not in str(repair_bag(write_bag(tmp_path / "walk", range(3)))).partition("lost")[2]


def test_a_repaired_bag_keeps_its_distribution(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DISTRO", "humble")
    bag = write_bag(tmp_path / "walk", range(10))
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    for source in (bag, bag / "walk_0.mcap"):
        assert describe_bag(repair_bag(source).destination).ros_distro == "humble"


def test_description_for_people(tmp_path):
    bag = write_bag(tmp_path / "walk", range(1000), RecorderSettings(compression=Compression.LZ4))
    text = format_bag(describe_bag(bag))
    assert "State:       whole, all checksums right" in text
    assert "Compression: lz4" in text
    assert "Duration:    0.999000 s" in text
    assert "Messages:    1001" in text
    assert "/walker/joint_reference  sensor_msgs/msg/JointState  1000" in text
