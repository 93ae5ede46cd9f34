"""Condensed solves find what IPOPT finds on the same mesh, and give up where they don't."""

from dataclasses import replace

import numpy as np
import pytest
from condensed.conftest import needs_compiler, start_of

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.condensed import interior_point, solve
from walk_optimizer.condensed.solve import solve_condensed
from walk_optimizer.gait import Certificate, RefinedGait
from walk_optimizer.model.mechanics import foot_2_ahead
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.optimizer import optimize
from walk_optimizer.refinement.mesh_adaptation import resampled, torque_saved, trajectory_on
from walk_optimizer.refinement.resolve import resolve
from walk_optimizer.refinement.solves import RefinedSolves
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.mesh import even_mesh

TOLERANCE = 1e-9


def session():
    return SolveSession(solver_settings(), 300.0, None)


def go_on(state):
    return None


def condensed(start, request, walker=None, monitor=go_on):
    lengths = start.mesh.lengths(np.array([request.step_time]))
    return solve_condensed(request, walker or start.gait.walker, lengths, start.points, TOLERANCE, monitor)


def certificate_of(walker, request, start, points):
    trajectory = trajectory_on(start.mesh, points)
    length = foot_2_ahead(walker, trajectory.states[-1, -1])
    bare = RefinedGait(trajectory, points.spring, length, Certificate(()))
    return certify_refined(walker, request, bare)


@needs_compiler
def test_the_solution_is_ipopts(start):
    speed = 1.01 * start.gait.request.speed
    request = GaitRequest.for_speed(speed, start.gait.request.spring_mode)
    ours = condensed(start, request)
    assert ours.status is Status.SOLVED
    durations = np.array([request.step_time])
    theirs = RefinedSolves(request, start.gait.walker, session()).solved(
        start.mesh, replace(ours.points, durations=durations)
    )
    trajectory = trajectory_on(start.mesh, ours.points)
    assert trajectory.torque_effort == pytest.approx(theirs.effort, rel=1e-5)
    np.testing.assert_allclose(trajectory.states[:, :, :6], theirs.trajectory.states[:, :, :6], atol=2e-4)
    assert ours.points.spring.stiffness == pytest.approx(theirs.spring.stiffness, rel=1e-3, abs=1e-6)
    assert ours.points.spring.equilibrium == pytest.approx(theirs.spring.equilibrium, abs=1e-3)


@needs_compiler
@pytest.mark.parametrize("margin", ["landing_speed", "stance_load"])
def test_margins_are_kept(library, margin):
    start = start_of(library, 0.53, "stiffness")
    walker = replace(start.gait.walker, **{margin: {"landing_speed": 0.3, "stance_load": 0.7}[margin]})
    kept = {}
    for asked in (start.gait.walker, walker):
        found = condensed(start, start.gait.request, asked)
        assert found.status is Status.SOLVED
        entries = certificate_of(walker, start.gait.request, start, found.points).entries
        # The mesh is that of the other gait: between its nodes, and when replayed, more is lost.
        broken = [one for one in entries if not one.violation <= one.tolerance]
        kept[asked] = {one.family for one in broken} - {"joint_limits_between", "interval_replay"}
    assert kept == {start.gait.walker: {margin}, walker: set()}


@needs_compiler
def test_the_forward_momentum_stays_positive_where_it_would_not():
    """In a long, slow step the walker would like to wait for the swing leg."""
    outcome = optimize(GaitRequest.for_step(0.5, 2.4, "none", 40), WalkerParameters.from_yaml())
    momentum = outcome.gait.refined.trajectory.states[:, 1:, 6]
    assert np.count_nonzero(momentum < 1e-2) > 3, "the bound is not reached"
    assert momentum.min() > -1e-5


@needs_compiler
def test_what_it_tells_is_true_and_it_ends_when_told_to(start):
    told = []

    def monitor(state):
        told.append(state)
        return Status.CANCELLED if state.iteration == 3 else None

    request = GaitRequest.for_speed(1.02 * start.gait.request.speed, start.gait.request.spring_mode)
    found = condensed(start, request, monitor=monitor)
    assert found.status is Status.CANCELLED
    assert found.points is None
    assert [state.iteration for state in told] == [0, 1, 2, 3]
    assert all(state.objective > 0 for state in told)
    assert told[3].infeasibility < told[0].infeasibility
    told.clear()
    found = condensed(start, request, monitor=told.append)
    assert [state.iteration for state in told] == [*range(found.iterations + 1)]
    assert told[-1].infeasibility < TOLERANCE


@needs_compiler
def test_values_that_are_no_numbers_end_it(start):
    points = replace(start.points, states=np.full_like(start.points.states, np.nan))
    found = condensed(replace(start, points=points), start.gait.request)
    assert found.status is Status.EVALUATION_ERROR
    assert found.points is None


