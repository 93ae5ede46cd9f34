"""The publisher with real gaits while steps between them are solved for, by its default of `longest_gap`."""

import pytest

pytest.importorskip("rclpy")

from nodes.graph import exists, workers_of
from nodes.walking import MODE, NODE, Walker
from walk_optimizer_interfaces.srv import SetGait

pytestmark = pytest.mark.ros

# Of the packaged table, which has no steps from the one to the other: they take seconds to solve for.
SLOWEST, FASTEST = 0.20 / 0.85, 0.50 / 0.46


@pytest.fixture(scope="module")
def publisher(start_for_module, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cache")
    start_for_module("gait_library", cache_folder=folder)
    return start_for_module(NODE, cache_folder=folder, rate=200.0)


@pytest.fixture
def walker(graph, publisher):
    """A publisher that stands, and stands again after the test."""
    walker = Walker(graph)
    walker.wait_for("standing")
    yield walker
    walker.trigger("stop")
    walker.wait_for("standing")
    assert publisher.exit_code is None


def ask_for_a_solve(walker, publisher):
    """Return the future answer of a command, once the worker process solves for it."""
    answer = walker.graph.send(SetGait, walker.topic("set_gait"), speed=FASTEST, spring_mode=MODE)
    walker.graph.spin_until(lambda: workers_of(publisher.process.pid), "the solve")
    return answer


def test_an_emergency_stop_ends_the_command_under_way(graph, walker, publisher):
    walker.walk(SLOWEST)
    answer = ask_for_a_solve(walker, publisher)
    walker.trigger("emergency_stop")
    refused = graph.result(answer)
    assert (refused.success, "given up because of the emergency stop" in refused.message) == (False, True)
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("walking", SLOWEST)
    assert walker.states[-1].target_speed == walker.states[-1].speed


def test_an_emergency_stop_drops_a_gait_that_has_not_begun(graph, walker):
    walker.trigger("pause")
    assert walker.set_gait(SLOWEST).success
    walker.trigger("emergency_stop")
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("standing")
    assert walker.states[-1].target_speed == 0


def test_a_later_command_ends_the_solve_for_an_earlier_one(graph, walker, publisher):
    walker.walk(SLOWEST)
    answer = ask_for_a_solve(walker, publisher)
    workers = workers_of(publisher.process.pid)
    walker.trigger("stop")
    refused = graph.result(answer)
    assert (refused.success, refused.message) == (False, "a later command came first")
    # Not one that was let run to its end: its process is gone.
    graph.spin_until(lambda: not any(exists(worker) for worker in workers), "the end of the worker")
