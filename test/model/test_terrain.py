"""The ground: level, inclined, stairs; in numbers and in symbols."""

import math

import casadi as ca
import numpy as np
import pytest
import yaml

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.model import ground
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.model.terrain import Terrain

TREAD = 0.3
PLACES = np.linspace(-0.6, 0.6, 25)


def test_without_entries_the_ground_is_level():
    assert Terrain().is_flat
    np.testing.assert_array_equal(Terrain().height(PLACES, TREAD), 0.0)


def test_a_slope_rises_by_its_tangent_and_the_gap_is_measured_across_it():
    terrain = Terrain(slope=0.2)
    np.testing.assert_allclose(terrain.height(PLACES, TREAD), math.tan(0.2) * PLACES)
    along, up = np.array([math.cos(0.2), math.sin(0.2)]), np.array([-math.sin(0.2), math.cos(0.2)])
    assert terrain.gap(0.7 * along + 0.05 * up, TREAD) == pytest.approx(0.05)


def test_each_tread_lies_higher_than_the_one_before_and_is_level_in_its_middle():
    terrain = Terrain(step_up=0.04)
    rise = terrain.height(PLACES + TREAD, TREAD) - terrain.height(PLACES, TREAD)
    np.testing.assert_allclose(rise, 0.04)
    for tread in range(-2, 3):
        assert terrain.height(tread * TREAD, TREAD) == pytest.approx(tread * 0.04, abs=1e-15)
        around = terrain.height(tread * TREAD + np.array([-0.01, 0.01]), TREAD)
        np.testing.assert_allclose(around, tread * 0.04, atol=2e-5)


def test_components_along_the_ground_and_back():
    terrain, vectors = Terrain(slope=-0.3, step_up=0.1), np.random.default_rng(1).normal(size=(2, 7))
    components = terrain.along_and_normal(vectors)
    uphill = np.array([math.cos(-0.3), math.sin(-0.3)])
    np.testing.assert_allclose(components[0], uphill @ vectors)
    np.testing.assert_allclose(terrain.horizontal_and_vertical(components), vectors)


def test_symbols_and_numbers_describe_the_same_ground():
    walker, terrain = WalkerParameters(terrain=Terrain(0.15, -0.05)), Terrain(0.15, -0.05)
    symbols, point = SymbolicWalker(), ca.SX.sym("point", 2)
    along, normal = ground.along_and_normal(symbols, point)
    back = ground.horizontal_and_vertical(symbols, point[0], point[1])
    outputs = [ground.ground_height(symbols, point[0]), ground.gap(symbols, point), along, normal, back]
    function = ca.Function("ground", [point, symbols.symbols], [ca.vertcat(*outputs)])
    for place in np.random.default_rng(2).normal(size=(20, 2)):
        found = np.asarray(function(place, walker.vector(TREAD))).ravel()
        expected = [
            terrain.height(place[0], TREAD),
            terrain.gap(place, TREAD),
            *terrain.along_and_normal(place),
            *terrain.horizontal_and_vertical(place),
        ]
        np.testing.assert_allclose(found, expected, atol=1e-14)


def test_stairs_need_the_length_of_a_step():
    with pytest.raises(ConfigurationError, match="stairs need the length of a step"):
        WalkerParameters(terrain=Terrain(step_up=0.03)).vector()


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ({"slope": 1.0}, "terrain slope is 1.0 rad, allowed is -pi/4 to pi/4"),
        ({"slope": math.nan}, "terrain slope is nan, allowed are finite numbers"),
        ({"slope": -(10**400)}, "terrain slope is -inf, allowed are finite numbers"),
        ({"step_up": "3 cm"}, "terrain step_up is '3 cm', expected a number"),
        ({"step_up": True}, "terrain step_up is True, expected a number"),
        ({"step_up": 1.0}, "terrain step_up is 1.0 m, allowed is less than the leg's 1.0 m"),
        ({"stepup": 0.03}, "unknown terrain entry stepup; known are slope, step_up"),
        ([0.1], r"terrain is \[0.1\], expected entries slope, step_up"),
        (None, "terrain is None, expected entries slope, step_up"),
    ],
)
def test_impossible_ground_is_refused_by_name(tmp_path, entries, expected):
    path = tmp_path / "walker.yaml"
    path.write_text(yaml.safe_dump({"terrain": entries}), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=f"walker.yaml: {expected}"):
        WalkerParameters.from_yaml(path)


def test_a_file_describes_the_ground(tmp_path):
    path = tmp_path / "stairs.yaml"
    path.write_text("hip_mass: 30.0\nterrain:\n  step_up: 0.03\n", encoding="utf-8")
    assert WalkerParameters.from_yaml(path) == WalkerParameters(hip_mass=30.0, terrain=Terrain(0.0, 0.03))


def test_gaits_on_level_ground_keep_the_names_that_they_had_before_walkers_had_a_terrain():
    assert WalkerParameters().fingerprint().startswith("e3fd61db")
    others = [WalkerParameters(terrain=Terrain(*one)).fingerprint() for one in ((0.1, 0.0), (0.0, 0.1))]
    assert len({WalkerParameters().fingerprint(), *others}) == 3
