"""A gait planned with margins walks at a speed where the optimum without them can't be held."""

import pytest
from cli.console import walk_optimizer

from walk_optimizer.gait_files import gait_file_name, write_gait_file
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.request import GaitRequest
from walk_optimizer.simulation.closed_loop import closed_loop
from walk_optimizer.simulation.linearization import largest_multiplier
from walk_optimizer.simulation.settings import simulation_settings

FASTEST = 3.91 / 3.6
GROUND = 0.8


@pytest.fixture(scope="module")
def gait():
    walker = WalkerParameters(friction_coefficient=0.7, landing_speed=0.1, stance_load=0.1)
    found = optimize(GaitRequest.for_speed(FASTEST, "none", 50), walker).gait
    assert found is not None
    return found


def test_without_margins_it_falls_and_with_them_it_walks(gait):
    shipped, _ = GaitLibrary(WalkerParameters()).find(FASTEST, SpringMode.NONE)
    assert closed_loop(shipped, simulation_settings()).walk(4).ending.is_fall
    loop = closed_loop(gait, simulation_settings()).on_ground(GROUND)
    assert not loop.walk(4).ending.is_fall
    assert largest_multiplier(loop.step.closed_loop(loop.feedback)) < 0.9


def test_the_command_walks_it_on_the_ground_that_there_is(gait, tmp_path):
    file = tmp_path / gait_file_name(gait)
    write_gait_file(gait, file)
    done = walk_optimizer("simulate", "--file", file, "--friction", "0.8", "--steps", "2", home=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "2 of 2, still walking" in done.stdout
