"""The stream's own account of what is walked, without a node and without its thread."""

from unittest.mock import MagicMock

import pytest

pytest.importorskip("rclpy")

from walk.paces import SLOW, STAND

from walk_optimizer.nodes import joint_stream
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.streamed_gait import StreamedGait
from walk_optimizer.walk.blending import blended
from walk_optimizer.walk.phase_clock import PhaseClock


@pytest.fixture
def stream(monkeypatch):
    """A stream that stands, whose walk only the test moves on."""
    for name in ("RecordedTopic", "Pacer"):
        monkeypatch.setattr(joint_stream, name, MagicMock())
    stream = JointStream(MagicMock(), MagicMock(), PhaseClock())
    stream.start(STAND, 100.0)
    return stream


def test_a_plan_that_comes_too_late_changes_nothing(stream):
    start = blended(STAND, SLOW)
    walked, other = (StreamedGait(MagicMock(), SLOW, MagicMock(), MagicMock()) for _ in range(2))
    assert stream.follow(start, walked)
    for time in (0.0, 0.01):
        stream.walk.advance(time)
    assert stream.gait is walked
    assert not stream.follow(start, other)
    assert stream.gait is walked
