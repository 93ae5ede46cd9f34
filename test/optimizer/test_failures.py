"""Searches that end without a gait say why, and which constraints were not met."""

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import pytest

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.optimizer.search import Search
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve import session as session_module
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.solution import Solution
from walk_optimizer.solve.status import Status

REQUEST = GaitRequest.for_speed(0.42, "none", 25)
STAGES = {"search", "fixed_schedule", "complementarity", "polish", "refinement"}


def assert_names_worst_family(report):
    """The message ends with the family that is farthest out of tolerance, with its unit."""
    assert report.message.startswith(report.status.sentence + "; ")
    named = [one for one in report.violations if f"; {one.family} is off by" in report.message]
    assert len(named) == 1
    unit = named[0].unit.replace(", ", " or ")
    assert f"is off by {named[0].violation:.3g} {unit}, allowed is" in report.message
    assert named[0].violation > 0


def test_a_walker_that_can_not_shorten_its_legs():
    # Shanks of 2 cm: the swing foot does not come past the stance foot.
    walker = WalkerParameters(upper_leg_length=0.98, lower_leg_length=0.02, hip_angle_limit=0.47)
    request = GaitRequest.for_step(0.9, 0.9, "none", 20)
    settings = replace(solver_settings(), maximum_iterations=60)
    outcome = optimize(request, walker, settings=settings)
    assert outcome.gait is None
    assert outcome.report.status in (Status.INFEASIBLE, Status.ITERATION_LIMIT)
    assert_names_worst_family(outcome.report)
    assert outcome.report.starts == 3


def test_a_step_longer_than_both_legs_is_out_of_reach_and_no_fault_of_the_model(walker):
    request = GaitRequest.for_step(2.2, 1.9, "none", 20)
    report = optimize(request, walker).report
    assert report.status is Status.INFEASIBLE
    assert report.message.endswith("the step is 2.2 m long, the legs reach 2 m at most")
    assert report.iterations == 0
    stiff_hips = optimize(GaitRequest.for_step(0.9, 0.9), WalkerParameters(hip_angle_limit=0.3)).report
    assert stiff_hips.status is Status.INFEASIBLE
    assert stiff_hips.message.endswith("the step is 0.9 m long, the legs reach 0.591 m at most")


def test_the_iteration_limit(walker):
    outcome = optimize(REQUEST, walker, settings=replace(solver_settings(), maximum_iterations=4))
    assert outcome.gait is None
    assert outcome.report.status is Status.ITERATION_LIMIT
    assert outcome.report.iterations == 4 * outcome.report.starts
    assert "no start came near a gait that meets all constraints" in outcome.report.message
    assert_names_worst_family(outcome.report)


def test_contact_families_that_all_fail_on_the_coarse_grid(walker, monkeypatch):
    solved = Search.with_family

    def failing(search, candidate, contacts, points, stage, options=None):
        if options is not None:  # A kinematic start.
            return solved(search, candidate, contacts, points, stage, options)
        return replace(candidate, contacts=contacts, status=Status.ITERATION_LIMIT)

    monkeypatch.setattr(Search, "with_family", failing)
    outcome = optimize(REQUEST, walker, settings=replace(solver_settings(), coarse_points=15))
    assert outcome.gait is None
    assert outcome.report.status is Status.ITERATION_LIMIT


def test_the_time_limit(walker):
    outcome = optimize(REQUEST, walker, time_limit=1e-9)
    assert outcome.gait is None
    assert outcome.report.status is Status.TIME_LIMIT
    assert outcome.report.iterations == 0
    assert_names_worst_family(outcome.report)


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan])
def test_impossible_time_limits(walker, limit):
    with pytest.raises(InvalidRequestError) as refusal:
        optimize(REQUEST, walker, time_limit=limit)
    assert str(refusal.value) == f"time limit is {limit} s, allowed is above 0"


