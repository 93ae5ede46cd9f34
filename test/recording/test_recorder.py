"""The background recorder: nothing blocks, nothing is lost in silence, failures end it cleanly."""

import errno
import logging
import os
import resource
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from recording.samples import GAIT, JOINTS, PERIOD_NS, START_NS, joint_state, number_of, string
from rosbags.highlevel import AnyReader

from walk_optimizer.recording import (
    BagWriter,
    Recorder,
    RecorderSettings,
    TopicInfo,
    describe_bag,
    read_messages,
    repair_bag,
)
from walk_optimizer.recording.disk import replace_text
from walk_optimizer.recording.errors import (
    BagExistsError,
    BagNotWritableError,
    DiskFullError,
    MessageError,
    RecordingError,
    TopicError,
)
from walk_optimizer.recording.mcap_file import McapFile
from walk_optimizer.recording.records import DamageKind

NO_LIMIT = RecorderSettings(min_free_bytes=0)
SMALL_CHUNKS = RecorderSettings(min_free_bytes=0, chunk_bytes=4096, flush_period=1e6)


def offer(recorder: Recorder, number: int) -> bool:
    return recorder.write(JOINTS.name, joint_state(number), START_NS + number * PERIOD_NS)


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait however long it takes; the test's own time limit ends a wait in vain."""
    while not condition():
        time.sleep(0.001)


def numbers_in(bag: Path) -> list[int]:
    return [number_of(message.data) for message in read_messages(bag, {JOINTS.name})]


def rosbags_numbers(bag: Path) -> list[int]:
    with AnyReader([bag]) as reader:
        return [number_of(raw) for c, _, raw in reader.messages() if c.topic == JOINTS.name]


def test_all_messages_are_in_the_bag(tmp_path):
    recorder = Recorder(tmp_path / "walk", NO_LIMIT, {"speed": "0.4 m/s"})
    recorder.add_topic(JOINTS)
    with recorder:
        assert recorder.status().recording
        assert all(offer(recorder, number) for number in range(3000))
    status = recorder.status()
    assert (status.messages, status.stored_messages, status.queued, status.dropped) == (3000, 3000, 0, 0)
    assert not status.recording
    assert status.error is None
    assert status.size_bytes == describe_bag(tmp_path / "walk").size_bytes
    assert rosbags_numbers(tmp_path / "walk") == list(range(3000))
    assert dict(describe_bag(tmp_path / "walk").custom_data) == {
        "speed": "0.4 m/s",
        "dropped_messages": "0",
    }


def test_topics_may_be_added_while_recording(tmp_path):
    recorder = Recorder(tmp_path / "walk", NO_LIMIT)
    with recorder:
        recorder.add_topic(JOINTS)
        offer(recorder, 0)
        recorder.add_topic(GAIT)
        recorder.add_topic(GAIT)
        recorder.write(GAIT.name, string("gait"), START_NS, START_NS - 1)
        with pytest.raises(TopicError, match="not other/msg/Type"):
            recorder.add_topic(TopicInfo(GAIT.name, "other/msg/Type", "", ""))
    first, second = read_messages(tmp_path / "walk")
    assert (first.topic, second.topic) == (JOINTS, GAIT)
    assert (second.log_time_ns, second.publish_time_ns) == (START_NS, START_NS - 1)


def test_stop_may_be_called_again_or_before_the_start(tmp_path):
    recorder = Recorder(tmp_path / "walk", NO_LIMIT)
    assert recorder.stop().messages == 0
    recorder.start()
    assert recorder.stop() == recorder.stop()
    with pytest.raises(RecordingError, match="was started before"):
        recorder.start()


def test_messages_after_the_stop_are_refused_and_no_loss(tmp_path):
    recorder = Recorder(tmp_path / "walk", NO_LIMIT)
    recorder.add_topic(JOINTS)
    with pytest.raises(RecordingError, match="was not started"):
        offer(recorder, 0)
    with recorder:
        offer(recorder, 0)
    assert not offer(recorder, 1)
    assert recorder.status().dropped == 0
    assert numbers_in(tmp_path / "walk") == [0]


