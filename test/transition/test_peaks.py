"""Between its nodes a step needs more than at them: limits hold for what is streamed."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.references.profile import RefinedProfile
from walk_optimizer.transition.builder import recomputed
from walk_optimizer.transition.table import TransitionTable
from walk_optimizer.walk.joint_limits import (
    JointLimitError,
    JointLimits,
    JointNeed,
    peaks_of_gait,
    peaks_of_solved,
)

SPRUNG = SpringMode.STIFFNESS_AND_EQUILIBRIUM


@pytest.fixture(scope="module")
def stop(gaits, stand, tmp_path_factory):
    """Packaged steps with their peak between two nodes: even of 400 samples the largest is 19 % lower."""
    table = TransitionTable(stand.walker, tmp_path_factory.mktemp("own"))
    return table.find(gaits[SPRUNG][4], stand)


def streamed(step):
    """Torques and joint speeds of a step, fifty of each interval: (n, 3), (n, 4)."""
    profile, breaks = RefinedProfile.of(step), step.trajectory.breaks
    # An interval begins right after the end of the one before: torques may jump there.
    times = np.concatenate([np.linspace(a + 1e-9, b, 50) for a, b in pairwise(breaks)])
    samples = [profile.sample(time) for time in times]
    return np.abs([one.u for one in samples]), np.abs([one.qdot[2:] for one in samples])


def test_peaks_are_those_of_the_polynomials(stop):
    peaks = peaks_of_solved(stop.steps)
    torques, speeds = (np.concatenate(parts) for parts in zip(*map(streamed, stop.steps), strict=True))
    knees = torques[:, 1:].max()
    at_nodes = max(np.abs(step.trajectory.torques[..., 1:]).max() for step in stop.steps)
    assert knees > 1.05 * at_nodes
    assert peaks.torque == pytest.approx([torques[:, 0].max(), knees] * 2, rel=1e-3)
    assert peaks.speed == pytest.approx([speeds[:, [0, 2]].max(), speeds[:, [1, 3]].max()] * 2, rel=1e-3)
    assert stop.peak_torques == pytest.approx(peaks.torque[:2])


def test_a_limit_between_the_nodes_and_the_peak_is_not_met(stop, table):
    at_nodes = max(np.abs(step.trajectory.torques).max() for step in stop.steps)
    limits = JointLimits(torque=(float(at_nodes),) * 4)
    with pytest.raises(JointLimitError, match="left_knee needs"):
        limits.require(JointNeed("to stop", peaks_of_solved(stop.steps)))
    assert table.find(stop.source, stop.target, at_nodes) is None
    assert table.find(stop.source, stop.target, stop.peak_torques.max()) is not None
    failures = recomputed(replace(stop, torque_limit=float(at_nodes))).failures()
    assert [entry.family for entry in failures] == ["torque_limit"]


def test_a_gait_is_judged_by_what_is_walked(gaits):
    gait = gaits[SPRUNG][3]
    torques, speeds = streamed(gait.refined)
    peaks = peaks_of_gait(gait)
    assert max(peaks.torque) == pytest.approx(torques.max(), rel=1e-3)
    assert max(peaks.speed) == pytest.approx(speeds.max(), rel=1e-3)
