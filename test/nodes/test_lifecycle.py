"""The base of managed nodes, in this process: steps that fail as expected, and as nobody expects."""

import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Empty

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.nodes.diagnostics import Level
from walk_optimizer.nodes.lifecycle import ManagedNode, NotActiveError, TransitionError

pytestmark = pytest.mark.ros

SUCCESS, FAILURE, ERROR = (
    TransitionCallbackReturn.SUCCESS,
    TransitionCallbackReturn.FAILURE,
    TransitionCallbackReturn.ERROR,
)
EXPECTED, UNEXPECTED = ConfigurationError("the disk is gone"), RuntimeError("surprise")


class Stepper(ManagedNode):
    """Notes its steps; each raises what is in `faults` under its name, after having done its work."""

    def __init__(self):
        super().__init__("stepper", [])
        self.steps, self.faults = [], {}

    def _take(self, name):
        self.steps.append(name)
        if name in self.faults:
            raise self.faults[name]

    def configure(self):
        self.create_publisher(Empty, "~/made_by_configure", 1)
        self._take("configure")

    def activate(self):
        self._take("activate")

    def deactivate(self):
        self._take("deactivate")

    def cleanup(self):
        self._take("cleanup")

    def topics(self):
        return {publisher.topic_name for publisher in self.publishers}


@pytest.fixture
def make(isolated_graph):
    """Return what makes the node with parameters."""
    nodes = []

    def make(**parameters):
        overrides = [f"{name}:={value}" for name, value in parameters.items()]
        arguments = ["--ros-args", *(part for one in overrides for part in ("-p", one))]
        rclpy.init(args=arguments if overrides else [], signal_handler_options=SignalHandlerOptions.NO)
        nodes.append(Stepper())
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def test_the_steps_come_in_order_and_leave_no_entity_behind(make):
    node = make()
    before = node.topics()
    node.begin()
    assert (node.state, node.steps) == ("active", ["configure", "activate"])
    assert node.topics() - before == {"/stepper/made_by_configure"}
    assert (node.trigger_deactivate(), node.trigger_cleanup()) == (SUCCESS, SUCCESS)
    assert (node.state, node.steps[2:]) == ("unconfigured", ["deactivate", "cleanup"])
    assert node.topics() == before


def test_autostart_is_a_choice_and_cannot_be_changed_later(make):
    node = make(autostart="false")
    node.begin()
    assert (node.state, node.steps) == ("unconfigured", [])
    (answer,) = node.set_parameters([Parameter("autostart", value=True)])
    assert not answer.successful


@pytest.mark.parametrize(
    ("step", "state"),
    [("configure", "unconfigured"), ("activate", "inactive")],
    ids=["configure", "activate"],
)
def test_a_step_that_fails_can_be_repeated(make, step, state):
    node = make()
    before = node.topics()
    node.faults[step] = EXPECTED
    with pytest.raises(TransitionError, match="the disk is gone"):
        node.begin()
    assert node.state == state
    finding = node.diagnostics.findings()["lifecycle"]
    assert (finding.level, "the disk is gone" in finding.message) == (Level.ERROR, True)
    if state == "unconfigured":
        assert node.topics() == before
        assert node.steps[-1] == "cleanup"
    node.faults.clear()
    if state == "unconfigured":
        assert node.trigger_configure() == SUCCESS
    assert node.trigger_activate() == SUCCESS
    assert node.diagnostics.findings()["lifecycle"].level is Level.OK


@pytest.mark.parametrize("step", ["configure", "activate", "deactivate"])
def test_after_an_error_that_nobody_expected_the_node_can_be_configured_again(make, step):
    node = make(autostart="false")
    before = node.topics()
    node.faults[step] = UNEXPECTED
    for trigger in (node.trigger_configure, node.trigger_activate, node.trigger_deactivate):
        result = trigger()
        if result != SUCCESS:
            break
    assert (result, node.steps[-2:]) == (ERROR, [step, "cleanup"])
    assert (node.state, node.topics()) == ("unconfigured", before)
    node.faults.clear()
    assert (node.trigger_configure(), node.trigger_activate()) == (SUCCESS, SUCCESS)


def test_an_error_in_cleaning_up_after_an_error_is_the_end(make):
    node = make(autostart="false")
    node.faults = {"configure": UNEXPECTED, "cleanup": UNEXPECTED}
    assert node.trigger_configure() == ERROR
    assert node.state == "finalized"
    node.close()


@pytest.mark.parametrize("transitions", [0, 1, 2])
def test_closing_shuts_down_from_any_state(make, transitions):
    node = make(autostart="false")
    for trigger in (node.trigger_configure, node.trigger_activate)[:transitions]:
        assert trigger() == SUCCESS
    node.close()
    node.close()
    assert node.state == "finalized"
    assert node.steps[transitions:] == (["deactivate"] if transitions == 2 else []) + ["cleanup"]


def test_a_wait_ends_when_the_node_is_deactivated(make):
    node = make()
    node.begin()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    ends = []

    async def wait():
        try:
            await node.sleep(1000.0)
        except NotActiveError as error:
            ends.append(str(error))

    executor.create_task(wait)
    executor.spin_once(timeout_sec=0.1)
    timers = len(list(node.timers))
    assert not ends
    node.trigger_deactivate()
    while not ends:
        executor.spin_once(timeout_sec=0.1)
    assert ends == ["/stepper was deactivated; activate it and ask again"]
    assert len(list(node.timers)) == timers - 1
    executor.shutdown()