def test_a_stop_in_mid_stream_is_no_loss(tmp_path, caplog):
    """Whoever streams does not know of the stop at once; what comes meanwhile found no full queue."""
    disk = StuckDisk()
    settings = RecorderSettings(min_free_bytes=0, chunk_bytes=1024, flush_period=1e6)
    recorder = Recorder(tmp_path / "walk", settings, free_space=disk.free_bytes)
    recorder.add_topic(JOINTS)
    recorder.start()
    taken = 0
    while not disk.stuck.is_set():
        taken += offer(recorder, taken)
    stopping = threading.Thread(target=recorder.stop)
    stopping.start()
    wait_until(lambda: not recorder.status().recording)
    assert not offer(recorder, taken)
    disk.released.set()
    stopping.join()
    status = recorder.status()
    assert (status.messages, status.dropped) == (taken, 0)
    assert dict(describe_bag(tmp_path / "walk").custom_data)["dropped_messages"] == "0"
    assert not caplog.text


def test_mistakes_of_the_caller_are_raised_at_once(tmp_path):
    recorder = Recorder(tmp_path / "walk", NO_LIMIT)
    recorder.add_topic(JOINTS)
    with recorder:
        with pytest.raises(TopicError, match="/other was not announced"):
            recorder.write("/other", b"", 0)
        with pytest.raises(MessageError, match="log time"):
            recorder.write(JOINTS.name, b"", -1)
    assert recorder.status().error is None


def test_start_refuses_an_existing_bag_and_an_impossible_place(tmp_path):
    (tmp_path / "walk").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(BagExistsError):
        Recorder(tmp_path / "walk", NO_LIMIT).start()
    with pytest.raises(BagNotWritableError):
        Recorder(tmp_path / "file" / "walk", NO_LIMIT).start()


class StuckDisk:
    """A disk that does not answer the recorder's thread until it is released."""

    def __init__(self) -> None:
        self.stuck = threading.Event()
        self.released = threading.Event()

    def free_bytes(self, _: Path) -> int:
        if threading.current_thread() is not threading.main_thread():
            self.stuck.set()
            self.released.wait()
        return 1 << 40


def test_a_full_queue_drops_counts_and_reports(tmp_path, caplog):
    disk = StuckDisk()
    settings = RecorderSettings(min_free_bytes=0, chunk_bytes=1024, flush_period=1e6, queue_messages=10)
    recorder = Recorder(tmp_path / "walk", settings, free_space=disk.free_bytes)
    recorder.add_topic(JOINTS)
    recorder.start()
    accepted = []
    number = 0
    while not disk.stuck.is_set():
        accepted += [number] if offer(recorder, number) else []
        number += 1
        wait_until(lambda: recorder.status().queued == 0 or disk.stuck.is_set())
    before = recorder.status().dropped
    free = 10 - recorder.status().queued
    taken = [offer(recorder, number + index) for index in range(free + 5)]
    assert taken == [True] * free + [False] * 5
    assert recorder.status().dropped == before + 5
    disk.released.set()
    with caplog.at_level(logging.WARNING):
        status = recorder.stop()
    expected = accepted + list(range(number, number + free))
    assert numbers_in(tmp_path / "walk") == expected
    assert status.messages == len(expected)
    assert dict(describe_bag(tmp_path / "walk").custom_data)["dropped_messages"] == str(status.dropped)
    assert f"{status.dropped} messages dropped, the queue of 10 was full" in caplog.text


