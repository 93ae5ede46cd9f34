"""The ros2_control files name parameters that the controllers have, and take what the publisher sends."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

pytest.importorskip("rclpy")

from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.nodes.cycle_message import CycleMessages, cycle_to_message
from walk_optimizer.references import JOINTS, sample_cycle
from walk_optimizer.references.profile import profile_of
from walk_optimizer.resources import config_file

KNOWN = yaml.safe_load((Path(__file__).parent / "ros2_control_parameters.yaml").read_text())
FILES = ["ros2_control_joint_trajectory.yaml", "ros2_control_forward_command.yaml"]
TYPES = {
    "string_array": list,
    "string": str,
    "double": float,
    "bool": bool,
    "int": int,
}


def entries(file):
    """Return the parameters of each node of a file."""
    content = yaml.safe_load(config_file(file).read_text())
    assert all(name.startswith("/**/") for name in content)
    return {name.removeprefix("/**/"): node["ros__parameters"] for name, node in content.items()}


def flat(parameters, prefix=""):
    for name, value in parameters.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def generic(name):
    """Return a parameter's name as the controller declares it."""
    return ".".join("__map_joints" if part in JOINTS else part for part in name.split("."))


@pytest.mark.parametrize("file", FILES)
def test_every_parameter_is_one_of_the_controller_and_of_its_type(file):
    nodes = entries(file)
    manager = nodes.pop("controller_manager")
    types = {name: value["type"] for name, value in manager.items() if isinstance(value, dict)}
    assert set(types) == {*nodes, "joint_state_broadcaster"}
    assert {name for name in manager if name not in types} <= KNOWN["controller_manager"].keys()
    for name, parameters in nodes.items():
        known = KNOWN[types[name].split("/")[0]]
        for parameter, value in flat(parameters):
            assert generic(parameter) in known, f"{name} has no parameter {parameter}"
            assert isinstance(value, TYPES[known[generic(parameter)]]), f"{name}: {parameter} is {value!r}"
        assert parameters["joints"] == list(JOINTS)


def test_the_interfaces_go_together():
    """validate_jtc_parameters.hpp: effort alone or with position; velocity is no state without position."""
    controller = entries(FILES[0])["walker_trajectory_controller"]
    assert controller["command_interfaces"] in (["effort"], ["position", "effort"])
    assert controller["state_interfaces"] == ["position", "velocity"]
    # JointTrajectoryController::on_configure ignores a cmd_timeout that is not above goal_time.
    assert controller["cmd_timeout"] > controller["constraints"]["goal_time"]


def refusals(trajectory, controller):
    """Why JointTrajectoryController::validate_trajectory_msg would refuse a trajectory."""
    points, count = trajectory.points, len(controller["joints"])
    times = [point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 for point in points]
    rules = {
        "joints": sorted(trajectory.joint_names) == sorted(controller["joints"]),
        "last velocity": max(map(abs, points[-1].velocities)) <= np.finfo(np.float32).eps,
        "stamp": (trajectory.header.stamp.sec, trajectory.header.stamp.nanosec) == (0, 0),
        "times": bool(np.all(np.diff(times) > 0)),
        "sizes": all(len(point.positions) == len(point.velocities) == count for point in points),
        "effort": "effort" in controller["command_interfaces"] or not any(p.effort for p in points),
    }
    return [rule for rule, met in rules.items() if not met]


@pytest.mark.parametrize("order", [JOINTS, JOINTS[::-1]])
def test_the_trajectory_is_one_that_the_controller_takes(order):
    controller = entries(FILES[0])["walker_trajectory_controller"]
    cycle = sample_cycle(profile_of(with_refinement(made_up_gait())), 1000.0)
    assert refusals(cycle_to_message(cycle, order), controller) == []
    position_only = controller | {"command_interfaces": ["position"]}
    assert refusals(cycle_to_message(cycle, order), position_only) == ["effort"]
    assert refusals(cycle_to_message(cycle, order, effort=False), position_only) == []


@pytest.mark.parametrize("rate", [0.5, -5.0, math.nan, 1000.1])
def test_every_rate_that_is_refused_hears_the_same_limits(rate):
    cycles = CycleMessages()
    with pytest.raises(InvalidRequestError, match=f"rate is {rate:g} Hz, allowed is 1 to 1000 Hz"):
        cycles.make(profile_of(with_refinement(made_up_gait())), rate, JOINTS, effort=True)
    cycles.close()


def test_the_columns_of_the_trajectory_follow_its_names():
    cycle = sample_cycle(profile_of(with_refinement(made_up_gait())), 100.0)
    plain, turned = cycle_to_message(cycle), cycle_to_message(cycle, JOINTS[::-1])
    assert list(turned.joint_names) == list(JOINTS[::-1])
    for field in ("positions", "velocities", "effort"):
        assert list(getattr(turned.points[7], field)) == list(getattr(plain.points[7], field))[::-1]
