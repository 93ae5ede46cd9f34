"""A test's own part in the ROS graph, and nodes started as the processes that users start."""

import os
import time
from pathlib import Path

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from walk_optimizer.cli.processes import NodeProcess

# Far longer than anything takes on a machine that does nothing else.
PATIENCE = 180.0
SETTLING = 0.3


class Graph:
    """Clients and subscribers of the test process."""

    def __init__(self):
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node("test_client")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self._clients = {}

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()

    def spin_until(self, condition, what, patience=PATIENCE):
        deadline = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < deadline, f"{what} took too long"
            self.executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds):
        end = time.monotonic() + seconds
        self.spin_until(lambda: time.monotonic() >= end, "time")

    def client(self, kind, name):
        """Return a client that the service knows."""
        if name not in self._clients:
            self._clients[name] = client = self.node.create_client(kind, name)
            self.spin_until(client.service_is_ready, f"service {name}")
            # We know the service; ROS does not tell when it knows us, and drops answers until then.
            self.spin_for(SETTLING)
        return self._clients[name]

    def offered(self, node, name):
        """Return whether a node without a namespace offers a service of that full name."""
        return any(name == one for one, _ in self.node.get_service_names_and_types_by_node(node, "/"))

    def forget(self, name):
        """Make the client of a service anew when it is used again."""
        self.node.destroy_client(self._clients.pop(name))

    def send(self, kind, name, **fields):
        """Return the future of a response."""
        return self.client(kind, name).call_async(kind.Request(**fields))

    def result(self, future, what="an answer", patience=PATIENCE):
        self.spin_until(future.done, what, patience)
        return future.result()

    def call(self, kind, name, **fields):
        return self.result(self.send(kind, name, **fields), name)

    def subscribe(self, kind, name, qos=None):
        """Return the list that messages are put into as they arrive."""
        received = []
        self.node.create_subscription(kind, name, received.append, qos or QoSProfile(depth=5000))
        return received

    def publisher(self, kind, name, qos=1):
        publisher = self.node.create_publisher(kind, name, qos)
        self.spin_until(lambda: publisher.get_subscription_count() > 0, f"a subscriber of {name}")
        return publisher

    def action(self, kind, name):
        client = ActionClient(self.node, kind, name)
        self.spin_until(client.server_is_ready, f"action {name}")
        self.spin_for(SETTLING)
        return client

    def set_parameters(self, node, *parameters):
        """Return the results of setting parameters of another node."""
        client = AsyncParameterClient(self.node, node)
        self.spin_until(client.services_are_ready, f"parameters of {node}")
        return self.result(client.set_parameters(list(parameters))).results

    def get_parameter(self, node, name):
        client = AsyncParameterClient(self.node, node)
        self.spin_until(client.services_are_ready, f"parameters of {node}")
        return self.result(client.get_parameters([name])).values[0]


class Starter:
    """Starts nodes, and leaves none behind."""

    def __init__(self, logs: Path):
        self._logs = logs
        self.nodes = []

    def __call__(self, name, namespace="", remaps=None, **parameters):
        arguments = [part for key, value in parameters.items() for part in ("-p", f"{key}:={value}")]
        if namespace:
            arguments += ["-r", f"__ns:=/{namespace}"]
        for old, new in (remaps or {}).items():
            arguments += ["-r", f"{old}:={new}"]
        log = self._logs / f"{name}_{len(self.nodes)}.log"
        node = NodeProcess(name, log, arguments, os.environ)
        self.nodes.append(node)
        # Others wait for a library no longer than seconds; a test machine may take more to start it.
        if name == "gait_library" and parameters.get("autostart", True):
            _await_start(node)
        return node

    def close(self):
        for node in self.nodes:
            node.kill()
            print(f"--- what {node.name} printed:\n{node.output()}")  # pytest shows it where a test failed.


def _await_start(node):
    """Wait until a node is ready, or has ended because it can't start."""
    deadline = time.monotonic() + PATIENCE
    while "ready" not in node.output() and node.exit_code is None:
        assert time.monotonic() < deadline, f"{node.name} took too long: {node.output()}"
        time.sleep(0.05)


def assert_left_cleanly(node, code):
    assert code == 0, node.output()
    assert "Traceback" not in node.output(), node.output()


def children_of(pid):
    """Return the ids of the processes that a process has started, and of theirs."""
    return [one for child in _started_by(pid) for one in (child, *children_of(child))]


def workers_of(pid):
    """Return the ids of an optimiser's workers: no forks of theirs, and not Python's tracker of resources."""
    return [
        child for child in _started_by(pid) if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()
    ]


def _started_by(pid):
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = path.read_text().rsplit(")", 1)[1].split()[:2]
        except OSError:
            continue
        if int(parent) == pid and state != "Z":
            found.append(int(path.parent.name))
    return found


def exists(pid):
    """Whether a process is still there."""
    return Path(f"/proc/{pid}").exists()
