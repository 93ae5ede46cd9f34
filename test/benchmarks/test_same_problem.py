"""What the benchmarks compare with solves the same problem, judged by the same certificate."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.grid import certify
from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.gait import Certificate, RefinedGait, Trajectory
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer.search import Search
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings

WALKER = WalkerParameters()
REQUEST = GaitRequest.for_step(0.25, 0.785, SpringMode.NONE, 20)
START = kinematic_starts(WALKER, REQUEST.spring_mode)[0]


@pytest.fixture(scope="module")
def ours():
    settings = solver_settings()
    session = SolveSession(settings, settings.time_limit, None)
    return Search(REQUEST, WALKER, session, settings.relaxation).from_start(START, REQUEST.points)


@pytest.fixture(scope="module")
def plain():
    from plain_transcription import FixedSchedule, kinematic_points

    return FixedSchedule(REQUEST, WALKER).solve(kinematic_points(REQUEST, WALKER, START))


def residuals(solution):
    trajectory = Trajectory.from_stacked(solution.points, REQUEST.step_time)
    return certify(WALKER, REQUEST, solution.spring, trajectory)


def test_plain_transcription_finds_the_same_optimum_from_the_same_start(ours, plain):
    assert ours.solved
    assert plain.solved
    assert plain.objective == pytest.approx(ours.objective, rel=1e-6)
    assert residuals(plain).certified


def test_plain_relaxation_is_certified_and_no_worse(plain):
    from plain_transcription import with_free_contacts

    relaxed = with_free_contacts(REQUEST, WALKER, plain)
    assert relaxed.objective <= plain.objective
    assert relaxed.iterations > plain.iterations
    assert residuals(relaxed).certified


def test_peers_get_bounds_that_our_solution_meets_and_its_objective(ours):
    import casadi as ca
    from peer_problem import PeerProblem

    problem = PeerProblem(REQUEST, WALKER)
    units = problem._point_units()[:, None]
    spring = [ours.spring.stiffness / problem.units.stiffness, ours.spring.equilibrium]
    x = np.append((ours.points / units).ravel(order="F"), spring)
    f, g = (one.full().ravel() for one in ca.Function("values", [problem.x], [problem.f, problem.g])(x))
    unit = problem.units.torque**2 / REQUEST.interval
    assert f[0] * unit == pytest.approx(ours.objective, rel=1e-9)
    for bounds in (problem.given_contacts(), problem.free_contacts(1e-8)):
        rows = np.max([bounds.lower_g - g, g - bounds.upper_g])
        # Given contacts leave gamma of the swinging foot at 0, which plays no part there.
        high = np.where(bounds.upper_x == 0.0, np.inf, bounds.upper_x)
        variables = np.max([bounds.lower_x - x, x - high])
        assert rows < 1e-6
        assert variables < 1e-6


def test_plain_collocation_continues_a_gait_of_the_table_with_a_certificate():
    from measurements import library_gait
    from plain_refined import PlainRefined, phases_of

    gait = library_gait(GaitRequest.for_step(0.25, 0.785, SpringMode.NONE))
    assert gait.refined is not None
    problem = PlainRefined(SpringMode.NONE, WALKER, phases_of(gait.refined.trajectory))
    found = problem.solve(gait.refined, 0.25, 0.785)
    assert found.status == "Solve_Succeeded"
    assert found.trajectory.torque_effort == pytest.approx(gait.refined.trajectory.torque_effort, rel=1e-6)
    refined = RefinedGait(found.trajectory, found.spring, gait.refined.step_length, Certificate(()))
    assert certify_refined(WALKER, gait.request, refined).certified


@pytest.mark.parametrize("free_contacts", [False, True])
def test_both_sides_of_a_comparison_end_with_certified_gaits_of_one_effort(free_contacts):
    from measurements import ours_one_start, plain_one_start

    scores = [one(REQUEST, free_contacts) for one in (ours_one_start, plain_one_start)]
    assert all(score.certified and score.seconds > 0 and score.iterations > 0 for score in scores)
    # The bound on the products leaves plain a little below.
    assert scores[1].objective == pytest.approx(scores[0].objective, rel=1e-3)


def test_a_new_speed_is_solved_from_a_gait_of_the_table():
    from measurements import library_gait, resolved

    neighbour = library_gait(GaitRequest.for_step(0.25, 0.785, SpringMode.NONE))
    refined = resolved(GaitRequest.for_speed(0.325, SpringMode.NONE, 20), neighbour)
    assert refined.certificate.certified


def test_a_broken_solution_scores_as_no_gait(plain):
    from measurements import score_points

    broken = replace(plain, points=plain.points * 1.001)
    score = score_points((1.0, 1.0), REQUEST, broken.points, broken.spring, "Solve_Succeeded", 7)
    assert not score.certified
    assert score.residual > 1