def test_recording_ends_cleanly_at_the_free_space_limit(tmp_path, caplog):
    free = iter([200_000_000] * 5)
    settings = RecorderSettings(chunk_bytes=4096, min_free_bytes=100_000_000, flush_period=1e6)
    recorder = Recorder(tmp_path / "walk", settings, free_space=lambda _: next(free, 99_000_000))
    recorder.add_topic(JOINTS)
    recorder.start()
    offered = 0
    while recorder.status().recording:
        offer(recorder, offered)
        offered += 1
    # The caller's stream goes on, whatever became of the recording.
    assert not offer(recorder, offered)
    status = recorder.stop()
    assert isinstance(status.error, DiskFullError)
    assert "99.0 MB are free on the disk, and 100.0 MB must stay free" in str(status.error)
    assert str(status.error) in caplog.text
    assert describe_bag(tmp_path / "walk").is_whole
    assert rosbags_numbers(tmp_path / "walk") == list(range(status.messages))
    # The last one in the loop may have come when the recording had just ended.
    assert status.messages + status.dropped in {offered - 1, offered}


def test_start_refuses_a_disk_that_is_already_too_full(tmp_path):
    recorder = Recorder(tmp_path / "walk", RecorderSettings(), free_space=lambda _: 1000)
    with pytest.raises(DiskFullError, match=r"0\.0 MB are free"):
        recorder.start()
    assert not (tmp_path / "walk").exists()


def assert_only_its_index_may_lack(bag: Path) -> None:
    """The file may not have room for it; every message that was stored is there, checksums right."""
    info = describe_bag(bag)
    assert {damage.kind for file in info.files for damage in file.damage} <= {DamageKind.INDEX}
    assert info.metadata_faults == ()


