"""Every back end solves the same program; what can be watched can be stopped, and the rest killed."""

import multiprocessing
import os
import signal
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from solve.small_programs import START, contradiction, logarithm, rosenbrock

from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.errors import ConfigurationError, MissingDependencyError
from walk_optimizer.guess.kinematic import GuessShape, kinematic_guess
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve import fatrop, ipopt, registry, uno
from walk_optimizer.solve.back_end import SolveOptions, ended
from walk_optimizer.solve.isolation import isolated
from walk_optimizer.solve.registry import BACK_ENDS, back_end
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.problems import fixed_schedule_problem, to_scaled

WALKER = WalkerParameters()
WATCHED = [ipopt, uno]


def gait_program(mode=SpringMode.NONE, points=20):
    request = GaitRequest.for_speed(0.42, mode, points)
    guess = kinematic_guess(WALKER, request, GuessShape())
    spring = KneeSpring() if mode is SpringMode.NONE else KneeSpring(180.0)
    return fixed_schedule_problem(request, WALKER, single_impact(points)), to_scaled(WALKER, guess, spring)


@pytest.mark.parametrize("mode", [SpringMode.NONE, SpringMode.STIFFNESS])
@pytest.mark.parametrize("name", BACK_ENDS)
def test_every_back_end_finds_an_optimum_of_the_walker(name, mode):
    if name == "snopt":
        pytest.importorskip("pydrake")
    problem, start = gait_program(mode)
    best = ipopt.solve(problem, start, SolveOptions()).objective
    solution = back_end(name).solve(problem, start, SolveOptions(maximum_iterations=1000))
    assert solution.solved, solution.detail
    assert solution.infeasibility < 1e-7
    assert solution.iterations > 1
    # With springs there are several optima, and each solver has its own way.
    assert solution.objective < best * (1.001 if mode is SpringMode.NONE else 1.5)


def test_a_session_solves_with_the_back_end_of_its_settings():
    problem, start = gait_program()
    session = SolveSession(replace(solver_settings(), back_end="fatrop"), 60.0, None)
    solution = session.solve(problem, start, "search", objective_unit=1.0)
    assert solution.solved
    assert solution.detail == "return status 0", "these are fatrop's words, not IPOPT's"


def test_a_failure_within_uno_is_a_status_and_no_crash(monkeypatch):
    def broken(**_):
        raise RuntimeError("An exception was raised in the solver.")

    watcher = SimpleNamespace(begin=lambda *_: None, end=lambda: None, verdict=None, iteration=-1)
    instance = SimpleNamespace(solver=broken, watcher=watcher)
    monkeypatch.setattr(uno, "_instances", SimpleNamespace(of=lambda *_: instance))
    solution = uno.solve(rosenbrock(), START, SolveOptions())
    assert (solution.status, solution.iterations) == (Status.SOLVER_ERROR, 0)
    np.testing.assert_array_equal(solution.x, START)
    assert solution.objective == pytest.approx(24.2)


def test_what_uno_says_becomes_a_status():
    options = SolveOptions()
    assert uno.solve(rosenbrock(), START, options).status is Status.SOLVED
    assert uno.solve(contradiction(), START, options).status is Status.INFEASIBLE
    limited = uno.solve(rosenbrock(), START, SolveOptions(maximum_iterations=3))
    assert limited.status is Status.ITERATION_LIMIT
    assert uno.solve(logarithm(), np.array([np.nan, 0.0]), options).status is Status.EVALUATION_ERROR


def test_bounds_that_are_equal_are_no_variables():
    pinned = replace(rosenbrock(), lower_x=np.array([0.5, -np.inf]), upper_x=np.array([0.5, np.inf]))
    solution = uno.solve(pinned, START, SolveOptions())
    assert solution.solved
    np.testing.assert_allclose(solution.x, [0.5, 0.25], atol=1e-6)


@pytest.mark.parametrize("module", WATCHED, ids=lambda module: module.__name__.rpartition(".")[2])
def test_a_solve_that_is_watched_tells_every_iteration_and_ends_when_told(module):
    seen = []

    def monitor(state):
        seen.append(state)
        return Status.CANCELLED if len(seen) == 3 else None

    problem, start = gait_program()
    assert module.solve(problem, start, SolveOptions(), monitor).status is Status.CANCELLED
    assert len(seen) == 3
    assert all(np.isfinite(state.objective) and state.infeasibility > 0 for state in seen)


@pytest.mark.parametrize("module", WATCHED, ids=lambda module: module.__name__.rpartition(".")[2])
def test_an_error_of_the_monitor_is_its_callers(module):
    def faulty(state):
        raise ZeroDivisionError("in the caller's own code")

    with pytest.raises(ZeroDivisionError, match="caller's own code"):
        module.solve(rosenbrock(), START, SolveOptions(), faulty)


def test_a_solver_that_hangs_is_killed_when_the_monitor_says_so():
    def hang():
        while True:
            signal.pause()

    problem, asked = rosenbrock(), []

    def monitor(state):
        asked.append(state)
        return Status.TIME_LIMIT if len(asked) == 3 else None

    solution = isolated(hang, problem, START, monitor)
    assert solution.status is Status.TIME_LIMIT
    np.testing.assert_array_equal(solution.x, START)
    assert asked[0].objective == pytest.approx(24.2)
    assert not multiprocessing.active_children()


def test_a_solver_that_dies_or_raises_is_a_solver_error():
    died = isolated(lambda: os._exit(1), rosenbrock(), START, None)
    assert died.status is Status.SOLVER_ERROR
    assert died.detail == "the solver's process ended"
    raised = isolated(lambda: {}["x"], rosenbrock(), START, None)
    assert raised.status is Status.SOLVER_ERROR
    assert raised.detail == "KeyError: 'x'"


def test_what_a_child_process_finds_comes_back():
    problem = rosenbrock()
    here = ended(problem, np.ones(2), Status.SOLVED, 7, "well done")
    there = isolated(lambda: here, problem, START, lambda _: None)
    np.testing.assert_array_equal(there.x, here.x)
    assert (there.status, there.iterations, there.detail) == (Status.SOLVED, 7, "well done")
    assert there.objective == 0


def test_fatrop_refuses_a_program_without_stages():
    with pytest.raises(ConfigurationError, match="chains of stages"):
        fatrop.solve(rosenbrock(), START, SolveOptions())


def test_a_missing_library_is_found_before_any_work(monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda _: None)
    settings = replace(solver_settings(), back_end="snopt")
    with pytest.raises(MissingDependencyError) as refusal:
        SolveSession(settings, 1.0, None)
    message = str(refusal.value)
    assert message == "back end snopt needs the Python package pydrake: pip install 'walk-optimizer[snopt]'"


def test_a_build_of_casadi_without_the_solver_is_named(monkeypatch):
    monkeypatch.setattr("casadi.has_nlpsol", lambda _: False)
    with pytest.raises(MissingDependencyError, match="back end uno is not in this build of CasADi: install"):
        back_end("uno")
