"""New speeds straight from refined gaits of the library."""

from dataclasses import replace

import pytest

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.resolve import resolve
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
