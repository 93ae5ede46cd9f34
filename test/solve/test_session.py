"""The common clock, cancelling and progress of all solves of a request."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from solve.small_programs import START, rosenbrock

from walk_optimizer.solve import session as session_module
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.status import Progress, Status


@pytest.fixture
def clock(monkeypatch):
    """A clock that moves by one second each time it is read."""
    state = SimpleNamespace(now=100.0)

    def read():
        state.now += 1.0
        return state.now

    monkeypatch.setattr(session_module, "time", SimpleNamespace(monotonic=read))
    return state


def run(session, stage="search", problem=None, **options):
    return session.solve(problem or rosenbrock(), START, stage, objective_unit=50.0, **options)


def test_progress_tells_stage_iteration_objective_infeasibility_and_time(clock):
    told = []
    session = SolveSession(solver_settings(), 1e6, lambda progress: told.append(progress) or True)
    first = run(session, "search")
    second = run(session, "polish", rosenbrock(lower_g=(3.0,)))
    assert first.solved
    assert second.solved
    assert all(isinstance(progress, Progress) for progress in told)
    assert [one.stage for one in told] == ["search"] * (first.iterations + 1) + ["polish"] * (
        second.iterations + 1
    )
    iterations = [*range(first.iterations + 1), *range(second.iterations + 1)]
    assert [one.iteration for one in told] == iterations
    # Rosenbrock's function at the start is 24.2, in units of 50 (N m)^2.
    assert told[0].objective == pytest.approx(50 * 24.2)
    assert told[first.iterations + 1].infeasibility == pytest.approx(3.2)
    elapsed = [one.elapsed for one in told]
    assert elapsed[0] > 0
    assert (np.diff(elapsed) > 0).all()
    assert session.iterations == first.iterations + second.iterations
    assert session.verdict is None
    assert not session.stopped


@pytest.mark.parametrize("kind", [bool, np.bool_])
def test_a_callback_that_returns_false_cancels_this_and_every_further_solve(kind):
    told = []

    def cancel_at_the_third(progress):
        told.append(progress.iteration)
        return kind(len(told) < 3)

    session = SolveSession(solver_settings(), 1e6, cancel_at_the_third)
    assert run(session).status is Status.CANCELLED
    assert session.verdict is Status.CANCELLED
    assert session.stopped
    later = run(session)
    assert later.status is Status.CANCELLED
    assert later.iterations == 0
    assert told == [0, 1, 2], "nobody is asked again after having cancelled"


def test_a_callback_that_returns_nothing_only_watches():
    told = []
    session = SolveSession(solver_settings(), 1e6, told.append)
    assert run(session).solved
    assert session.verdict is None
    assert len(told) > 1


def test_the_time_limit_counts_over_all_solves(clock):
    session = SolveSession(solver_settings(), 30.0, None)
    assert run(session).solved
    assert run(session).status is Status.TIME_LIMIT
    assert session.verdict is Status.TIME_LIMIT
    late = run(session)
    assert late.status is Status.TIME_LIMIT
    assert late.iterations == 0


def test_settings_reach_the_solver():
    session = SolveSession(replace(solver_settings(), maximum_iterations=2), 1e6, None)
    solution = run(session)
    assert solution.status is Status.ITERATION_LIMIT
    assert solution.iterations == 2


def test_an_error_in_a_callback_is_its_callers():
    def faulty(progress):
        raise ZeroDivisionError("in the caller's own code")

    with pytest.raises(ZeroDivisionError, match="caller's own code"):
        run(SolveSession(solver_settings(), 1e6, faulty))
