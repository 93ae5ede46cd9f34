"""What the launch file gives to which node; launch itself, which no wheel has, is stood in for."""

import importlib.util
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from walk_optimizer.nodes.lifecycle import AUTOSTART, ManagedNode
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.resources import config_file

FILE = config_file("walker.yaml").resolve().parents[1] / "launch" / "walker.launch.py"
ALL = {"use_sim_time": "true", "autostart": "false", "walker_file": "/my/walker.yaml"}


class LaunchConfiguration(SimpleNamespace):
    """The value of a launch argument."""

    def __init__(self, name):
        super().__init__(name=name)

    def perform(self, context):
        return context[self.name]


def recorded(name):
    """What remembers how it was called."""
    return lambda *args, **fields: SimpleNamespace(kind=name, args=args, **fields)


STAND_INS = {
    "launch": {"LaunchContext": dict, "LaunchDescription": recorded("description")},
    "launch.actions": {
        "DeclareLaunchArgument": recorded("argument"),
        "OpaqueFunction": recorded("function"),
    },
    "launch.condition": {"Condition": object},
    "launch.conditions": {"IfCondition": recorded("if")},
    "launch.substitutions": {
        "LaunchConfiguration": LaunchConfiguration,
        "OrSubstitution": recorded("or"),
        "PathJoinSubstitution": lambda parts: parts[-1],
    },
    "launch_ros": {},
    "launch_ros.actions": {"Node": recorded("node")},
    "launch_ros.parameter_descriptions": {"ParameterValue": lambda value, value_type: (value, value_type)},
    "launch_ros.substitutions": {"FindPackageShare": recorded("share")},
}


@pytest.fixture
def launch(monkeypatch):
    """Return what gives the parameters of all nodes for launch arguments, by the nodes' names."""
    for name, members in STAND_INS.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("walker_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    *declared, function = module.generate_launch_description().args[0]

    def parameters(**arguments):
        context = {one.args[0]: one.default_value for one in declared} | arguments
        assert len(context) == len(declared), "an argument that is not declared"
        return {node.name: node.parameters for node in function.function(context)}

    return parameters


def settings_of(name):
    """The names of the parameters that a node of the suite has."""
    module = import_module(f"walk_optimizer.nodes.{name}")
    settings = module.SETTINGS if hasattr(module, "SETTINGS") else module._settings()
    kinds = [one for one in vars(module).values() if isinstance(one, type) and issubclass(one, SuiteNode)]
    (node,) = [one for one in kinds if one.__module__ == module.__name__]
    managed = [AUTOSTART] if issubclass(node, ManagedNode) else []
    return {one.name for one in [*settings, *managed]} | {"use_sim_time"}


def test_every_node_gets_the_arguments_that_it_has_parameters_for_and_no_others(launch):
    given = {name: parameters[-1].keys() for name, parameters in launch(**ALL).items()}
    assert given.pop("rviz") == {"use_sim_time"}
    assert len(given) == 4
    for name, names in given.items():
        assert names == ALL.keys() & settings_of(name), name


def test_what_is_not_given_is_left_to_the_files_and_a_file_of_ones_own_counts_before_ours(launch, tmp_path):
    own = tmp_path / "mine.yaml"
    own.touch()
    nodes = launch(params_file=str(own), walker_file="/my/walker.yaml")
    del nodes["rviz"]
    for name, (shipped, second, given) in nodes.items():
        assert Path(shipped).name == f"{name}.yaml"
        assert second == own
        assert [(key, value.name, kind) for key, (value, kind) in given.items()] == [
            ("walker_file", "walker_file", str)
        ]
    assert all(parameters[-1] == {} for parameters in launch().values())


def test_a_parameter_file_that_is_missing_is_refused(launch):
    with pytest.raises(FileNotFoundError, match=r"params_file: there is no file /none\.yaml"):
        launch(params_file="/none.yaml")
