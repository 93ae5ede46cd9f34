"""Fixtures that start nodes as processes, on a ROS domain of this test run alone."""

import os

import pytest
import yaml
from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters

SLOW, FAST = 0.25 / 0.785, 0.8
HIP_MASS = 46.0


@pytest.fixture(scope="session")
def isolated_graph():
    pytest.importorskip("rclpy")
    from walk_optimizer.cli.processes import free_domain

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(free_domain()))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield dict(os.environ)


@pytest.fixture
def graph(isolated_graph):
    from nodes.graph import Graph

    graph = Graph()
    yield graph
    graph.close()


def starter(logs):
    """Yield what starts nodes, and end them."""
    from nodes.graph import Starter

    starter = Starter(logs)
    yield starter
    starter.close()


@pytest.fixture
def start(isolated_graph, tmp_path):
    yield from starter(tmp_path)


@pytest.fixture(scope="module")
def start_for_module(isolated_graph, tmp_path_factory):
    yield from starter(tmp_path_factory.mktemp("logs"))


@pytest.fixture(scope="session")
def other_walker(tmp_path_factory):
    """The file of a walker that the packaged table does not hold for."""
    path = tmp_path_factory.mktemp("walker") / "walker.yaml"
    path.write_text(yaml.safe_dump({"hip_mass": HIP_MASS}))
    return path


def stock(folder, walker_file):
    """Return parameters of a library node with two gaits, made up and so there at once; FAST is refined."""
    gaits = folder / "gaits"
    gaits.mkdir()
    walker = WalkerParameters(hip_mass=HIP_MASS)
    library = GaitLibrary(walker, gaits)
    for speed, torque in ((SLOW, 1.0), (FAST, 3.0)):
        mode = "stiffness_and_equilibrium"
        gait = made_up_gait(speed=speed, mode=mode, torque=torque, walker=walker)
        library.store(with_refinement(gait) if speed == FAST else gait)
    return {"walker_file": walker_file, "cache_folder": gaits, "points": 20}


@pytest.fixture
def stocked(other_walker, tmp_path):
    """Parameters of a library node that is stocked."""
    return stock(tmp_path, other_walker)
