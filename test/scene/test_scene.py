import math

import numpy as np
import pytest

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.references import JOINTS
from walk_optimizer.scene.scene import WalkScene

STRIDING = np.array([0.2, math.pi, -0.2, math.pi])


def shown(walker, position=STRIDING, effort=None):
    scene = WalkScene(walker, 1.0, 0.1)
    return scene.show(0.0, scene.move(position), effort)


def test_level_ground_is_a_line_below_the_feet():
    scene = shown(WalkerParameters())
    assert scene.ground[1] == pytest.approx([0.0, 0.0])
    assert (
        scene.ground[0, 0] < scene.pose.feet[:, 0].min() < scene.pose.feet[:, 0].max() < scene.ground[0, -1]
    )


def test_a_slope_and_stairs_are_those_of_the_terrain():
    sloped = shown(WalkerParameters(terrain=Terrain(slope=0.1)))
    assert sloped.ground[1] == pytest.approx(math.tan(0.1) * sloped.ground[0])
    stairs = shown(WalkerParameters(terrain=Terrain(step_up=0.05)))
    rise = np.interp([0.0, 1.0], *stairs.ground)
    assert rise == pytest.approx([0.0, 0.05], abs=1e-3), "a tread is a leg long while no gait tells its steps"
    assert np.ptp(np.diff(stairs.ground[1])) > 1e-3, "stairs are not straight"


def test_a_walk_without_a_gait_climbs_its_slope():
    slope = 0.1
    scene = WalkScene(WalkerParameters(terrain=Terrain(slope=slope)), 1.0, 0.1)
    feet = []
    # Stretched legs swing like scissors, so the foot that lands is uphill of the one that stood.
    for time in np.arange(0.0, 4.0, 0.01):
        angle = slope + 0.3 * math.cos(math.pi * time)
        pose = scene.move(np.array([angle, math.pi, 2 * slope - angle, math.pi]))
        feet.append(pose.feet[pose.stance])
    x, y = np.array(feet).T
    assert y == pytest.approx(math.tan(slope) * x, abs=1e-9)
    assert np.diff(x).min() > -1e-9
    # Four steps; the scissors are tilted by the slope.
    assert x[-1] == pytest.approx(4 * 2 * math.sin(0.3) * math.cos(slope), rel=0.05)


def test_nothing_is_told_of_forces_and_the_step_ahead_while_no_gait_is_known():
    scene = shown(WalkerParameters())
    assert not scene.reaction.any()
    assert scene.torques == []
    assert all(path.size == 0 for path in scene.ahead)
    assert [path.shape for path in scene.walked] == [(2, 1), (2, 1)]


def test_arcs_of_torques_begin_at_the_driven_segment_and_turn_where_it_is_driven():
    bent = np.array([0.4, math.pi - 0.5, 0.0, math.pi])
    scene = shown(WalkerParameters(), bent, np.array([3.0, -3.0, 0.0, 90.0]))
    assert tuple(arc.joint for arc in scene.torques) == JOINTS
    # Of the segment that each joint drives, from the downward vertical.
    segments = [0.4, -0.1, 0.0, 0.0]
    for arc, segment, sweep in zip(scene.torques, segments, [0.3, -0.3, 0.0, 5.5], strict=True):
        radii = arc.points[:, :16] - arc.centre[:, None]
        angles = np.unwrap(np.arctan2(radii[0], -radii[1]))
        assert angles[0] == pytest.approx(segment)
        assert angles[-1] - angles[0] == pytest.approx(sweep), "a sweep stays below a turn"
    knee = scene.pose.base + 0.5 * np.array([math.sin(0.4), -math.cos(0.4)])
    assert scene.torques[1].centre == pytest.approx(knee)
