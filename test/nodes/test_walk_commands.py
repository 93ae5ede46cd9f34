"""What commands check before a walk changes, without a node."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.walk_commands import WalkCommands
from walk_optimizer.walk.joint_limits import JointLimitError, JointLimits
from walk_optimizer.walk.phase_clock import PhaseClock
from walk_optimizer.walk.walk import Walk

# Of a stand: 0.5 N m at the hips, 4 N m at the knees.
HIPS, KNEES = 1.0, 5.0


def test_only_limits_that_get_lower_are_refused():
    """Whatever is beyond its limit already: a robot that can do more is no reason to refuse."""
    stream = SimpleNamespace()
    commands = WalkCommands(None, stream, None, None, WalkerParameters())
    stream.walk = Walk(commands.begin(), PhaseClock())
    commands.limits = JointLimits(torque=(HIPS, 0.1, HIPS, KNEES))
    for raised in (JointLimits(), JointLimits(torque=(HIPS, 0.2, HIPS, KNEES)), commands.limits):
        commands.require_met(raised)
    with pytest.raises(JointLimitError, match=r"to stand, left_knee needs .*, its limit is 0\.05 N m$"):
        commands.require_met(JointLimits(torque=(HIPS, 0.05, HIPS, KNEES)))
    with pytest.raises(JointLimitError, match=r"to stand, right_knee needs .*, its limit is 3 N m$"):
        commands.require_met(JointLimits(torque=(HIPS, 0.2, HIPS, 3.0)))
