"""The graph that a stream is measured in: its processes, a client of the nodes, one run."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import Trigger
from stream_figures import figures
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import SetGait, StartRecording, StopRecording

from walk_optimizer.cli.processes import NodeProcess
from walk_optimizer.nodes.qos import LATCHED

PUBLISHER, LIBRARY = "reference_publisher", "gait_library"
TOPIC, BARE_TOPIC = f"/{PUBLISHER}/joint_reference", "/bare/joint_reference"
# A gait of the packaged table.
GAIT = {"speed": 0.25 / 0.785, "spring_mode": "stiffness_and_equilibrium"}
# A service that we know may not know us yet, in [s].
_SETTLING = 1.0
# Until a subscriber has answered the first heartbeat, which comes after 3 s. To do so it opens the shared
# memory of the publisher's process, and Fast DDS may then deliver nothing for a third of a second. In [s].
_JOINING = 4.0
_TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")


class Client:
    """The benchmark's own part in the graph."""

    def __init__(self):
        rclpy.init(args=[], signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
        self.node, self.executor = Node("benchmark"), SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.clients, self.state = {}, ""
        self.node.create_subscription(WalkState, f"{PUBLISHER}/state", self._note, LATCHED)

    def _note(self, message):
        self.state = message.state

    def wait(self, condition, what, patience=60.0):
        end = time.monotonic() + patience
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(what)
            self.executor.spin_once(timeout_sec=0.05)

    def call(self, kind, name, **fields):
        if name not in self.clients:
            self.clients[name] = self.node.create_client(kind, name)
            self.wait(self.clients[name].service_is_ready, name)
            time.sleep(_SETTLING)
        future = self.clients[name].call_async(kind.Request(**fields))
        self.wait(future.done, name)
        answer = future.result()
        if not answer.success and kind is not Trigger:
            raise RuntimeError(f"{name}: {answer.message}")
        return answer

    def set_rate(self, rate):
        client = AsyncParameterClient(self.node, PUBLISHER)
        self.wait(client.services_are_ready, "parameters")
        future = client.set_parameters([Parameter("rate", value=rate)])
        self.wait(future.done, "rate")

    def latencies(self, kind, name, count, **fields):
        """Return the times in [s] of calls one after the other."""
        self.call(kind, name, **fields)
        times = []
        for _ in range(count):
            begin = time.perf_counter()
            self.call(kind, name, **fields)
            times.append(time.perf_counter() - begin)
        return np.array(times)


def helper(*arguments):
    """Start one of the processes of `stream_processes` and wait until it is ready."""
    script = Path(__file__).with_name("stream_processes.py")
    process = subprocess.Popen([sys.executable, str(script), *arguments], stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    return process


@contextmanager
def running(*arguments):
    """Run one of the processes as long as the context lasts."""
    process = helper(*arguments)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()


def cpu_seconds(pid):
    """Return the time that a process has spent on processors, in [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_SECOND


def noted(listeners):
    """End listeners; return what each has noted: stamps and arrivals in [ns], (messages, 2)."""
    for process in listeners:
        process.send_signal(signal.SIGTERM)
    return [np.array(json.loads(process.communicate()[0])) for process in listeners]


def measured(pid, topic, rate, subscribers, seconds):
    """Return the figures of one run of a stream, as one of some subscribers sees it.

    Args:
        pid: The publishing process.
        topic: Of the stream.
        rate: Of the stream in [Hz].
        subscribers: Their number.
        seconds: That the run takes.
    """
    listeners = [helper("listener", "--topic", topic) for _ in range(subscribers)]
    time.sleep(_JOINING)
    begin, spent = time.monotonic(), cpu_seconds(pid)
    time.sleep(seconds)
    cpu = (cpu_seconds(pid) - spent) / (time.monotonic() - begin)
    return figures(noted(listeners)[0], rate, seconds, cpu)


@contextmanager
def recorded(client, directory):
    """Have the publisher record as long as the context lasts."""
    client.call(StartRecording, f"{PUBLISHER}/start_recording", directory=str(directory))
    yield
    client.call(StopRecording, f"{PUBLISHER}/stop_recording")


@contextmanager
def walking_publisher(folder, environment):
    """Run library and publisher, walking; the context is the client and the publisher's process."""
    with ExitStack() as stack:
        nodes = []
        for name, arguments in ((LIBRARY, []), (PUBLISHER, ["-p", "transitions:=blended"])):
            nodes.append(NodeProcess(name, folder / f"{name}.log", arguments, environment))
            stack.callback(nodes[-1].kill)
        client = Client()
        stack.callback(rclpy.try_shutdown)
        client.call(SetGait, f"{PUBLISHER}/set_gait", **GAIT)
        client.wait(lambda: client.state == "walking", "the walk")
        yield client, nodes[-1].process.pid
        for node in nodes:
            node.stop()
