import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("matplotlib")

from nodes.graph import children_of, exists
from rosbags.highlevel import AnyReader

from walk_optimizer.cli.processes import free_domain, isolated_environment

pytestmark = pytest.mark.ros


def demo(output, *arguments):
    environment = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
    return subprocess.Popen(
        [sys.executable, "-m", "walk_optimizer.cli.main", "demo", "--output", str(output), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )


@pytest.mark.slow
def test_the_demonstration_does_the_whole_job(tmp_path):
    process = demo(tmp_path, "--points", "20", "--seconds", "2")
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    assert "as the gait says" in output
    assert "all nodes have left cleanly" in output
    assert "stiffness_and_equilibrium" in output
    assert (tmp_path / "gait.png").stat().st_size > 10_000
    with AnyReader([tmp_path / "bag"]) as reader:
        topics = {connection.topic for connection in reader.connections}
    assert "/reference_publisher/joint_reference" in topics


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_node_is_left_behind(tmp_path, number):
    process = demo(tmp_path, "--points", "2000")
    logs = [tmp_path / f"{name}.log" for name in ("gait_optimizer", "gait_library", "reference_publisher")]
    deadline = time.monotonic() + 180
    while not all(log.exists() and "ready" in log.read_text() for log in logs):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    nodes = children_of(process.pid)
    assert len(nodes) >= 3
    process.send_signal(number)
    output, _ = process.communicate(timeout=60)
    assert process.returncode != 0
    assert "Traceback" not in output
    while any(map(exists, nodes)):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def test_a_bad_speed_is_refused_before_anything_starts(tmp_path):
    process = demo(tmp_path / "none", "--speed", "99")
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "allowed is" in output
    assert not Path(tmp_path / "none").exists()


def test_a_domain_that_is_named_is_kept():
    assert isolated_environment({"ROS_DOMAIN_ID": "7"})["ROS_DOMAIN_ID"] == "7"
    assert 1 <= int(isolated_environment({})["ROS_DOMAIN_ID"]) <= 101
    assert 1 <= free_domain() <= 101
