"""A step in the simulator against replay, and its linearization against differences of whole steps."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from walk_optimizer.certificate.replay import replay_step
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.ground import StepGround
from walk_optimizer.simulation.linearization import largest_multiplier


@dataclass(frozen=True)
class Playback:
    """The torques of a refined gait, to the last digit."""

    trajectory: RefinedTrajectory

    def torque(self, elapsed, state):  # noqa: ARG002
        return self.trajectory.torque(*self.trajectory.locate(elapsed))


@pytest.fixture(scope="module")
def free(loop):
    """Without knee stops, which have no derivative where the gait touches them."""
    return replace(loop, plant=loop.reference.model)


@pytest.fixture(scope="module")
def monodromy(loop):
    return loop.step.closed_loop(loop.feedback)


def test_a_step_ends_where_its_replay_does(free, gait):
    refined = gait.refined
    ground = StepGround(gait.walker.terrain, refined.step_length)
    stride = free.simulator(Playback(refined.trajectory)).run(free.start, ground)
    assert stride.ending is Ending.LANDED
    end = replay_step(gait.walker, refined.spring, refined.trajectory)[:, None]
    rates = mechanics_at(gait.walker, refined.spring, end[:6], end[6:]).qdot[2:, 0]
    np.testing.assert_allclose(stride.time[-1], refined.trajectory.step_time, atol=1e-4)
    np.testing.assert_allclose(stride.states[-1][:4], end[2:6, 0], atol=1e-3)
    np.testing.assert_allclose(stride.states[-1][4:], rates, atol=2e-2)
    np.testing.assert_allclose(stride.foot, [refined.step_length, 0.0], atol=1e-4)


def return_map_jacobian(free, change):
    """Return the derivative of the state after a step by that before, by central differences, (8, 8)."""
    ground = StepGround(free.plant.walker.terrain, free.reference.step_length)
    simulator, columns = free.simulator(), []
    for direction in change * np.eye(len(free.start)):
        ends = [
            simulator.run(start, ground).next_state
            for start in (free.start + direction, free.start - direction)
        ]
        columns.append((ends[0] - ends[1]) / (2 * change))
    return np.array(columns).T


def test_the_monodromy_matrix_is_the_derivative_of_the_return_map(free, monodromy):
    differences = return_map_jacobian(free, 1e-5)
    np.testing.assert_allclose(monodromy, differences, atol=0.02 * np.abs(monodromy).max())
    np.testing.assert_allclose(largest_multiplier(monodromy), largest_multiplier(differences), rtol=0.01)


def test_feedback_makes_an_unstable_orbit_stable(loop, monodromy):
    assert largest_multiplier(loop.step.open_loop) > 1
    assert largest_multiplier(monodromy) < 0.9


def test_what_lies_along_the_path_is_forgotten(loop, monodromy):
    """A walker that is only further on its path returns to the same state."""
    along = loop.reference.path_slopes[0][0]
    assert np.abs(monodromy @ along).max() < 1e-2 * np.abs(monodromy).max() * np.abs(along).max()
