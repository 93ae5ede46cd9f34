"""Every way in which a solve can end, provoked on purpose."""

import gc
import weakref
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from solve.small_programs import START, contradiction, logarithm, program, rosenbrock

from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.guess.kinematic import GuessShape, kinematic_guess
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.back_end import SolveOptions
from walk_optimizer.solve.ipopt import solve
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.problems import fixed_schedule_problem, to_scaled


def test_solved():
    solution = solve(rosenbrock(), START, SolveOptions())
    assert solution.status is Status.SOLVED
    assert solution.solved
    np.testing.assert_allclose(solution.x, [1, 1], atol=1e-6)
    assert solution.objective == pytest.approx(0, abs=1e-12)
    assert solution.infeasibility == 0
    assert solution.iterations > 0


def test_bounds_on_rows_are_kept():
    solution = solve(rosenbrock(upper_g=(1.0,)), START, SolveOptions())
    assert solution.solved
    assert solution.x.sum() == pytest.approx(1.0, abs=1e-6)


def test_infeasible():
    solution = solve(contradiction(), START, SolveOptions())
    assert solution.status is Status.INFEASIBLE
    assert not solution.solved
    assert solution.infeasibility > 0.5


def test_a_step_beyond_the_legs_is_infeasible():
    walker, request = WalkerParameters(), GaitRequest.for_speed(0.42, "none", 20)
    problem = fixed_schedule_problem(request, walker, single_impact(20))
    lower_g = problem.lower_g.copy()
    lower_g[-1] = 2.5
    start = to_scaled(walker, kinematic_guess(walker, request, GuessShape()), KneeSpring())
    solution = solve(replace(problem, lower_g=lower_g), start, SolveOptions(maximum_iterations=2000))
    assert solution.status is Status.INFEASIBLE
    assert solution.infeasibility > 0.01


def test_iteration_limit():
    solution = solve(rosenbrock(), START, SolveOptions(maximum_iterations=3))
    assert solution.status is Status.ITERATION_LIMIT
    assert solution.iterations == 3


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_first_guess_that_is_not_finite_is_an_evaluation_error(value):
    solution = solve(rosenbrock(), np.array([value, 0.0]), SolveOptions())
    assert solution.status is Status.EVALUATION_ERROR
    assert solution.detail == "the first guess is not finite"
    assert solution.iterations == 0


def test_a_model_without_a_value_at_the_start_is_an_evaluation_error():
    solution = solve(logarithm(), np.array([-1.0, 0.0]), SolveOptions())
    assert solution.status is Status.EVALUATION_ERROR


def test_an_end_that_only_the_solver_knows_is_a_solver_error_in_its_own_words():
    # More equations than variables: IPOPT refuses to begin.
    problem = program(ca.sumsqr, lambda x: ca.vertcat(x, ca.sum1(x)), [1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    solution = solve(problem, START, SolveOptions())
    assert solution.status is Status.SOLVER_ERROR
    assert solution.detail == "Not_Enough_Degrees_Of_Freedom"


def test_solutions_keep_their_bounds():
    problem = program(lambda x: x[0] - x[1], lambda x: x[0] + x[1], (-10,), (10,), (1.0, -9.0), (9.0, 2.0))
    solution = solve(problem, np.array([3.0, 0.0]), SolveOptions())
    assert solution.solved
    assert solution.x[0] >= 1.0
    assert solution.x[1] <= 2.0


@pytest.mark.parametrize("verdict", [Status.CANCELLED, Status.TIME_LIMIT])
def test_a_monitor_ends_the_solve_with_its_verdict(verdict):
    seen = []

    def monitor(state):
        seen.append(state)
        return verdict if state.iteration == 4 else None

    solution = solve(rosenbrock(), START, SolveOptions(), monitor)
    assert solution.status is verdict
    assert [state.iteration for state in seen] == [0, 1, 2, 3, 4]
    assert seen[-1].objective < seen[0].objective


def test_a_solve_does_not_remember_how_the_one_before_ended():
    problem, options = rosenbrock(), SolveOptions()
    stopped = solve(problem, START, options, lambda _: Status.CANCELLED)
    assert stopped.status is Status.CANCELLED
    first = []
    again = solve(problem, START, options, lambda state: first.append(state.iteration))
    assert again.status is Status.SOLVED
    assert first[0] == 0
    assert solve(problem, START, options).iterations == again.iterations


def test_a_warm_start_at_the_solution_takes_few_iterations():
    problem = rosenbrock(upper_g=(1.0,))
    cold = solve(problem, START, SolveOptions())
    warm = solve(problem, cold.x, SolveOptions(barrier=1e-9))
    assert warm.solved
    assert warm.iterations < cold.iterations / 2
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-6)


def test_the_infeasibility_that_is_told_is_that_of_the_bounds():
    problem, told = rosenbrock(lower_g=(3.0,)), []
    solution = solve(problem, START, SolveOptions(), lambda state: told.append(state.infeasibility))
    assert told[0] == pytest.approx(3.0 - START.sum())
    assert told[-1] < 1e-7
    assert solution.infeasibility == pytest.approx(told[-1], abs=1e-8)


def test_every_status_has_a_sentence_of_its_own():
    sentences = {status.sentence for status in Status}
    assert len(sentences) == len(Status)
    assert all(len(sentence.split()) > 2 for sentence in sentences)


def test_programs_that_nobody_needs_are_freed():
    problem = rosenbrock()
    solve(problem, START, SolveOptions())
    remembered = weakref.ref(problem.nlp)
    del problem
    gc.collect()
    assert remembered() is None