class FullDisk:
    """Writes until its space is used up, then a part of what it is given, then nothing."""

    def __init__(self, space: int) -> None:
        self.space = space
        self.write = os.write
        self.truncate = os.ftruncate
        self.close = os.close

    def install(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(os, "write", self._write)
        monkeypatch.setattr(os, "ftruncate", self._truncate)
        monkeypatch.setattr(os, "close", self._close)
        monkeypatch.setattr("walk_optimizer.recording.bag_writer.replace_text", self._replace)

    def _write(self, descriptor: int, data: memoryview) -> int:
        if not self.space:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written = self.write(descriptor, data[: self.space])
        self.space -= written
        return written

    def _truncate(self, descriptor: int, size: int) -> None:
        self.space += os.fstat(descriptor).st_size - size
        self.truncate(descriptor, size)

    def _close(self, descriptor: int) -> None:
        status = os.fstat(descriptor)
        self.space += 0 if status.st_nlink else status.st_size
        self.close(descriptor)

    def _replace(self, path: Path, text: str) -> None:
        """Write metadata.yaml: all of it beside the former one, which goes then."""
        if len(text) > self.space:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.space += (path.stat().st_size if path.exists() else 0) - len(text)
        replace_text(path, text)


def two_threads(recorder: Recorder, count: int) -> int:
    """Offer messages whose times cross, as those of two threads do, and return how many were taken."""
    taken = 0
    for number in range(count):
        time_ns = START_NS + (number ^ 1) * PERIOD_NS
        taken += recorder.write(JOINTS.name, joint_state(number ^ 1), time_ns)
    return taken


@pytest.mark.parametrize("file_bytes", [0, 1 << 20])
@pytest.mark.parametrize("space", [100_000, 1_450_000, 2_097_152, 2_101_248])
def test_what_was_written_before_the_disk_was_full_is_a_whole_bag(tmp_path, monkeypatch, space, file_bytes):
    settings = RecorderSettings(min_free_bytes=0, max_file_bytes=file_bytes, flush_period=1e6)
    recorder = Recorder(tmp_path / "walk", settings)
    recorder.add_topic(JOINTS)
    recorder.start()
    FullDisk(space).install(monkeypatch)
    taken = two_threads(recorder, 20_000)
    status = recorder.stop()
    monkeypatch.undo()
    assert isinstance(status.error, DiskFullError)
    assert "walk: No space left on device; free space" in str(status.error)
    assert 200 < status.messages < 20_000
    assert status.messages + status.dropped == taken
    info = describe_bag(tmp_path / "walk")
    assert info.is_whole
    assert dict(info.custom_data) == {"dropped_messages": str(status.dropped)}
    assert len(info.files) == 1 or file_bytes
    for file in info.files:
        with file.path.open("rb") as stream:
            summary = make_reader(stream, validate_crcs=True).get_summary()
        assert summary.statistics.message_count == file.entry.message_count
    metadata = yaml.safe_load((tmp_path / "walk" / "metadata.yaml").read_text())
    described = metadata["rosbag2_bagfile_information"]
    assert described["message_count"] == status.messages
    assert described["relative_file_paths"] == [file.path.name for file in info.files]
    # rosbags goes by the index: a file without one it refuses, or reads in another order.
    assert sorted(rosbags_numbers(tmp_path / "walk")) == sorted(numbers_in(tmp_path / "walk"))
    assert len(rosbags_numbers(tmp_path / "walk")) == status.messages


def test_the_reserve_grows_with_the_index(tmp_path, monkeypatch):
    """A long recording has a long index: thousands of chunks are listed at its end."""
    recorder = Recorder(tmp_path / "walk", RecorderSettings(min_free_bytes=0, chunk_bytes=1024))
    recorder.add_topic(JOINTS)
    recorder.start()
    offered = sum(offer(recorder, number) for number in range(15_000))
    wait_until(lambda: recorder.status().messages == offered)
    FullDisk(0).install(monkeypatch)
    offered += sum(offer(recorder, offered + number) for number in range(100))
    status = recorder.stop()
    monkeypatch.undo()
    assert isinstance(status.error, DiskFullError)
    assert describe_bag(tmp_path / "walk").is_whole
    assert rosbags_numbers(tmp_path / "walk") == list(range(status.messages))


def test_nothing_but_the_bag_is_in_its_folder(tmp_path):
    recorder = Recorder(tmp_path / "walk", NO_LIMIT)
    recorder.start()
    assert {path.name for path in (tmp_path / "walk").iterdir()} == {"walk_0.mcap", "metadata.yaml"}
    recorder.stop()


def refuse(*_: object) -> None:
    raise OSError(errno.EIO, os.strerror(errno.EIO))


def test_a_disk_without_any_space_for_the_end_leaves_a_bag_to_repair(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path / "walk", SMALL_CHUNKS)
    recorder.add_topic(JOINTS)
    recorder.start()
    FullDisk(100_000).install(monkeypatch)
    monkeypatch.setattr(os, "ftruncate", refuse)
    for number in range(2000):
        offer(recorder, number)
    status = recorder.stop()
    monkeypatch.undo()
    assert status.error is not None
    assert describe_bag(tmp_path / "walk").is_cut_off
    report = repair_bag(tmp_path / "walk")
    assert report.recovered_messages == status.messages
    assert rosbags_numbers(report.destination) == list(range(status.messages))


def test_a_real_limit_of_the_operating_system_ends_the_recording_cleanly(tmp_path):
    recorder = Recorder(tmp_path / "walk", SMALL_CHUNKS)
    recorder.add_topic(JOINTS)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, limits[1]))
    try:
        recorder.start()
        for number in range(2000):
            offer(recorder, number)
        status = recorder.stop()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert isinstance(status.error, DiskFullError)
    assert 100 < status.messages < 2000
    assert_only_its_index_may_lack(tmp_path / "walk")
    assert rosbags_numbers(tmp_path / "walk") == list(range(status.messages))


@pytest.mark.parametrize("space", [10, 500])
def test_a_bag_that_cannot_be_begun_leaves_nothing(tmp_path, monkeypatch, space):
    FullDisk(space).install(monkeypatch)
    with pytest.raises(DiskFullError):
        BagWriter(tmp_path / "walk", topics=[JOINTS])
    assert not (tmp_path / "walk").exists()