def test_a_search_without_starts_is_refused(walker):
    with pytest.raises(InvalidRequestError, match="nothing to start from: give seeds"):
        optimize(REQUEST, walker, from_scratch=False)


def cancelled_in(stage, walker):
    return optimize(REQUEST, walker, progress=lambda progress: progress.stage != stage)


@pytest.mark.parametrize("stage", ["search", "fixed_schedule"])
def test_cancelling(stage, walker):
    outcome = cancelled_in(stage, walker)
    assert outcome.gait is None
    assert outcome.report.status is Status.CANCELLED
    assert outcome.report.message.startswith("cancelled by the caller")


@pytest.mark.parametrize("stage", ["complementarity", "refinement"])
def test_cancelling_the_last_stages(walker, stage):
    stages = []
    outcome = optimize(
        REQUEST, walker, progress=lambda progress: stages.append(progress.stage) or progress.stage != stage
    )
    assert outcome.gait is None
    assert outcome.report.status is Status.CANCELLED
    assert outcome.report.message == "cancelled by the caller"
    assert stages.count(stage) == 1
    assert stages[-1] == stage


@pytest.mark.parametrize(
    ("stage", "remark"),
    [
        ("complementarity", "search for other contacts"),
        ("refinement", "refinement"),
    ],
)
def test_a_time_limit_in_the_last_stages_leaves_the_gait_found_before(walker, monkeypatch, stage, remark):
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(session_module, "time", SimpleNamespace(monotonic=lambda: clock.now))

    def progress(state):
        # Late from the first iteration of the stage on.
        clock.now = 1e6 if state.stage == stage else 0.0
        return True

    outcome = optimize(REQUEST, walker, progress=progress)
    assert outcome.report.status is Status.SOLVED
    assert outcome.report.message.endswith(f"; the time limit cut the {remark} short")
    assert outcome.gait.report is outcome.report
    assert outcome.gait.refined is None
    assert outcome.gait.certificate.certified


def test_a_failure_of_the_solver_is_told_in_its_own_words(walker, monkeypatch):
    def failing(problem, start, options, monitor):
        return Solution(Status.SOLVER_ERROR, start, 0.0, 0.0, 0, "Internal_Error")

    monkeypatch.setattr("walk_optimizer.solve.ipopt.solve", failing)
    report = optimize(REQUEST, walker).report
    assert report.status is Status.SOLVER_ERROR
    assert "; it says Internal_Error; " in report.message


def test_progress_runs_through_the_stages_and_ends_at_the_cost_of_the_gait(walker, monkeypatch):
    # One process, whose progress is all there is to tell.
    monkeypatch.setattr(session_module, "processor_count", lambda: 1)
    told = []
    outcome = optimize(REQUEST, walker, progress=lambda progress: told.append(progress) or True)
    stages = list(dict.fromkeys(progress.stage for progress in told))
    assert stages[:3] == ["search", "fixed_schedule", "complementarity"]
    assert set(stages) <= STAGES
    elapsed = [progress.elapsed for progress in told]
    assert elapsed == sorted(elapsed)
    assert elapsed[-1] <= outcome.report.solve_time
    # F in (N m)^2, though every program is scaled in its own way.
    ends = [one.objective for one, following in pairwise(told) if following.iteration == 0]
    assert any(end == pytest.approx(outcome.gait.objective, rel=1e-5) for end in ends)
    assert outcome.report.iterations == sum(progress.iteration > 0 for progress in told)


def test_seeds_of_another_walker_do_not_spoil_the_search(plain_gait):
    lighter = WalkerParameters(hip_mass=30.0)
    outcome = optimize(
        GaitRequest.for_speed(0.42, SpringMode.NONE, 25), lighter, seeds=[plain_gait], from_scratch=False
    )
    assert outcome.gait is not None, outcome.report.message
    assert outcome.gait.walker == lighter
    assert outcome.gait.certificate.certified
