"""The URDF is the walker: an independent rigid-body library that loads it finds the project's own model."""

import math
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml
from cli.console import walk_optimizer
from hypothesis import given
from model.states import COORDINATES, WALKERS, patient
from urdf.described_walker import DescribedWalker

from walk_optimizer.cli.main import main
from walk_optimizer.description.settings import description_settings
from walk_optimizer.description.skeleton import FEET
from walk_optimizer.description.urdf import walker_urdf
from walk_optimizer.errors import ConfigurationError
from walk_optimizer.model.functions import evaluate, mass_matrices
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.references import JOINTS
from walk_optimizer.resources import config_file

SETTINGS = description_settings()


def ball_inertia(walker):
    """What the balls add to M(q): 2/5 m r^2 times the squared turning rate of each segment, (6, 6)."""
    upper, lower = np.zeros((2, 6)), np.zeros((2, 6))
    for leg in range(2):
        upper[leg, 2 + 2 * leg] = 1
        lower[leg, [2 + 2 * leg, 3 + 2 * leg]] = 1
    moment = 2 / 5 * SETTINGS.inertia_radius**2
    return moment * (walker.upper_leg_mass * upper.T @ upper + walker.lower_leg_mass * lower.T @ lower)


@patient
@given(WALKERS, COORDINATES)
def test_mass_matrix_is_the_models_and_the_small_balls(walker, q):
    described = DescribedWalker(walker_urdf(walker, SETTINGS)).mass_matrix(q)
    expected = mass_matrices(walker, q[:, None])[0] + ball_inertia(walker)
    assert np.abs(described - expected).max() < 1e-10 * np.abs(expected).max()


def test_the_small_balls_change_less_than_a_thousandth_of_what_turns():
    walker = WalkerParameters()
    matrix = mass_matrices(walker, np.array([0, 0, 0.1, 3.0, -0.2, 2.8])[:, None])[0]
    assert np.all(np.diag(ball_inertia(walker)) < 1e-3 * np.diag(matrix))


@patient
@given(WALKERS, COORDINATES)
def test_feet_are_where_the_model_has_them(walker, q):
    described = DescribedWalker(walker_urdf(walker, SETTINGS))
    feet = evaluate("feet", walker, q[:, None], np.zeros((6, 1)))[0]
    for leg, (foot, side) in enumerate(zip(FEET, (1, -1), strict=True)):
        x, y, z = described.frame(foot, q)
        assert np.abs(np.array([x, z]) - feet[:, leg]).max() < 1e-12 * (1 + np.abs(feet).max())
        assert y == pytest.approx(side * SETTINGS.leg_spacing / 2)


def test_a_positive_hip_is_forward_and_a_knee_of_pi_is_stretched():
    described = DescribedWalker(walker_urdf(WalkerParameters(), SETTINGS))
    forward = described.frame("left_foot", np.array([0, 1.0, 0.3, np.pi, 0, np.pi]))
    assert forward[0] == pytest.approx(math.sin(0.3))
    assert forward[2] == pytest.approx(1.0 - math.cos(0.3))
    bent = described.frame("left_foot", np.array([0, 1.0, 0.0, 2.8, 0, np.pi]))
    assert bent[0] < 0, "a knee bends backwards"


def test_total_mass_and_limits():
    walker = WalkerParameters(hip_mass=40.0, hip_angle_limit=1.2)
    described = DescribedWalker(walker_urdf(walker, SETTINGS))
    assert sum(inertia.mass for inertia in described.model.inertias) == pytest.approx(walker.total_mass)
    low, high, effort, velocity = described.limits()
    assert low == pytest.approx([-1.2, 0.0] * 2)
    assert high == pytest.approx([1.2, math.pi] * 2)
    assert effort == pytest.approx([SETTINGS.effort_limit] * 4)
    assert velocity == pytest.approx([SETTINGS.velocity_limit] * 4)


def test_joints_are_those_of_the_stream_and_the_root_has_no_mass():
    robot = ET.fromstring(walker_urdf(WalkerParameters(), SETTINGS))
    revolute = [joint for joint in robot.iter("joint") if joint.get("type") == "revolute"]
    assert tuple(joint.get("name") for joint in revolute) == JOINTS
    assert robot.find("link").get("name") == "base_link"
    assert robot.find("link").find("inertial") is None