def test_a_bag_whose_metadata_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("walk_optimizer.recording.bag_writer.replace_text", refuse)
    with pytest.raises(BagNotWritableError, match=r"metadata\.yaml: Input/output error"):
        BagWriter(tmp_path / "walk")
    assert not (tmp_path / "walk").exists()


def test_a_split_that_fails_leaves_the_finished_files(tmp_path, monkeypatch):
    writer = BagWriter(tmp_path / "walk", NO_LIMIT, topics=[JOINTS])
    writer.write(JOINTS.name, joint_state(0), START_NS)
    begin = McapFile.add_metadata

    def fail(file: McapFile, text: str) -> None:
        if file.path.name == "walk_1.mcap":
            raise DiskFullError("on purpose")
        begin(file, text)

    monkeypatch.setattr(McapFile, "add_metadata", fail)
    with pytest.raises(DiskFullError, match="on purpose"):
        writer.split()
    writer.close()
    assert [file.path.name for file in describe_bag(tmp_path / "walk").files] == ["walk_0.mcap"]
    assert rosbags_numbers(tmp_path / "walk") == [0]


def move(bag: Path) -> None:
    bag.rename(bag.with_name("moved"))


def delete_file(bag: Path) -> None:
    (bag / "walk_0.mcap").unlink()


@pytest.mark.parametrize("flush_period", [0.05, 1e6], ids=["noticed while it records", "noticed at the stop"])
@pytest.mark.parametrize("take_away", [move, shutil.rmtree, delete_file])
def test_a_bag_that_is_moved_or_deleted_is_told_and_not_claimed(tmp_path, flush_period, take_away, caplog):
    recorder = Recorder(tmp_path / "walk", RecorderSettings(min_free_bytes=0, flush_period=flush_period))
    recorder.add_topic(JOINTS)
    recorder.start()
    taken = sum(offer(recorder, number) for number in range(500))
    wait_until(lambda: recorder.status().messages == 500)
    take_away(tmp_path / "walk")
    if flush_period < 1:
        wait_until(lambda: not recorder.status().recording)
    status = recorder.stop()
    assert isinstance(status.error, BagNotWritableError)
    assert f"{tmp_path / 'walk'} was moved or deleted while it was recorded" in str(status.error)
    assert str(status.error) in caplog.text
    assert (status.messages, status.stored_messages, status.size_bytes) == (0, 0, 0)
    assert status.dropped == taken
    if take_away is move:
        report = repair_bag(tmp_path / "moved")
        assert report.recovered_messages == taken


def test_a_disk_that_does_not_tell_its_free_space_is_named(tmp_path):
    answers = iter([1 << 40])

    def free_space(place: Path) -> int:
        if (answer := next(answers, None)) is None:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return answer

    recorder = Recorder(tmp_path / "walk", SMALL_CHUNKS, free_space=free_space)
    recorder.add_topic(JOINTS)
    recorder.start()
    taken = 0
    while recorder.status().recording:
        taken += offer(recorder, taken)
    status = recorder.stop()
    assert f"Cannot write {tmp_path / 'walk'}: Input/output error; name a folder" in str(status.error)
    assert status.messages + status.dropped == taken
    assert describe_bag(tmp_path / "walk").is_whole


def test_an_unexpected_failure_of_the_thread_is_reported(tmp_path, monkeypatch):
    def fail(*arguments: object) -> None:
        raise ZeroDivisionError("on purpose")

    recorder = Recorder(tmp_path / "walk", NO_LIMIT)
    recorder.add_topic(JOINTS)
    recorder.start()
    monkeypatch.setattr(BagWriter, "write", fail)
    offer(recorder, 0)
    wait_until(lambda: not recorder.status().recording)
    status = recorder.stop()
    assert "failed unexpectedly: ZeroDivisionError('on purpose')" in str(status.error)
    assert status.dropped == 1
    assert describe_bag(tmp_path / "walk").is_whole
