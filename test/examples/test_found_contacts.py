"""Contacts of a gait on stairs, found without a schedule, and what is said about them."""

from types import SimpleNamespace

import numpy as np
import pytest

from walk_optimizer.cli.main import main
from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.examples.catalogue import NAMES, TERRAINS, solve_example
from walk_optimizer.examples.finding import Finding, runs
from walk_optimizer.examples.relaxation import best_of_ways
from walk_optimizer.examples.relaxed_solve import RelaxedSolve
from walk_optimizer.examples.terrain_gait import find_contacts, unscheduled_guess
from walk_optimizer.gait import Certificate, CertificateEntry
from walk_optimizer.guess.kinematic import GuessShape
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.status import Status

WALKER = WalkerParameters(terrain=Terrain(step_up=0.02))
REQUEST = GaitRequest(0.25, 0.785, SpringMode.NONE, 16)
SHAPE = GuessShape(0.05, 0.03)


def test_the_guess_does_not_say_which_foot_stands():
    loads = unscheduled_guess(WALKER, REQUEST, SHAPE)[[17, 20]]
    np.testing.assert_array_equal(loads, WALKER.weight / 2)


def test_on_stairs_contacts_are_found_and_certified():
    gait = find_contacts(WALKER, REQUEST, SHAPE, SolveSession(solver_settings(), 300.0, None))
    assert gait.finding.certificate.certified
    standing = gait.finding.schedule != FootMode.FREE
    assert standing.any(axis=1).any()
    assert not standing.all(), "a foot must leave the ground to climb"


def test_runs_of_contacts_are_told_with_their_times():
    modes = np.array([0, 0, 1, 1, 2], dtype=np.int8)
    assert runs(modes) == [(0, 2, FootMode.FREE), (2, 4, FootMode.STICK), (4, 5, FootMode.SLIP_FORWARD)]
    solves = (RelaxedSolve(0.1, Status.SOLVED, 7, 1.0), RelaxedSolve(1e-8, Status.ITERATION_LIMIT, 5, 2.0))
    finding = Finding("A test", ("foot",), modes[None], 0.1, 2.5, solves, 1.0, Certificate(()))
    assert finding.lines() == [
        "A test",
        "  foot: free 0.00-0.20, sticks 0.20-0.40, slips forward 0.40-0.50 s",
        "  torque effort 2.5 (N m)^2 s, 12 iterations, 1.0 s",
        "  iterations by bound on the products: 0.1: 7 (solved), 1e-08: 5 (iteration_limit)",
    ]


def test_of_all_ways_the_one_of_least_effort_that_is_certified_is_kept():
    ends = [(1.0, 2e-3), (4.0, 0.0), (3.0, 0.0), (2.0, 2e-3)]
    tried = []

    def found(way):
        effort, residual = ends[len(tried)]
        tried.append(way)
        certificate = Certificate((CertificateEntry("dynamics", residual, "N", 1e-3),))
        nothing = np.zeros((0, 0), dtype=np.int8)
        return SimpleNamespace(finding=Finding("", (), nothing, 0.1, effort, (), 1.0, certificate))

    assert best_of_ways(found).finding.effort == 3.0
    assert len({(way.relaxations[0], way.barrier) for way in tried}) == len(ends)


@pytest.mark.parametrize("name", TERRAINS)
def test_on_every_terrain_it_is_the_walker_of_the_parameter_file(name, tmp_path, monkeypatch):
    edited = tmp_path / "walker.yaml"
    edited.write_text("hip_mass: 30.0\n")
    monkeypatch.setattr("walk_optimizer.model.parameters.config_file", lambda _: edited)
    walkers = []

    def find(walker, *_):
        walkers.append(walker)
        return SimpleNamespace(finding=None)

    monkeypatch.setattr("walk_optimizer.examples.catalogue.find_contacts", find)
    solve_example(name)
    assert walkers == [WalkerParameters(hip_mass=30.0, terrain=TERRAINS[name])]


def test_an_example_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(InvalidRequestError, match=", ".join(NAMES)):
        solve_example("hopping")


def test_a_solve_that_is_cut_short_is_no_success(capsys):
    assert main(["example", "standing-start", "--time-limit", "0.01"]) == 1
    assert "time_limit" in capsys.readouterr().out
