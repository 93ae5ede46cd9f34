"""A file whose parts disagree is found, however well each part looks by itself."""

from dataclasses import replace

import pytest

from walk_optimizer.gait_files import SUFFIX, GaitFile, write_gait_file
from walk_optimizer.verification import verify_file


def verified(solved, folder, **changes):
    path = folder / f"gait{SUFFIX}"
    write_gait_file(GaitFile(replace(solved.gait, **changes)), path)
    return verify_file(path, solved.walker)


def test_a_solved_gait_passes(solved, tmp_path):
    assert verified(solved, tmp_path).passed


def test_a_changed_trajectory_fails_by_family(solved, tmp_path):
    trajectory = solved.gait.trajectory
    torques = trajectory.u.copy()
    torques[0, 12] += 1.0
    found = verified(solved, tmp_path, trajectory=replace(trajectory, u=torques))
    assert not found.passed
    assert "dynamics is 1 N, allowed 0.000736" in found.problem


@pytest.mark.xfail(reason="the stored step length is not held against where the foot lands", strict=True)
def test_a_wrong_step_length_fails(solved, tmp_path):
    # References move the hip on by the stored length at every step.
    assert not verified(solved, tmp_path, step_length=2 * solved.gait.step_length).passed


@pytest.mark.xfail(reason="the stored times are not held against the step time", strict=True)
def test_wrong_times_fail(solved, tmp_path):
    trajectory = solved.gait.trajectory
    assert not verified(solved, tmp_path, trajectory=replace(trajectory, time=3 * trajectory.time)).passed
