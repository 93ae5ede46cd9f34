"""What a walker may be, and what a refusal says."""

import math
from dataclasses import fields, replace

import pytest

from walk_optimizer.errors import ConfigurationError, InvalidRequestError
from walk_optimizer.model.parameters import (
    DYNAMIC_PARAMETERS,
    GROUND_PARAMETERS,
    MARGINS,
    SpringMode,
    WalkerParameters,
)
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.resources import as_float

FIELDS = [field.name for field in fields(WalkerParameters) if field.name != "terrain"]
ABOVE_ZERO = [name for name in FIELDS if name not in MARGINS]
# Beyond all floats, and beyond what Python writes.
HUGE = pytest.param(10**5000, id="huge")


@pytest.mark.parametrize("name", ABOVE_ZERO)
@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, HUGE])
def test_impossible_numbers_are_refused_by_name(name, value):
    with pytest.raises(ConfigurationError) as refusal:
        WalkerParameters(**{name: value})
    assert f"{name} is {as_float(value)}, allowed are finite numbers above 0" in str(refusal.value)


@pytest.mark.parametrize("name", MARGINS)
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf, HUGE])
def test_a_margin_is_0_or_above(name, value):
    with pytest.raises(ConfigurationError) as refusal:
        WalkerParameters(**{name: value})
    assert f"{name} is {as_float(value)}, allowed are 0 and finite numbers above" in str(refusal.value)
    assert getattr(WalkerParameters(**{name: 0}), name) == 0


def test_a_foot_can_not_always_carry_more_than_the_weight():
    with pytest.raises(ConfigurationError, match=r"stance_load is 1\.0, allowed is 0 to below 1"):
        WalkerParameters(stance_load=1.0)


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("value", ["45", None, True, [1.0]])
def test_what_is_no_number_is_refused_by_name(name, value):
    with pytest.raises(ConfigurationError) as refusal:
        WalkerParameters(**{name: value})
    assert f"{name} is {value!r}, expected a number" in str(refusal.value)


def test_a_terrain_is_one():
    with pytest.raises(ConfigurationError, match=r"terrain is \{'slope': 0\.1\}, expected a Terrain"):
        WalkerParameters(terrain={"slope": 0.1})
    with pytest.raises(ConfigurationError, match="terrain is None, expected a Terrain"):
        WalkerParameters(terrain=None)


def test_a_file_may_be_named_by_a_text(tmp_path):
    file = tmp_path / "moon.yaml"
    file.write_text("gravity: 1.62\n")
    assert WalkerParameters.from_yaml(str(file)) == WalkerParameters(gravity=1.62)


def test_hips_turn_by_half_a_turn_at_most():
    assert WalkerParameters(hip_angle_limit=math.pi).hip_angle_limit == math.pi
    with pytest.raises(ConfigurationError, match=r"hip_angle_limit is 3\.2 rad, allowed is up to pi"):
        WalkerParameters(hip_angle_limit=3.2)


def test_whole_numbers_become_floats_so_that_equal_walkers_have_equal_fingerprints():
    assert isinstance(WalkerParameters(hip_mass=45).hip_mass, float)
    assert WalkerParameters(hip_mass=45).fingerprint() == WalkerParameters().fingerprint()


@pytest.mark.parametrize("name", FIELDS)
def test_every_parameter_changes_the_fingerprint(name):
    walker = WalkerParameters()
    changed = getattr(walker, name) * 1.01 or 0.1
    assert replace(walker, **{name: changed}).fingerprint() != walker.fingerprint()


def test_gaits_keep_the_names_that_they_had_before_walkers_had_terrain_and_margins():
    assert WalkerParameters().fingerprint() == "e3fd61db33fc207d"
    assert WalkerParameters(landing_speed=-0.0, stance_load=0).fingerprint() == "e3fd61db33fc207d"


