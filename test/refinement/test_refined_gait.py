"""The refined gait: certified, converged, and walked by its own torques."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.certificate.replay import replay_step
from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.gait import Certificate, CertificateEntry, Gait, RefinedGait
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.refinement.mesh_adaptation import _MOST_PARTS, MeshErrors, resampled
from walk_optimizer.refinement.refine import refine
from walk_optimizer.refinement.solves import RefinedSolves
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.transcription.mesh import even_mesh
from walk_optimizer.transcription.phases import phases_of


def test_it_is_certified_and_walks_as_fast_as_requested(gait: Gait, refined: RefinedGait) -> None:
    assert refined.certificate.certified
    assert refined.step_length >= gait.request.step_length - 1e-9
    assert np.isclose(refined.trajectory.step_time, gait.request.step_time, rtol=1e-12)


def test_its_torques_replayed_over_the_step_end_where_it_ends(gait: Gait, refined: RefinedGait) -> None:
    end = replay_step(gait.walker, refined.spring, refined.trajectory)
    assert np.abs(end - refined.trajectory.states[-1, -1])[:6].max() < 1e-4


def test_a_mesh_twice_as_fine_changes_its_effort_by_less_than_a_thousandth(
    gait: Gait, session: SolveSession
) -> None:
    solution = refine(gait, session)
    assert solution.trajectory is not None
    finer = solution.mesh.divided(np.full(solution.mesh.intervals, 2))
    start = resampled(solution.trajectory, solution.spring, solution.mesh, finer)
    again = RefinedSolves(gait.request, gait.walker, session).solved(finer, start)
    assert again.effort == pytest.approx(solution.effort, rel=1e-3)


def test_where_accurate_intervals_add_up_to_too_much_the_mesh_gets_finer(
    gait: Gait, session: SolveSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    solution = refine(gait, session)
    assert solution.met
    judged: list[int] = []

    def too_strict_at_first(walker: WalkerParameters, request: GaitRequest, bare: RefinedGait) -> Certificate:
        judged.append(bare.trajectory.intervals)
        if len(judged) == 1:
            return Certificate((CertificateEntry("stance_height", 1.02e-6, "m", 1e-6),))
        return certify_refined(walker, request, bare)

    monkeypatch.setattr("walk_optimizer.refinement.solves.certify_refined", too_strict_at_first)
    found = RefinedSolves(gait.request, gait.walker, session).certified(solution)
    assert found is not None
    assert found.certificate.certified
    assert judged == [solution.mesh.intervals, found.trajectory.intervals]
    assert judged[0] < judged[1] <= 2 * judged[0]


@pytest.mark.parametrize("error", [np.inf, np.nan, 1.0])
def test_intervals_whose_replay_comes_to_no_end_are_divided_most(error: float) -> None:
    mesh = even_mesh([phases_of(single_impact(20))], 5)
    local = np.zeros(mesh.intervals)
    local[1] = error
    divided = MeshErrors(local, np.zeros_like(local)).divided(mesh)
    assert divided.intervals == mesh.intervals - 1 + _MOST_PARTS


def test_the_grid_of_the_report_overestimates_the_effort(gait: Gait, refined: RefinedGait) -> None:
    assert refined.trajectory.torque_effort < 0.9 * gait.torque_effort


@pytest.mark.parametrize(
    ("change", "family"),
    [
        ({"torques": 1.001}, "dynamics"),
        ({"forces": 1.001}, "dynamics"),
        ({"impulses": 1.01}, "impact"),
        ({"states": 1.0001}, "kinematics"),
        ({"breaks": 1.001}, "kinematics"),
    ],
)
def test_what_is_broken_is_found(
    gait: Gait, refined: RefinedGait, change: dict[str, float], family: str
) -> None:
    ((name, factor),) = change.items()
    scaled = getattr(refined.trajectory, name) * factor
    broken = replace(refined, trajectory=replace(refined.trajectory, **{name: scaled}))
    certificate = certify_refined(gait.walker, gait.request, broken)
    assert family in {entry.family for entry in certificate.failures()}


def test_what_is_not_a_number_fails(gait: Gait, refined: RefinedGait) -> None:
    torques = refined.trajectory.torques.copy()
    torques[3, 1, 2] = np.nan
    broken = replace(refined, trajectory=replace(refined.trajectory, torques=torques))
    assert not certify_refined(gait.walker, gait.request, broken).certified


def test_a_cancelled_refinement_says_so(gait: Gait) -> None:
    session = SolveSession(solver_settings(), 300.0, lambda progress: progress.iteration < 3)
    solution = refine(gait, session)
    assert session.stopped
    assert solution.trajectory is None
