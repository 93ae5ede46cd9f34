"""What a build of the table stores and shows."""

from dataclasses import replace

import pytest
from library.made_up_gait import made_up_gait

from walk_optimizer.certificate.grid import certify
from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.cli.library_build import bar_text, former_gaits, minutes, solve_text, store_better
from walk_optimizer.gait_files import read_gait_file
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import Outcome, optimize
from walk_optimizer.optimizer.table_builder import TableProgress
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import SolveReport, Status

REQUEST = GaitRequest.for_speed(0.25 / 0.785, "stiffness", 20)


@pytest.fixture(scope="module")
def solved():
    return optimize(REQUEST, WalkerParameters()).gait


def worse(gait):
    """Return a gait that is certified but has a larger F: the torques that the model ignores grow."""
    trajectory = replace(gait.trajectory, u=gait.trajectory.u * 1.0000001)
    certificate = certify(gait.walker, gait.request, gait.spring, trajectory)
    assert certificate.certified
    return replace(gait, trajectory=trajectory, certificate=certificate)


def worse_refinement(gait, torque=1e-5):
    """Return a refinement that is certified but takes more torque, by a part that the certificate allows."""
    trajectory = replace(gait.refined.trajectory, torques=gait.refined.trajectory.torques * (1 + torque))
    refined = replace(gait.refined, trajectory=trajectory)
    certificate = certify_refined(gait.walker, gait.request, refined)
    assert certificate.certified
    return replace(refined, certificate=certificate)


def test_a_build_never_makes_the_table_worse(tmp_path, solved):
    assert store_better(worse(solved), tmp_path)
    assert store_better(solved, tmp_path)
    assert not store_better(worse(solved), tmp_path)
    (path,) = tmp_path.iterdir()
    assert read_gait_file(path).objective == solved.objective


def test_a_file_that_fails_its_certificate_is_replaced_whatever_its_objective(tmp_path, solved):
    idle = replace(solved, trajectory=replace(solved.trajectory, u=0 * solved.trajectory.u))
    assert store_better(idle, tmp_path)
    assert store_better(solved, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(b"torn")
    assert store_better(solved, tmp_path)


def progress(gait, report):
    return TableProgress("search", 3, 21, REQUEST, Outcome(gait, report), kept=gait is not None)


def test_each_solve_has_its_line():
    gait = made_up_gait(mode="stiffness")
    report = replace(gait.report, objective=12.5)
    assert solve_text(progress(gait, report), stored=True) == (
        "search 3/21  1.15 km/h stiffness: F 12.5, 1.2 s, stored"
    )
    assert solve_text(progress(gait, report), stored=False).endswith(", no better")
    failed = SolveReport(Status.INFEASIBLE, "no gait; worst is dynamics: 3 N", "ipopt", solve_time=2.0)
    assert solve_text(progress(None, failed), stored=False) == (
        "search 3/21  1.15 km/h stiffness: no gait; worst is dynamics: 3 N, 2.0 s, FAILED"
    )


def test_the_bar_estimates_the_time_that_is_left():
    assert bar_text("search", 7, 21, 70.0) == (
        "[##########....................] 7/21 search, 1:10 min, about 2:20 min left of this stage"
    )
    assert (minutes(0.2), minutes(59.6), minutes(3599.9)) == ("0:00 min", "1:00 min", "60:00 min")


def test_a_gait_without_refinement_gets_one_and_does_not_lose_it(tmp_path, solved):
    bare = replace(solved, refined=None)
    assert store_better(bare, tmp_path)
    assert store_better(solved, tmp_path)
    assert not store_better(bare, tmp_path)
    (path,) = tmp_path.iterdir()
    assert read_gait_file(path).refined is not None


def test_a_better_gait_that_is_not_refined_keeps_the_refinement_that_is_there(tmp_path, solved):
    assert store_better(worse(solved), tmp_path)
    assert store_better(replace(solved, refined=None), tmp_path)
    (path,) = tmp_path.iterdir()
    stored = read_gait_file(path)
    assert stored.objective == solved.objective
    assert stored.refined is not None


def test_a_worse_refinement_does_not_replace_a_better_one(tmp_path, solved):
    assert store_better(solved, tmp_path)
    assert not store_better(replace(solved, refined=worse_refinement(solved)), tmp_path)


def test_a_refinement_that_is_only_better_by_what_meshes_do_is_not_stored(tmp_path, solved):
    # The effort grows with the square of the torques: it is better by a part of 1e-7.
    former = replace(solved, refined=worse_refinement(solved, 5e-8))
    assert solved.refined.trajectory.torque_effort < former.refined.trajectory.torque_effort
    assert store_better(former, tmp_path)
    assert not store_better(solved, tmp_path)


def test_a_better_refinement_is_written_beside_a_better_gait(tmp_path, solved):
    assert store_better(replace(solved, refined=worse_refinement(solved)), tmp_path)
    assert store_better(worse(solved), tmp_path)
    (path,) = tmp_path.iterdir()
    stored = read_gait_file(path)
    assert stored.objective == solved.objective
    assert stored.refined.trajectory.torque_effort == solved.refined.trajectory.torque_effort


def test_a_build_begins_with_the_certified_gaits_of_its_folder_alone(tmp_path, solved):
    assert former_gaits(tmp_path, solved.walker) == []
    store_better(solved, tmp_path)
    (tmp_path / "torn.npz").write_bytes(b"torn")
    (former,) = former_gaits(tmp_path, solved.walker)
    assert former.objective == solved.objective
