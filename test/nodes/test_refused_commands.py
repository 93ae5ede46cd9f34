"""A command that can't be followed changes nothing: a stream of speeds that came before is still watched."""

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, Vector3
from nodes.conftest import FAST, SLOW, stock
from nodes.walking import BLENDED, NODE, standing_walker
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.srv import SetGait

pytestmark = pytest.mark.ros

TIMEOUT = 0.5
# Torques at the most: SLOW 2 and 1, FAST 4 and 2 N m (hip, knee); of a stand 0.5 and 4.
SLOW_ONLY = [50.0, 50.0, 3.0, 50.0]
REFUSED = "right_hip needs 4.107 N m, its limit is 3 N m"
SILENT = f"coming to a stand: no speed on /{NODE}/cmd_vel for {TIMEOUT:g} s"


@pytest.fixture(scope="module")
def publisher(start_for_module, other_walker, tmp_path_factory):
    start_for_module("gait_library", **stock(tmp_path_factory.mktemp("stock"), other_walker))
    return start_for_module(
        NODE, walker_file=other_walker, command_timeout=TIMEOUT, joint_torque_limits=SLOW_ONLY, **BLENDED
    )


@pytest.fixture
def walker(graph, publisher):
    """A publisher that stands, and stands again after the test."""
    # Known from the start: a stream is stale by the time that a client has got to know its service.
    graph.client(SetGait, f"{NODE}/set_gait")
    for name in ("emergency_stop", "resume"):
        graph.client(Trigger, f"{NODE}/{name}")
    with standing_walker(graph, publisher) as walker:
        yield walker


@pytest.fixture
def stream(walker):
    """Publishes a speed on ~/cmd_vel."""
    velocity = walker.talk(Twist, "cmd_vel")
    return lambda speed: velocity.publish(Twist(linear=Vector3(x=speed)))


def stream_until(walker, stream, speed, state):
    walker.graph.spin_until(lambda: stream(speed) or walker.states[-1].state == state, state)


def refused_service(walker, _speed):
    answer = walker.set_gait(FAST)
    assert (answer.success, REFUSED in answer.message) == (False, True)


def refused_topic(_walker, speed):
    speed.publish(Float64(data=FAST))


def refused_in_an_emergency(walker, _speed):
    walker.trigger("emergency_stop")
    answer = walker.set_gait(SLOW)
    assert (answer.success, "call ~/resume" in answer.message) == (False, True)
    walker.trigger("resume")
    walker.trigger("resume")


@pytest.mark.parametrize("refused", [refused_service, refused_topic, refused_in_an_emergency])
def test_a_refused_command_does_not_end_the_watch_of_a_stream(walker, stream, publisher, refused):
    told, speed = publisher.output().count(SILENT), walker.talk(Float64, "target_speed")
    stream_until(walker, stream, SLOW, "walking")
    refused(walker, speed)
    walker.wait_for("standing")
    assert publisher.output().count(SILENT) > told


def test_a_stream_that_is_refused_because_of_limits_goes_stale(graph, walker, stream):
    diagnostics = graph.subscribe(DiagnosticArray, "/diagnostics")
    stream_until(walker, stream, SLOW, "walking")
    stream_until(walker, stream, FAST, "standing")

    def told():
        stream(FAST)
        walk = [one for array in diagnostics for one in array.status if one.name == f"{NODE}: walk"]
        return walk and walk[-1].level == b"\x01" and REFUSED in walk[-1].message

    graph.spin_until(told, "the reason")
    # The stream is followed again as soon as it can be.
    stream_until(walker, stream, SLOW, "walking")


@pytest.mark.parametrize("service", [True, False])
def test_a_set_point_that_is_carried_out_ends_the_watch_of_a_stream(graph, walker, stream, service):
    speed = walker.talk(Float64, "target_speed")
    stream_until(walker, stream, SLOW, "walking")
    graph.spin_for(TIMEOUT / 4)  # Messages of two topics may overtake each other.
    if service:
        assert walker.set_gait(SLOW).success
    else:
        speed.publish(Float64(data=SLOW))
    graph.spin_for(4 * TIMEOUT)
    assert walker.states[-1].state == "walking"


def test_a_refused_stream_does_not_end_a_set_point(graph, walker, stream):
    walker.walk(SLOW)
    stream(FAST)
    graph.spin_for(4 * TIMEOUT)
    assert walker.states[-1].state == "walking"