@pytest.fixture
def by_ipopt(monkeypatch):
    """Which meshes IPOPT solves on."""
    meshes, original = [], RefinedSolves.solved

    def counted(self, mesh, *arguments):
        meshes.append(mesh)
        return original(self, mesh, *arguments)

    monkeypatch.setattr(RefinedSolves, "solved", counted)
    return meshes


@pytest.mark.parametrize("lost", ["iterations", "compiler"])
def test_ipopt_takes_over_where_it_does_not_come_to_an_end(monkeypatch, library, by_ipopt, lost):
    if lost == "iterations":
        monkeypatch.setattr(interior_point, "_MOST_ITERATIONS", 2)
    else:
        monkeypatch.setattr(solve, "kernel", lambda: None)
    start = start_of(library, 0.53, "none")
    gait = resolve(GaitRequest.for_speed(0.54, "none"), [start.gait], session())
    assert gait.certificate.certified
    assert by_ipopt


@needs_compiler
def test_ipopt_does_not_take_over_from_a_solve_that_was_cancelled(library, by_ipopt):
    start = start_of(library, 0.53, "stiffness")
    told = []

    def progress(one):
        told.append(one)
        return len(told) < 3

    asked = SolveSession(solver_settings(), 300.0, progress)
    assert resolve(GaitRequest.for_speed(0.54, "stiffness"), [start.gait], asked) is None
    assert asked.verdict is Status.CANCELLED
    assert len(told) == 3
    assert not by_ipopt


@needs_compiler
@pytest.mark.parametrize(
    ("mode", "wanted"),
    [
        ("stiffness_and_equilibrium", "none"),
        ("stiffness_and_equilibrium", "stiffness"),
        ("stiffness", "none"),
    ],
)
def test_springs_that_a_mode_fixes_are_at_their_values(library, mode, wanted):
    """A neighbour with richer springs is a start for a mode that does not have them."""
    start = start_of(library, 0.53, mode)
    found = condensed(start, GaitRequest.for_speed(0.54, wanted))
    if found.points is not None:
        assert found.points.spring.equilibrium == pytest.approx(np.pi, abs=1e-12)
        assert found.points.spring.stiffness == 0.0 or wanted == "stiffness"
    gait = resolve(GaitRequest.for_speed(0.54, wanted), [start.gait], session())
    assert gait.certificate.certified


@needs_compiler
@pytest.mark.parametrize(
    "change",
    [{"friction_coefficient": 0.12}, {"terrain": Terrain(slope=-0.01)}, {"terrain": Terrain(step_up=0.005)}],
    ids=["slippery", "downhill", "upstairs"],
)
def test_other_walkers_get_ipopts_solution_too(library, change):
    start = start_of(library, 0.53, "stiffness")
    walker, request = replace(start.gait.walker, **change), start.gait.request
    found = condensed(start, request, walker)
    assert found.status is Status.SOLVED
    theirs = RefinedSolves(request, walker, session()).solved(start.mesh, found.points)
    effort = trajectory_on(start.mesh, found.points).torque_effort
    assert effort == pytest.approx(theirs.effort, rel=1e-4)
    assert effort != pytest.approx(start.gait.refined.trajectory.torque_effort, rel=1e-3), "nothing changes"
    entries = certificate_of(walker, request, start, found.points).entries
    broken = {entry.family for entry in entries if not entry.violation <= entry.tolerance}
    assert not broken & {"friction_cone", "impact_cone", "impact", "landing", "tread", "penetration"}


@needs_compiler
@pytest.mark.parametrize("speed", [0.235, 0.32, 0.53])
def test_prices_tell_what_leaving_bounds_between_the_nodes_saves(library, speed):
    start = start_of(library, speed, "none")
    gait, fine = start.gait, start.gait.refined
    coarse = even_mesh([start.mesh.phases], 3)
    points = resampled(fine.trajectory, fine.spring, start.mesh, coarse)
    found = condensed(replace(start, mesh=coarse, points=points), gait.request)
    trajectory = trajectory_on(coarse, found.points)
    saved = torque_saved(gait.walker, gait.request.step_length, trajectory, found.prices)
    actual = 1 - trajectory.torque_effort / fine.trajectory.torque_effort
    assert actual > 5e-5, "the mesh is too fine for this test"
    assert saved == pytest.approx(actual, rel=0.5)


def test_another_back_end_is_not_bypassed(monkeypatch, library):
    monkeypatch.setattr("walk_optimizer.refinement.solves.solve_condensed", lambda *_: pytest.fail("it was"))
    monkeypatch.setattr(RefinedSolves, "solved", lambda _, mesh, points: (mesh, points))
    settings = replace(solver_settings(), back_end="uno")
    start = start_of(library, 0.53, "none")
    solves = RefinedSolves(start.gait.request, start.gait.walker, SolveSession(settings, 300.0, None))
    assert solves.solved_nearby(start.mesh, start.points) == (start.mesh, start.points)
