"""A gait on slippery ground: its foot slips in mid-stance, and the refinement follows the slip."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.certificate.replay import contact_modes
from walk_optimizer.contact.observation import schedule_of
from walk_optimizer.contact.schedule import FootMode, single_impact
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.refinement.first_guess import FirstGuess
from walk_optimizer.refinement.solves import RefinedSolves
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.transcription.mesh import even_mesh
from walk_optimizer.transcription.phases import phases_of, with_steady_end, without_brief_modes

REQUEST = GaitRequest.for_speed(0.3185, "none", 60)


@pytest.fixture(scope="module")
def slippery():
    gait = optimize(REQUEST, WalkerParameters(friction_coefficient=0.05)).gait
    assert gait is not None
    assert gait.refined is not None
    return gait


def test_its_stance_foot_slips_forward_on_both_grids(slippery):
    trajectory, refined = slippery.trajectory, slippery.refined
    parts = (trajectory.q, trajectory.p, trajectory.reaction)
    schedule = schedule_of(slippery.walker, REQUEST.step_length, *parts)
    assert FootMode.SLIP_FORWARD in schedule[0]
    modes = [first for first, _ in contact_modes(slippery.walker, refined.spring, refined.trajectory)]
    order = [mode for index, mode in enumerate(modes) if index == 0 or mode is not modes[index - 1]]
    assert order == [FootMode.STICK, FootMode.SLIP_FORWARD, FootMode.STICK]


def test_the_slip_is_certified_by_the_law_of_friction(slippery):
    certificate = slippery.refined.certificate
    assert certificate.certified
    assert "slip_friction" in {entry.family for entry in certificate.entries}


def test_following_the_slip_needs_less_torque_than_single_support(slippery):
    solves = RefinedSolves(REQUEST, slippery.walker, SolveSession(solver_settings(), 300.0, None))
    mesh = even_mesh([phases_of(single_impact(REQUEST.points))], fewest=3)
    plain = solves.solved(mesh, FirstGuess(slippery).points(mesh))
    assert slippery.refined.trajectory.torque_effort < 0.9 * plain.effort


def test_friction_that_does_not_oppose_the_slip_fully_is_found(slippery):
    refined = slippery.refined
    modes = contact_modes(slippery.walker, refined.spring, refined.trajectory)
    slips = [first.slips for first, _ in modes]
    forces = refined.trajectory.forces.copy()
    forces[np.flatnonzero(slips), :, 0] *= 0.99
    broken = replace(refined, trajectory=replace(refined.trajectory, forces=forces))
    certificate = certify_refined(slippery.walker, REQUEST, broken)
    assert "slip_friction" in {entry.family for entry in certificate.failures()}


def test_what_a_foot_does_briefly_counts_as_before():
    free, stick, slip = FootMode.FREE, FootMode.STICK, FootMode.SLIP_BACKWARD
    schedule = np.array([[stick] * 8 + [slip] * 2, [stick] + [free] * 4 + [slip] + [free] * 4], dtype=np.int8)
    expected = [[stick] * 10, [stick] + [free] * 9]
    np.testing.assert_array_equal(without_brief_modes(schedule), expected)
    np.testing.assert_array_equal(with_steady_end(schedule), [expected[0], schedule[1]])
