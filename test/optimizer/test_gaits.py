"""Real searches on small grids: every speed and mode gives a certified gait, and springs do no harm."""

import itertools
import math

import numpy as np
import pytest
from optimizer.grids import GRIDS

from walk_optimizer.certificate.grid import certify
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.optimizer import optimize
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import Status

CASES = list(itertools.product(GRIDS, SpringMode))
NONE, STIFFNESS, BOTH = SpringMode


@pytest.mark.parametrize(("speed", "mode"), CASES)
def test_a_certified_gait_of_the_speed_and_mode(outcomes, walker, speed, mode):
    outcome = outcomes[speed, mode]
    gait, report = outcome.gait, outcome.report
    assert gait is not None, report.message
    assert report.status is Status.SOLVED
    assert gait.report is report
    assert gait.certificate.certified
    assert certify(walker, gait.request, gait.spring, gait.trajectory).certified
    assert gait.request == GaitRequest.for_speed(speed, mode, GRIDS[speed])
    assert gait.trajectory.points == GRIDS[speed]
    assert gait.speed == pytest.approx(speed, rel=1e-5)
    if mode is not BOTH:
        assert gait.spring.equilibrium == math.pi
    if mode is NONE:
        assert gait.spring.stiffness == 0


@pytest.mark.parametrize(("speed", "mode"), CASES)
def test_the_ground_carries_the_weight_over_a_step(outcomes, walker, speed, mode):
    # What no certificate family says: over a periodic step, impulses of gravity and ground cancel.
    reaction = outcomes[speed, mode].gait.trajectory.reaction
    assert np.mean(reaction[2] + reaction[5]) == pytest.approx(walker.weight, rel=1e-6)
    assert np.mean(reaction[[0, 3]] - reaction[[1, 4]]) == pytest.approx(0, abs=1e-6 * walker.weight)


def test_no_value_leaves_its_bounds(outcomes, walker):
    for speed, mode in CASES:
        gait = outcomes[speed, mode].gait
        assert 0 <= gait.spring.stiffness <= walker.stiffness_limit
        assert 0 <= gait.spring.equilibrium <= math.pi
        assert gait.trajectory.q[[3, 5]].max() <= math.pi
        assert gait.trajectory.reaction.min() >= 0


@pytest.mark.parametrize("speed", GRIDS)
def test_more_freedom_never_costs_torque(outcomes, speed):
    costs = [outcomes[speed, mode].gait.objective for mode in (NONE, STIFFNESS, BOTH)]
    assert costs[1] <= costs[0] * 1.001
    assert costs[2] <= costs[1] * 1.001
    assert costs[2] < 0.9 * costs[0], "a spring that may be chosen freely saves torque at every speed"


@pytest.mark.parametrize(("speed", "mode"), CASES[:3])
def test_the_report_tells_what_was_done(outcomes, walker, speed, mode):
    outcome = outcomes[speed, mode]
    gait, report = outcome.gait, outcome.report
    assert report.message == Status.SOLVED.sentence
    assert report.back_end == "ipopt"
    assert report.starts == len(kinematic_starts(walker, mode))
    assert report.iterations > report.starts
    assert report.solve_time > 0
    assert report.objective == pytest.approx(gait.objective) == np.sum(gait.trajectory.u**2) / 2
    assert report.start
    told = [(one.family, one.violation, one.unit) for one in report.violations]
    assert told == [(one.family, one.violation, one.unit) for one in gait.certificate.entries]


def test_starts_cover_soft_and_stiff_springs_and_no_two_are_alike(walker):
    for mode in SpringMode:
        starts = kinematic_starts(walker, mode)
        assert len({start.name for start in starts}) == len(starts)
        assert len({(start.shape, start.spring) for start in starts}) == len(starts)
        stiffnesses = {start.spring.stiffness for start in starts}
        if mode is NONE:
            assert stiffnesses == {0.0}
        else:
            assert min(stiffnesses) < 40
            assert max(stiffnesses) > 170


def test_a_gait_is_continued_to_a_neighbouring_speed_and_another_grid(plain_gait, walker):
    request = GaitRequest.for_speed(0.45, NONE, 30)
    outcome = optimize(request, walker, seeds=[plain_gait], from_scratch=False)
    assert outcome.gait is not None, outcome.report.message
    assert outcome.gait.certificate.certified
    assert outcome.gait.speed == pytest.approx(0.45, rel=1e-5)
    assert outcome.gait.trajectory.points == 30
    assert outcome.report.starts == 1
    assert outcome.report.start.startswith(f"continued-{plain_gait.speed:.4f}-none")


@pytest.mark.parametrize("mode", [STIFFNESS, BOTH])
def test_a_seed_with_less_freedom_is_never_made_worse(plain_gait, walker, mode):
    request = GaitRequest.for_speed(0.42, mode, 40)
    outcome = optimize(request, walker, seeds=[plain_gait], from_scratch=False)
    assert outcome.gait is not None, outcome.report.message
    assert outcome.gait.objective <= plain_gait.objective * 1.001


def test_other_optima_come_with_the_best_where_they_are_asked_for(walker):
    request = GaitRequest.for_speed(0.3185, STIFFNESS, 20)
    outcome = optimize(request, walker, refine=False, others=True)
    assert all(one.certificate.certified and one.request == request for one in outcome.others)
    objectives = [one.objective for one in (outcome.gait, *outcome.others)]
    assert len(objectives) > 1
    assert objectives == sorted(objectives)
    again = optimize(request, walker, seeds=[outcome.gait, *outcome.others], from_scratch=False, refine=False)
    assert again.gait is not None
    assert again.others == ()
