"""Real processes, real signals: what a recording that is ended from outside leaves behind."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from recording.samples import number_of
from rosbags.highlevel import AnyReader

import walk_optimizer
from walk_optimizer.recording import describe_bag, repair_bag

HERE = Path(__file__).parent
ROOT = Path(walk_optimizer.__file__).parent.parent


@pytest.fixture
def start_child(tmp_path):
    children = []

    def start(mode: str) -> subprocess.Popen:
        path = os.pathsep.join([str(ROOT), str(HERE.parent), os.environ.get("PYTHONPATH", "")])
        child = subprocess.Popen(
            [sys.executable, str(HERE / "child_recorder.py"), mode, str(tmp_path / "walk")],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": path},
        )
        children.append(child)
        return child

    yield start
    for child in children:
        child.kill()
        child.wait()
        child.stdout.close()


def heard(child: subprocess.Popen) -> tuple[int, int]:
    """Messages that the child has offered, and that are in closed chunks."""
    return counts(child.stdout.readline())


def counts(line: str) -> tuple[int, int]:
    offered, stored = line.split()
    return int(offered), int(stored)


def kill(child: subprocess.Popen) -> None:
    child.send_signal(signal.SIGKILL)
    child.wait()


def recovered(directory: Path) -> list[int]:
    with AnyReader([directory]) as reader:
        return [number_of(raw) for _, _, raw in reader.messages()]


def test_sigkill_loses_the_open_chunk_and_nothing_else(start_child, tmp_path, record_property):
    child = start_child("open_chunk")
    offered, stored = heard(child)
    kill(child)
    report = repair_bag(tmp_path / "walk")
    record_property("lost", offered - report.recovered_messages)
    assert report.cut_off
    assert report.damaged_chunks == 0
    assert report.recovered_messages == stored < offered
    assert recovered(report.destination) == list(range(stored))
    # A joint state and its head take more than 200 bytes.
    assert offered - stored < 64 * 1024 / 200


def test_sigkill_loses_nothing_that_was_flushed(start_child, tmp_path):
    child = start_child("flushed")
    heard(child)
    kill(child)
    report = repair_bag(tmp_path / "walk")
    assert report.recovered_messages == 2000
    assert recovered(report.destination) == list(range(2000))


def test_sigkill_in_mid_stream_leaves_a_prefix(start_child, tmp_path):
    child = start_child("stream")
    stored = 0
    while stored < 200:
        _, stored = heard(child)
    kill(child)
    numbers = recovered(repair_bag(tmp_path / "walk").destination)
    assert len(numbers) >= stored
    assert numbers == list(range(len(numbers)))


def test_killed_recording_is_a_directory_that_can_be_described(start_child, tmp_path):
    child = start_child("flushed")
    heard(child)
    kill(child)
    info = describe_bag(tmp_path / "walk")
    assert info.has_metadata
    assert info.is_cut_off
    assert info.message_count == 2000


def test_after_sigterm_everything_received_is_in_a_closed_bag(start_child, tmp_path):
    child = start_child("stream")
    for _ in range(3):
        heard(child)
    child.send_signal(signal.SIGTERM)
    offered, stored = counts(list(child.stdout)[-1])
    assert child.wait() == 0
    assert offered == stored
    assert describe_bag(tmp_path / "walk").is_whole
    assert recovered(tmp_path / "walk") == list(range(offered))


def test_a_program_that_forgets_to_stop_still_closes_its_bag(start_child, tmp_path):
    assert start_child("forget").wait() == 0
    assert describe_bag(tmp_path / "walk").is_whole
    assert recovered(tmp_path / "walk") == list(range(100))