def test_the_walker_of_the_report():
    walker = WalkerParameters.from_yaml()
    assert walker == WalkerParameters()
    assert walker.total_mass == pytest.approx(75.0)
    assert walker.hip_mass == pytest.approx(0.60 * 75)
    assert walker.upper_leg_mass == pytest.approx(0.15 * 75)
    assert walker.lower_leg_mass == pytest.approx(0.05 * 75)
    assert walker.leg_length == pytest.approx(1.0)
    assert walker.weight == pytest.approx(75 * 9.81)


def test_numbers_and_symbols_stand_in_the_same_order():
    walker = WalkerParameters(hip_mass=1, upper_leg_mass=2, lower_leg_mass=3, gravity=6, upper_leg_length=4)
    names = [str(symbol) for symbol in SymbolicWalker().symbols.elements()]
    assert names == [*DYNAMIC_PARAMETERS, *GROUND_PARAMETERS]
    dynamic = [getattr(walker, name) for name in DYNAMIC_PARAMETERS]
    assert walker.vector() == [*dynamic, 0.0, 0.0, 1.0]
    inclined = replace(walker, terrain=Terrain(0.1, 0.03))
    assert inclined.vector(0.25) == [*dynamic, 0.1, 0.03, 0.25]


def yaml_file(folder, text):
    path = folder / "walker.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_entries_that_a_file_leaves_out_are_those_of_the_report(tmp_path):
    walker = WalkerParameters.from_yaml(yaml_file(tmp_path, "hip_mass: 30\nfriction_coefficient: 0.5\n"))
    assert walker == WalkerParameters(hip_mass=30.0, friction_coefficient=0.5)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("hip_mas: 30\n", "unknown walker parameter hip_mas; known are friction_coefficient, gravity"),
        ("hip_mass: heavy\n", "walker parameter hip_mass is 'heavy', expected a number"),
        ("hip_mass:\n", "walker parameter hip_mass is None, expected a number"),
        ("gravity: -9.81\n", "walker parameter gravity is -9.81, allowed are finite numbers above 0"),
        ("gravity: .nan\n", "walker parameter gravity is nan, allowed are finite numbers above 0"),
        pytest.param(
            f"gravity: 1{309 * '0'}\n", "gravity is inf, allowed are finite numbers", id="beyond floats"
        ),
        pytest.param(f"gravity: 1{5000 * '0'}\n", "not valid YAML", id="beyond what Python reads"),
        ("hip_mass: 2026-13-01\n", "not valid YAML"),
        ("", "expected `name: value` entries"),
        ("- 45.0\n", "expected `name: value` entries"),
        ("hip_mass: [\n", "not valid YAML"),
    ],
)
def test_wrong_files_are_refused(tmp_path, text, expected):
    with pytest.raises(ConfigurationError) as refusal:
        WalkerParameters.from_yaml(yaml_file(tmp_path, text))
    assert expected in str(refusal.value)


def test_a_refused_value_names_its_file(tmp_path):
    path = yaml_file(tmp_path, "gravity: -9.81\n")
    with pytest.raises(ConfigurationError) as refusal:
        WalkerParameters.from_yaml(path)
    assert str(path) in str(refusal.value)


def test_a_name_that_is_a_number_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="unknown walker parameter 7"):
        WalkerParameters.from_yaml(yaml_file(tmp_path, "7: 45.0\n"))


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "walker.yaml"
    path.write_bytes(b"\xff\xfe\x00hip_mass")
    with pytest.raises(ConfigurationError, match="not valid YAML"):
        WalkerParameters.from_yaml(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match=r"absent\.yaml: can't be read: No such file"):
        WalkerParameters.from_yaml(tmp_path / "absent.yaml")


def test_spring_modes_are_found_by_name():
    assert [SpringMode.parse(mode.value) for mode in SpringMode] == list(SpringMode)
    with pytest.raises(InvalidRequestError) as refusal:
        SpringMode.parse("springy")
    allowed = "none, stiffness, stiffness_and_equilibrium"
    assert str(refusal.value) == f"unknown spring mode 'springy'; allowed are {allowed}"
