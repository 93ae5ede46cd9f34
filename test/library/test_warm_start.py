"""Solves begin at the library's neighbours where there are some, and from scratch elsewhere."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.library.warm_start import neighbours, optimize_from
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import Outcome, optimize
from walk_optimizer.request import GaitRequest, gait_table_settings
from walk_optimizer.solve.status import SolveReport, Status

WALKER = WalkerParameters.from_yaml()
SPEEDS = gait_table_settings().table_speeds()
BETWEEN = (SPEEDS[2] + SPEEDS[3]) / 2


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return GaitLibrary(WALKER, tmp_path_factory.mktemp("empty"))


@pytest.mark.parametrize("mode", ["none", "stiffness", "stiffness_and_equilibrium"])
def test_neighbours_are_the_next_gaits_of_the_mode(library, mode):
    found = neighbours(library.gaits(), GaitRequest.for_speed(BETWEEN, mode))
    assert [gait.request.speed for gait in found] == pytest.approx([SPEEDS[2], SPEEDS[3]])
    assert {gait.request.spring_mode.value for gait in found} == {mode}


def test_a_speed_of_the_table_has_its_own_gait_for_neighbour(library):
    (found,) = neighbours(library.gaits(), GaitRequest.for_speed(SPEEDS[2], "none"))
    assert found.request.speed == pytest.approx(SPEEDS[2])


def test_one_side_alone_and_steps_of_ones_own_have_no_neighbours(library):
    slower = [gait for gait in library.gaits() if gait.request.speed < BETWEEN]
    assert neighbours(slower, GaitRequest.for_speed(BETWEEN, "none")) == []
    assert neighbours([], GaitRequest.for_speed(BETWEEN, "none")) == []
    assert neighbours(library.gaits(), GaitRequest.for_step(0.3, 0.6, "none")) == []


def test_from_neighbours_it_is_no_worse_than_from_scratch(library):
    request = GaitRequest.for_speed(BETWEEN, "none", 50)
    near = optimize_from(library, request, WALKER).gait
    alone = optimize(request, WALKER, refine=False).gait
    assert near.report.start.startswith("continued-")
    assert near.certificate.certified
    assert near.refined.certificate.certified
    assert near.objective <= alone.objective * (1 + 1e-4)


def test_without_neighbours_it_searches_from_scratch(library):
    request = GaitRequest.for_step(0.3, 0.75, "none", 20)
    gait = optimize_from(library, request, WALKER).gait
    assert gait.certificate.certified
    assert not gait.report.start.startswith("continued-")


@pytest.mark.parametrize(
    "status", [Status.INFEASIBLE, Status.ITERATION_LIMIT, Status.CANCELLED, Status.TIME_LIMIT]
)
def test_neighbours_that_lead_to_nothing_are_followed_by_a_search_unless_it_was_ended(
    library, monkeypatch, status
):
    asked = []

    def failing(request, walker, *, time_limit, seeds=(), from_scratch=True, **_others):
        asked.append((len(seeds), from_scratch, time_limit))
        return Outcome(None, SolveReport(status, status.sentence, "ipopt", "", 2, 30, 1.5))

    monkeypatch.setattr("walk_optimizer.library.warm_start.optimize", failing)
    outcome = optimize_from(library, GaitRequest.for_speed(BETWEEN, "none"), WALKER, time_limit=5.0)
    assert outcome.report.status is status
    ended = status in (Status.CANCELLED, Status.TIME_LIMIT)
    assert [(seeds, scratch) for seeds, scratch, _ in asked] == [(2, False), *([] if ended else [(0, True)])]
    assert all(0 < limit <= 5.0 for *_, limit in asked)
    report, solves = outcome.report, len(asked)
    assert (report.starts, report.iterations, report.solve_time) == (2 * solves, 30 * solves, 1.5 * solves)


def test_a_time_limit_of_nothing_is_refused(library):
    for request in (GaitRequest.for_speed(BETWEEN), replace(GaitRequest.for_speed(BETWEEN), step_length=0.3)):
        with pytest.raises(InvalidRequestError, match="time limit is 0"):
            optimize_from(library, request, WALKER, time_limit=0.0)


@given(st.floats(SPEEDS[0], SPEEDS[-1]), st.sampled_from(["none", "stiffness", "stiffness_and_equilibrium"]))
def test_every_speed_of_the_table_has_neighbours(library, speed, mode):
    found = neighbours(library.gaits(), GaitRequest.for_speed(speed, mode))
    assert 1 <= len(found) <= 2
    assert found[0].request.speed <= speed + 1e-4
    assert found[-1].request.speed >= speed - 1e-4
