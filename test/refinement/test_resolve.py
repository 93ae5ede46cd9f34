"""New speeds straight from refined gaits of the library."""

import math
import shutil
from dataclasses import replace

import pytest

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import with_continuation
from walk_optimizer.refinement.resolve import continued, resolve
from walk_optimizer.refinement.solves import RefinedSolves
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings


@pytest.fixture(scope="module")
def neighbours():
    gaits = GaitLibrary(WalkerParameters.from_yaml()).gaits()
    return sorted(
        (one for one in gaits if one.request.spring_mode is SpringMode.NONE), key=lambda one: one.speed
    )


def session():
    return SolveSession(solver_settings(), 300.0, None)


def test_a_speed_between_two_gaits_is_certified_and_costs_what_lies_between(neighbours):
    slower, faster = neighbours[1:3]
    request = GaitRequest.for_speed((slower.speed + faster.speed) / 2, "none")
    gait = resolve(request, [slower, faster], session())
    assert gait.certificate.certified
    assert gait.step_length / gait.trajectory.step_time == pytest.approx(request.speed, abs=1e-6)
    low, high = (one.refined.trajectory.torque_effort for one in (slower, faster))
    assert low < gait.trajectory.torque_effort < high
    alone = resolve(request, [slower], session())
    assert alone.trajectory.torque_effort == pytest.approx(gait.trajectory.torque_effort, rel=1e-3)


@pytest.mark.parametrize("count", [0, 3])
def test_other_numbers_of_neighbours_are_refused(neighbours, count):
    with pytest.raises(InvalidRequestError, match=f"{count} neighbours given, expected one or two"):
        resolve(neighbours[0].request, neighbours[:count], session())


def test_gaits_that_are_not_refined_are_refused(neighbours):
    with pytest.raises(InvalidRequestError, match="is not refined; solve it again"):
        resolve(neighbours[0].request, [replace(neighbours[0], refined=None)], session())


def test_the_best_of_single_neighbours_is_taken_and_those_that_do_not_fit_are_left_out(neighbours):
    request = GaitRequest.for_speed(0.5, "none")
    slower, faster = neighbours[2:4]
    efforts = [resolve(request, [one], session()).trajectory.torque_effort for one in (slower, faster)]
    assert min(efforts) < 0.99 * max(efforts), "the neighbours lead to different optima here"
    best = continued(request, [replace(neighbours[0], refined=None), slower, faster], session())
    assert best.certificate.certified
    assert best.trajectory.torque_effort == pytest.approx(min(efforts), rel=1e-9)
    assert continued(request, [replace(slower, refined=None)], session()) is None


def test_a_gait_takes_the_refinement_of_its_neighbours_only_where_that_is_better(neighbours):
    slower, own, faster = neighbours[1:4]
    alone = with_continuation(replace(own, refined=None), [slower, faster], session())
    assert alone.refined.certificate.certified
    assert with_continuation(own, [slower, faster], session()) is own
    assert with_continuation(own, [], session()) is own


def test_no_shipped_gait_without_springs_is_worse_than_the_continuation_of_its_neighbours(neighbours):
    for index, gait in enumerate(neighbours):
        seeds = neighbours[max(index - 1, 0) : index] + neighbours[index + 1 : index + 2]
        assert with_continuation(gait, seeds, session()) is gait, f"{gait.speed:.4f} m/s"


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("most_saved", [math.inf, -math.inf])
def test_a_mesh_is_divided_where_leaving_bounds_between_its_nodes_saves_too_much(
    neighbours, monkeypatch, most_saved
):
    adapted = []
    original = RefinedSolves.adapted
    monkeypatch.setattr(
        RefinedSolves, "adapted", lambda *arguments: adapted.append(1) or original(*arguments)
    )
    monkeypatch.setattr("walk_optimizer.refinement.resolve._MOST_SAVED", most_saved)
    slower = neighbours[1]
    gait = resolve(GaitRequest.for_speed(1.01 * slower.request.speed, "none"), [slower], session())
    assert gait.certificate.certified
    assert bool(adapted) == (most_saved < 0)
