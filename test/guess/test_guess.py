"""First guesses put the feet where they shall be, whatever the proportions of the legs."""

import numpy as np
import pytest

from walk_optimizer.guess.kinematic import GuessShape, kinematic_guess
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import layout


@pytest.mark.parametrize(("thigh", "shank"), [(0.5, 0.5), (0.3, 0.7), (0.7, 0.3), (0.2, 0.8)])
@pytest.mark.parametrize("shape", [GuessShape(0.05, 0.03), GuessShape(0.35, 0.03)])
def test_feet_are_where_their_paths_are(thigh, shank, shape):
    walker = WalkerParameters(upper_leg_length=thigh, lower_leg_length=shank)
    request = GaitRequest.for_speed(0.42, "none", 40)
    q = kinematic_guess(walker, request, shape)[layout.Q]
    feet = evaluate("feet", walker, q, np.zeros_like(q))
    np.testing.assert_allclose(feet[:, :, 0], 0.0, atol=1e-5)
    phase = np.arange(1, 41) / 40
    np.testing.assert_allclose(feet[:, 1, 1], shape.clearance * np.sin(np.pi * phase) ** 2, atol=1e-5)
    assert feet[-1, 0, 1] == pytest.approx(request.step_length, abs=1e-5)


@pytest.mark.parametrize(
    "terrain", [Terrain(0.1, 0.0), Terrain(-0.1, 0.0), Terrain(0.0, 0.04), Terrain(0.05, -0.03)]
)
def test_on_a_slope_or_stairs_the_swing_foot_lands_on_the_ground(terrain):
    walker = WalkerParameters(terrain=terrain)
    request = GaitRequest.for_speed(0.42, "none", 40)
    q = kinematic_guess(walker, request, GuessShape())[layout.Q]
    feet = evaluate("feet", walker, q, np.zeros_like(q))
    np.testing.assert_allclose(feet[:, :, 0], 0.0, atol=1e-5)
    length = request.step_length
    rise = length * np.tan(terrain.slope) + terrain.step_up
    np.testing.assert_allclose(feet[-1, :, 1], [length, rise], atol=1e-5)


def test_a_step_of_two_stretched_legs_has_a_finite_guess():
    points = kinematic_guess(WalkerParameters(), GaitRequest.for_step(2.0, 1.9, "none", 20), GuessShape())
    assert np.isfinite(points).all()
