"""A file whose parts disagree is found, however well each part looks by itself."""

from dataclasses import replace

from library.made_up_gait import with_refinement

from walk_optimizer.gait_files import SUFFIX, write_gait_file
from walk_optimizer.library.verification import verify_file


def verified(solved, folder, **changes):
    path = folder / f"gait{SUFFIX}"
    write_gait_file(replace(solved.gait, **changes), path)
    return verify_file(path, solved.walker)


def test_a_solved_gait_passes(solved, tmp_path):
    assert verified(solved, tmp_path).passed


def test_a_changed_trajectory_fails_by_family(solved, tmp_path):
    trajectory = solved.gait.trajectory
    torques = trajectory.u.copy()
    torques[0, 12] += 1.0
    found = verified(solved, tmp_path, trajectory=replace(trajectory, u=torques))
    assert not found.passed
    assert "dynamics is 1 N or N m, allowed 0.000736" in found.problem


def test_a_wrong_step_length_fails(solved, tmp_path):
    # References move the hip on by the stored length at every step.
    found = verified(solved, tmp_path, step_length=solved.gait.step_length + 0.25)
    assert "step_length is 0.25 m, allowed 1e-06" in found.problem


def test_wrong_times_fail(solved, tmp_path):
    trajectory = solved.gait.trajectory
    found = verified(solved, tmp_path, trajectory=replace(trajectory, time=3 * trajectory.time))
    assert f"time is {2 * solved.request.step_time:.3g} s, allowed 1e-06" in found.problem


def test_a_refined_part_that_is_none_fails_by_family(solved, tmp_path):
    refined = with_refinement(solved.gait).refined
    assert refined.certificate.certified
    problem = verified(solved, tmp_path, refined=refined).problem
    assert "refined dynamics is " in problem
    assert "refined interval_replay is " in problem