def test_springs_are_told_where_gazebo_reads_them():
    robot = ET.fromstring(walker_urdf(WalkerParameters(), SETTINGS, KneeSpring(228.5, 3.1)))
    springs = {
        element.get("reference"): [
            float(element.findtext(tag)) for tag in ("springStiffness", "springReference")
        ]
        for element in robot.iter("gazebo")
    }
    assert springs == {"left_knee": [228.5, 3.1], "right_knee": [228.5, 3.1]}
    without = ET.fromstring(walker_urdf(WalkerParameters(), SETTINGS, KneeSpring()))
    assert without.find("gazebo") is None


def values_of(element):
    """An element with numbers as numbers, and its children in the order of their kind and name."""

    def numbers(text):
        try:
            return tuple(round(float(part), 12) + 0.0 for part in text.split())
        except ValueError:
            return text

    own = {key: numbers(value) for key, value in element.attrib.items()}
    children = sorted((values_of(child) for child in element), key=repr)
    return element.tag, own, numbers((element.text or "").strip()), children


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"hip_mass": 40.0, "lower_leg_mass": 5.0, "upper_leg_length": 0.4, "hip_angle_limit": 1.1},
        {"stiffness": 228.5, "equilibrium": 3.1, "leg_spacing": 0.3},
    ],
)
def test_xacro_gives_the_same_robot(changes):
    xacro = pytest.importorskip("xacro")
    file = config_file("walker.yaml").resolve().parents[1] / "urdf" / "walker.urdf.xacro"
    files = {
        name: str(config_file(f"{name.removesuffix('_file')}.yaml"))
        for name in ("walker_file", "description_file")
    }
    mappings = files | {key: str(value) for key, value in changes.items()}
    document = xacro.process_file(str(file), mappings=mappings)
    robot = ET.fromstring(document.toxml())
    walker = {key: value for key, value in changes.items() if hasattr(WalkerParameters, key)}
    settings = type(SETTINGS)(**{key: changes.get(key, value) for key, value in vars(SETTINGS).items()})
    spring = KneeSpring(changes.get("stiffness", 0.0), changes.get("equilibrium", math.pi))
    expected = ET.fromstring(walker_urdf(WalkerParameters(**walker), settings, spring))
    assert values_of(robot) == values_of(expected)


def test_xacro_without_arguments_finds_the_packaged_parameters(monkeypatch):
    xacro = pytest.importorskip("xacro")
    file = config_file("walker.yaml").resolve().parents[1] / "urdf" / "walker.urdf.xacro"
    robot = ET.fromstring(xacro.process_file(str(file)).toxml())
    expected = ET.fromstring(walker_urdf(WalkerParameters.from_yaml(), SETTINGS))
    assert values_of(robot) == values_of(expected)


def test_command_line_writes_the_urdf_of_a_file(tmp_path):
    parameters = tmp_path / "heavy.yaml"
    parameters.write_text(yaml.safe_dump({"hip_mass": 50.0}))
    output = tmp_path / "heavy.urdf"
    done = walk_optimizer(
        "urdf", "--walker", parameters, "--stiffness", "200", "--output", output, home=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert output.read_text() == walker_urdf(WalkerParameters(hip_mass=50.0), SETTINGS, KneeSpring(200.0))
    printed = walk_optimizer("urdf", home=tmp_path)
    assert printed.stdout == walker_urdf(WalkerParameters.from_yaml(), SETTINGS)


@pytest.mark.parametrize(
    ("option", "value", "allowed"),
    [
        ("--stiffness", "-1", "0 to 2000 N m/rad"),
        ("--stiffness", "nan", "0 to 2000 N m/rad"),
        ("--stiffness", "stiff", "0 to 2000 N m/rad"),
        ("--equilibrium", "4", "0 to pi"),
    ],
)
def test_command_line_refuses_springs_that_no_walker_has(capsys, option, value, allowed):
    assert main(["urdf", option, value]) == 2
    printed = capsys.readouterr()
    assert value in printed.err
    assert allowed in printed.err
    assert printed.out == ""


def test_impossible_settings_are_refused_by_name():
    with pytest.raises(ConfigurationError, match=r"leg_spacing is -0\.2, expected a positive number"):
        type(SETTINGS)(**(vars(SETTINGS) | {"leg_spacing": -0.2}))
