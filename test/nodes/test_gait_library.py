import signal

import pytest

pytest.importorskip("rclpy")

from nodes.conftest import FAST, HIP_MASS, SLOW
from nodes.graph import assert_left_cleanly
from walk_optimizer_interfaces.msg import GaitTable
from walk_optimizer_interfaces.srv import GetGait, ListGaits, Rebuild

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.conversions import trajectory_from_message
from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.streamed_gait import ReceivedGait
from walk_optimizer.request import GaitRequest

pytestmark = pytest.mark.ros

GET = "gait_library/get_gait"
MODE = "stiffness_and_equilibrium"


def test_a_stored_gait_is_served_as_it_is_without_an_optimizer(graph, start, stocked):
    start("gait_library", **stocked)
    answer = graph.call(GetGait, GET, speed=SLOW, spring_mode=MODE)
    assert answer.success, answer.message
    assert answer.source == "cache"
    stored, _ = GaitLibrary(WalkerParameters(hip_mass=HIP_MASS), stocked["cache_folder"]).find(SLOW, MODE)
    assert (trajectory_from_message(answer.gait).q == stored.trajectory.q).all()
    assert answer.gait.stiffness == stored.spring.stiffness


def test_nearest_and_the_table_for_a_late_joiner(graph, start, stocked):
    start("gait_library", **stocked)
    nearest = graph.call(GetGait, GET, speed=0.75, spring_mode=MODE, selection="nearest")
    assert (nearest.success, nearest.gait.speed) == (True, pytest.approx(FAST))
    table = graph.call(ListGaits, "gait_library/list_gaits").table
    assert sorted(row.speed for row in table.gaits) == pytest.approx([SLOW, FAST])
    assert table.walker == WalkerParameters(hip_mass=HIP_MASS).fingerprint()
    latched = graph.subscribe(GaitTable, "gait_library/table", LATCHED)
    graph.spin_until(lambda: latched, "the latched table")
    assert [(row.speed, row.objective) for row in latched[0].gaits] == [
        (row.speed, row.objective) for row in table.gaits
    ]


def test_any_speed_is_blended_within_bounds_and_the_answer_says_so(graph, start, tmp_path):
    """With the packaged table, and without an optimizer."""
    node = start("gait_library", cache_folder=tmp_path)
    printed = 1.15 / 3.6
    answer = graph.call(GetGait, GET, speed=printed, spring_mode=MODE)
    assert (answer.success, answer.source, answer.gait.method) == (True, "interpolated", "interpolated")
    assert answer.gait.speed == pytest.approx(printed, abs=1e-6)
    assert "0.3194 m/s asked for, 0.3194 m/s delivered: interpolated between 0.3185 and" in answer.message
    streamed = ReceivedGait.from_message(answer.gait, WalkerParameters.from_yaml())
    assert streamed.profile.step_length / streamed.profile.step_time == pytest.approx(printed, abs=1e-6)
    assert graph.call(GetGait, GET, speed=printed, spring_mode=MODE).gait == answer.gait
    near = graph.call(GetGait, GET, speed=printed, spring_mode=MODE, selection="nearest")
    assert (near.source, near.gait.method) == ("table", "implicit_euler")
    assert "0.3194 m/s asked for, 0.3185 m/s delivered: from the table" in near.message
    for fields in (
        {"speed": printed, "spring_mode": MODE, "selection": "exact"},
        {"speed": 0.45, "spring_mode": "none"},
    ):
        refused = graph.call(GetGait, GET, **fields)
        assert not refused.success
        assert "optimize_gait is not there" in refused.message
        assert ("not interpolated between 0.4167" in refused.message) == (fields["speed"] == 0.45)
    assert not list(tmp_path.glob("*.npz"))
    assert "Traceback" not in node.output()


def test_refusals_say_what_the_core_says_and_the_node_lives_on(graph, start, stocked):
    node = start("gait_library", **stocked)
    for fields in (
        {"speed": float("nan"), "spring_mode": MODE},
        {"speed": -1.0, "spring_mode": MODE},
        {"speed": 9.0, "spring_mode": MODE},
        {"speed": SLOW, "spring_mode": "rubber"},
    ):
        with pytest.raises(InvalidRequestError) as refusal:
            GaitRequest.for_speed(**fields)
        answer = graph.call(GetGait, GET, **fields)
        assert (answer.success, answer.message) == (False, str(refusal.value))
    answer = graph.call(GetGait, GET, speed=SLOW, spring_mode=MODE, selection="fastest")
    assert (answer.success, "exact, interpolated, nearest" in answer.message) == (False, True)
    absent = graph.call(GetGait, GET, speed=SLOW, spring_mode="none")
    assert not absent.success
    assert "no gait of 0.3185 m/s (1.15 km/h) with springs none" in absent.message
    assert "gait_optimizer/optimize_gait is not there" in absent.message
    assert node.exit_code is None


@pytest.mark.slow
def test_what_is_lacking_is_solved_once_and_stored(graph, start, stocked):
    library = start("gait_library", **stocked)
    start("gait_optimizer", walker_file=stocked["walker_file"])
    solved = graph.call(GetGait, GET, speed=0.4, spring_mode="none")
    assert solved.success, solved.message
    assert solved.source == "optimizer"
    again = graph.call(GetGait, GET, speed=0.4, spring_mode="none")
    assert (again.source, again.gait) == ("cache", solved.gait)
    table = graph.call(ListGaits, "gait_library/list_gaits").table
    assert len(table.gaits) == 3
    rebuilt = graph.call(Rebuild, "gait_library/rebuild", speeds=[0.4], spring_modes=["none"])
    assert (rebuilt.success, rebuilt.rebuilt) == (True, 1), rebuilt.message
    refused = graph.call(Rebuild, "gait_library/rebuild", speeds=[0.4] * 64, spring_modes=["none"])
    assert not refused.success
    assert "64 speeds times 1 spring modes are too many to rebuild, allowed are 63" in refused.message
    assert_left_cleanly(library, library.stop(signal.SIGTERM))


def test_a_cache_folder_that_is_missing_stops_the_start(start, tmp_path):
    node = start("gait_library", cache_folder=tmp_path / "missing")
    assert node.process.wait(60) == 1
    assert str(tmp_path / "missing") in node.output()
    assert "Traceback" not in node.output()


def test_a_damaged_gait_file_is_named_and_the_rest_is_served(graph, start, stocked):
    broken = next(stocked["cache_folder"].iterdir())
    broken.write_bytes(broken.read_bytes()[:100])
    node = start("gait_library", **stocked)
    assert len(graph.call(ListGaits, "gait_library/list_gaits").table.gaits) == 1
    assert broken.name in node.output()


def test_ctrl_c_leaves_cleanly(graph, start, stocked):
    node = start("gait_library", **stocked)
    graph.client(GetGait, GET)
    assert_left_cleanly(node, node.stop(signal.SIGINT))
