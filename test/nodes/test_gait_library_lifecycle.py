"""The library as a managed node: with a manager, without one, and when a transition fails."""

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from nodes.conftest import SLOW
from nodes.graph import assert_left_cleanly
from walk_optimizer_interfaces.msg import GaitTable
from walk_optimizer_interfaces.srv import GetGait, ListGaits, Rebuild

from walk_optimizer.nodes.qos import LATCHED

pytestmark = pytest.mark.ros

NODE = "gait_library"
MODE = "stiffness_and_equilibrium"


def change(graph, transition):
    """Return whether a transition succeeded, and the state after it."""
    done = graph.call(ChangeState, f"{NODE}/change_state", transition=Transition(id=transition)).success
    return done, graph.call(GetState, f"{NODE}/get_state").current_state.label


def ask(graph):
    return graph.call(GetGait, f"{NODE}/get_gait", speed=SLOW, spring_mode=MODE)


def test_a_manager_leads_the_node_through_its_life(graph, start, stocked):
    node = start(NODE, autostart=False, **stocked)
    tables = graph.subscribe(GaitTable, f"{NODE}/table", LATCHED)
    events = graph.subscribe(TransitionEvent, f"{NODE}/transition_event")
    assert graph.call(GetState, f"{NODE}/get_state").current_state.label == "unconfigured"
    assert change(graph, Transition.TRANSITION_CONFIGURE) == (True, "inactive")
    refused = ask(graph)
    assert (refused.success, refused.message) == (
        False,
        "/gait_library is inactive; to get on: ros2 lifecycle set /gait_library activate",
    )
    assert not tables
    assert change(graph, Transition.TRANSITION_ACTIVATE) == (True, "active")
    assert ask(graph).success
    graph.spin_until(lambda: tables, "the table")
    assert change(graph, Transition.TRANSITION_DEACTIVATE) == (True, "inactive")
    assert not ask(graph).success
    assert change(graph, Transition.TRANSITION_CLEANUP) == (True, "unconfigured")
    graph.spin_until(lambda: not graph.offered(NODE, f"/{NODE}/get_gait"), "the end of the service")
    assert change(graph, Transition.TRANSITION_CONFIGURE) == (True, "inactive")
    assert change(graph, Transition.TRANSITION_ACTIVATE) == (True, "active")
    graph.spin_until(lambda: graph.offered(NODE, f"/{NODE}/get_gait"), "the service")
    graph.forget(f"{NODE}/get_gait")
    assert ask(graph).success
    assert change(graph, Transition.TRANSITION_ACTIVE_SHUTDOWN) == (True, "finalized")
    graph.spin_until(lambda: events and events[-1].goal_state.label == "finalized", "the last event")
    assert_left_cleanly(node, node.stop())


def test_a_transition_that_the_state_does_not_have_is_answered(graph, start, stocked):
    start(NODE, autostart=False, **stocked)
    assert change(graph, Transition.TRANSITION_ACTIVATE) == (False, "unconfigured")
    assert change(graph, 77) == (False, "unconfigured")
    possible = graph.call(GetAvailableTransitions, f"{NODE}/get_available_transitions")
    labels = {one.transition.label for one in possible.available_transitions}
    assert labels == {"configure", "shutdown"}


def test_a_configure_that_fails_names_the_folder_and_can_be_repeated(graph, start, stocked, tmp_path):
    folder = tmp_path / "later"
    node = start(NODE, autostart=False, **stocked | {"cache_folder": folder})
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")

    def findings(name):
        return [one for array in heard for one in array.status if one.name == f"{NODE}: {name}"]

    assert change(graph, Transition.TRANSITION_CONFIGURE) == (False, "unconfigured")
    assert f"can't configure: {folder}: the folder is missing" in node.output()
    graph.spin_until(lambda: any(str(folder) in one.message for one in findings("lifecycle")), "the finding")
    assert findings("lifecycle")[-1].level == DiagnosticStatus.ERROR
    assert not graph.offered(NODE, f"/{NODE}/get_gait")
    folder.mkdir()
    assert change(graph, Transition.TRANSITION_CONFIGURE) == (True, "inactive")
    assert change(graph, Transition.TRANSITION_ACTIVATE) == (True, "active")
    assert graph.call(ListGaits, f"{NODE}/list_gaits").success
    heard.clear()
    graph.spin_until(lambda: findings("gaits") and findings("optimizer"), "all findings")
    assert findings("lifecycle")[-1].level == DiagnosticStatus.OK
    assert findings("gaits")[-1].message == "no gaits yet: every request has to be solved"
    assert "start gait_optimizer" in findings("optimizer")[-1].message


def test_whoever_waits_when_the_node_is_deactivated_is_told(graph, start, stocked):
    """While the optimizer, which is not there, is looked for; a rebuild asks for one gait after the other."""
    start(NODE, **stocked)
    waiting = [
        graph.send(GetGait, f"{NODE}/get_gait", speed=0.4, spring_mode="none"),
        graph.send(Rebuild, f"{NODE}/rebuild"),
    ]
    graph.client(ChangeState, f"{NODE}/change_state")
    begun = graph.send(Rebuild, f"{NODE}/rebuild")
    graph.spin_for(0.5)
    assert change(graph, Transition.TRANSITION_DEACTIVATE) == (True, "inactive")
    for future in (waiting[1], begun):
        answer = graph.result(future)
        assert (answer.success, answer.rebuilt) == (False, 0)
    assert "/gait_library was deactivated" in graph.result(begun).message
    assert not graph.result(waiting[0]).success
    assert change(graph, Transition.TRANSITION_ACTIVATE) == (True, "active")
    assert ask(graph).success
