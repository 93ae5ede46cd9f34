"""Gaits on slopes and stairs: certified on both grids, and on no other ground."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.grid import certify
from walk_optimizer.model.mechanics import foot_arm
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.optimizer import optimize
from walk_optimizer.request import GaitRequest

REQUEST = GaitRequest.for_speed(0.3185, "none", 30)


@pytest.mark.parametrize(
    "terrain", [Terrain(slope=0.0873), Terrain(slope=-0.0873), Terrain(step_up=0.03)], ids=str
)
def test_a_gait_on_a_slope_or_stairs_is_certified_on_both_grids(terrain):
    walker = WalkerParameters(terrain=terrain)
    gait = optimize(REQUEST, walker).gait
    assert gait is not None
    assert gait.certificate.certified
    assert gait.refined is not None
    assert gait.refined.certificate.certified
    end = gait.refined.trajectory.states[-1, -1][:6, None]
    x, y = foot_arm(walker, end, 1).position[:, 0]
    rise = x * np.tan(terrain.slope) + terrain.step_up
    assert y == pytest.approx(rise, abs=1e-6)
    assert x >= REQUEST.step_length - 1e-9
    if terrain.step_up:
        assert x == pytest.approx(REQUEST.step_length, abs=1e-6)
    _refuse_other_ground(gait)


def _refuse_other_ground(gait):
    """The certificate of another ground must see that the feet are not on it."""
    for other in (Terrain(), Terrain(slope=0.02), Terrain(step_up=0.01)):
        walker = replace(gait.walker, terrain=other)
        failed = certify(walker, REQUEST, gait.spring, gait.trajectory).failures()
        assert {"periodicity_velocity", "penetration", "normal_complementarity"} & {
            entry.family for entry in failed
        }
