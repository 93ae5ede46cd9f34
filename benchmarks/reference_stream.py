"""How evenly references are streamed, beside a bare rclpy timer with a bare publisher in the same run.

Every figure comes from a subscriber in another process: the stamps of the messages, and when they arrived.
The lateness of a message is how far its stamp is behind the most punctual ones of the same schedule. A
second table tells how the stream bears more subscribers, a third how soon a service answers.

    .venv/bin/python benchmarks/reference_stream.py            # 9 minutes; writes docs/benchmarks/
    .venv/bin/python benchmarks/reference_stream.py --quick    # to try: half a minute, prints only
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from report import machine, table
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import GetGait, SetGait, StartRecording, StopRecording

from walk_optimizer.cli.processes import NodeProcess, isolated_environment
from walk_optimizer.nodes.qos import LATCHED

PAGE = Path(__file__).parent.parent / "docs" / "benchmarks" / "reference_stream.md"
PUBLISHER, LIBRARY = "reference_publisher", "gait_library"
RATES = (500.0, 1000.0)
SUBSCRIBERS = (1, 2, 4)
# A gait of the packaged table.
GAIT = {"speed": 0.25 / 0.785, "spring_mode": "stiffness_and_equilibrium"}
PERCENTILES = (50.0, 99.0, 99.9)
# No figure is to be worse than the bare timer's by more than this part.
AIM = 0.1
SETTLING = 1.0
# Of a period, to find where most messages lie.
_BINS = 50
# Messages that are early by less are those of the tick that is about to be due, in periods.
_JITTER = 0.1
_TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Figures:
    """What one run has shown; times in [s].

    Attributes:
        rate: Messages per second of stamps, in [Hz].
        lateness: Median, 99th and 99.9th percentile.
        age: The same of the time from a message's stamp to its arrival.
        cpu: Share of a core that the publishing process took.
    """

    rate: float
    lateness: np.ndarray
    age: np.ndarray
    cpu: float

    def compared(self, bare):
        """Return by how much each figure is worse than the bare timer's, by name; 0 is equal."""
        return {
            "rate": bare.rate / self.rate - 1,
            "lateness": self.lateness[1] / bare.lateness[1] - 1,
            "age": self.age[1] / bare.age[1] - 1,
            "CPU": self.cpu / bare.cpu - 1,
        }


@dataclass(frozen=True)
class Runs:
    """The same run several times.

    Attributes:
        typical: The median of each figure.
        oldest: The 99th percentile of the age in the worst run, in [s].
    """

    typical: Figures
    oldest: float

    @classmethod
    def of(cls, runs):
        def median(name):
            return np.median([getattr(one, name) for one in runs], axis=0)

        typical = Figures(*(median(name) for name in ("rate", "lateness", "age", "cpu")))
        return cls(typical, max(one.age[1] for one in runs))


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
            time.sleep(SETTLING)  # We know the service; it may not know us yet.
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


def measure(pid, topic, rate, length, subscribers=1):
    """Return the figures of runs of a stream, as one of some subscribers sees it.

    Args:
        pid: The publishing process.
        topic: Of the stream.
        rate: Of the stream in [Hz].
        length: Number of runs, and of seconds that each of them takes.
        subscribers: Their number.
    """
    rounds, seconds = length
    return Runs.of([measured_once(pid, topic, rate, seconds, subscribers) for _ in range(rounds)])


def measured_once(pid, topic, rate, seconds, subscribers):
    """Return the figures of one run."""
    listeners = [helper("listener", "--topic", topic) for _ in range(subscribers)]
    time.sleep(SETTLING)
    begin, spent = time.monotonic(), cpu_seconds(pid)
    time.sleep(seconds)
    cpu = (cpu_seconds(pid) - spent) / (time.monotonic() - begin)
    for process in listeners:
        process.send_signal(signal.SIGTERM)
    received = [np.array(json.loads(process.communicate()[0])) for process in listeners]
    return figures(received[0], rate, seconds, cpu)


def figures(received, rate, seconds, cpu):
    """Return the figures of stamps and arrivals in [ns], (messages, 2), of the last seconds."""
    stamps, arrivals = (received - received[-1, 0]).T * 1e-9
    kept = stamps > -seconds
    stamps, arrivals = stamps[kept], arrivals[kept]
    return Figures(
        rate=(len(stamps) - 1) / (stamps[-1] - stamps[0]),
        lateness=np.percentile(lateness(stamps * rate) / rate, PERCENTILES),
        age=np.percentile(arrivals - stamps, PERCENTILES),
        cpu=cpu,
    )


def lateness(times):
    """Return how late messages are, all in periods: from when the first tick was due that had no message yet.

    The schedule lies where the most punctual messages are. Ticks that have passed when a late message comes
    are dropped: both publishers do so.
    """
    places = times % 1.0
    counts, edges = np.histogram(places, bins=_BINS, range=(0.0, 1.0))
    crowd = edges[np.argmax(counts)]
    # Around the crowd nothing wraps; its early edge is the schedule.
    around = (places - crowd + 0.5) % 1.0 - 0.5
    times = times - crowd - np.percentile(around[np.abs(around) < 2 / _BINS], 1)
    late, due = [], np.round(times[0])
    for now in times.tolist():
        late.append(max(now - due, 0.0))
        due = max(due, np.floor(now + _JITTER)) + 1
    return np.array(late)


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


def bare_runs(length):
    """Return the figures of the bare timer: at each rate, and at the lowest with more subscribers."""
    runs = {}
    for rate in RATES:
        with running("bare", "--rate", str(rate)) as process:
            for count in SUBSCRIBERS if rate == min(RATES) else (1,):
                runs[rate, count] = measure(process.pid, "/bare/joint_reference", rate, length, count)
    return runs


def publisher_runs(client, pid, length, folder):
    """Return the figures of the publisher: the same, and while it records."""
    topic, runs, recording = f"/{PUBLISHER}/joint_reference", {}, {}
    for rate in RATES:
        client.set_rate(rate)
        for count in SUBSCRIBERS if rate == min(RATES) else (1,):
            runs[rate, count] = measure(pid, topic, rate, length, count)
        bag = str(folder / f"bag_{rate:.0f}")
        client.call(StartRecording, f"{PUBLISHER}/start_recording", directory=bag)
        recording[rate] = measure(pid, topic, rate, length)
        client.call(StopRecording, f"{PUBLISHER}/stop_recording")
    return runs, recording


def milliseconds(values):
    return " / ".join(f"{value * 1e3:.2f}" for value in values)


def row(name, rate, runs, bare):
    """Return a line of the table."""
    run = runs.typical
    parts = [f"{rate:.0f}", name, f"{run.rate:.1f}", milliseconds(run.lateness), milliseconds(run.age)]
    return [
        *parts,
        milliseconds([runs.oldest]),
        f"{100 * run.cpu:.0f} %",
        percent(run.compared(bare.typical)),
    ]


def percent(differences):
    """Return by how much figures are worse, those that miss the aim in bold."""
    words = ((f"{name} {100 * value:+.0f} %", value > AIM) for name, value in differences.items())
    return ", ".join(f"**{text}**" if missed else text for text, missed in words)


def stream_table(bare, runs, recording):
    rows = []
    for rate in RATES:
        reference = bare[rate, 1]
        rows.append(row("bare timer", rate, reference, reference))
        rows.append(row("publisher", rate, runs[rate, 1], reference))
        rows.append(row("publisher, recording", rate, recording[rate], reference))
    header = [
        "Hz",
        "",
        "achieved Hz",
        "lateness [ms]",
        "age [ms]",
        "worst age [ms]",
        "CPU",
        "worse than bare",
    ]
    return table(header, rows)


def subscriber_table(bare, runs):
    rate = min(RATES)
    rows = [
        [
            count,
            *(f"{figure:.2f}" for figure in (1e3 * b.lateness[1], 1e3 * o.lateness[1])),
            *(f"{100 * run.cpu:.0f} %" for run in (b, o)),
        ]
        for count in SUBSCRIBERS
        for b, o in [(bare[rate, count].typical, runs[rate, count].typical)]
    ]
    header = ["subscribers", "bare: lateness 99 % [ms]", "publisher", "bare: CPU", "publisher"]
    return table(header, rows)


def service_table(client, count):
    with running("service"):
        bare = client.latencies(Trigger, "/service/bare", count)
    own = client.latencies(GetGait, f"{LIBRARY}/get_gait", count, **GAIT)
    rows = [
        [
            name,
            *(f"{1e3 * value:.1f}" for value in np.percentile(times, (50, 99))),
            f"{np.median(times) / np.median(bare):.1f}",
        ]
        for name, times in (("bare std_srvs/Trigger", bare), ("gait_library/get_gait of a stored gait", own))
    ]
    return table(["service", "median [ms]", "99 % [ms]", "/ bare"], rows)


def page(length, calls):
    """Measure everything and return the page; `length`: number of runs, and of seconds each takes."""
    os.environ.update(isolated_environment(os.environ))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        head = machine(("ros-rclpy", "ros-sensor-msgs", "numpy"))
        bare = bare_runs(length)
        with walking_publisher(folder, os.environ) as (client, pid):
            runs, recording = publisher_runs(client, pid, length, folder)
            services = service_table(client, calls)
    return f"""# The stream of references

{head}

Measured by `benchmarks/reference_stream.py`, beside a bare rclpy timer that publishes the same message and
nothing else; {length[0]} runs of {length[1]:g} s each, of which the median is given. The publisher also
publishes torques and commands at each tick. Lateness and age are the 50th, 99th and 99.9th percentile, the
worst age is the 99th percentile of the worst run. The last column compares rates, 99th percentiles and shares
of a core; the aim is to be within {100 * AIM:.0f} %, what misses it is bold.

A worst age far above the others is one stall: a reliable subscriber that has lost a message holds back those
after it until the middleware sends it again. A control loop should subscribe best-effort: it then goes on.

{stream_table(bare, runs, recording)}

With more subscribers, each a process of its own, at {min(RATES):.0f} Hz:

{subscriber_table(bare, runs)}

Services, {calls} calls one after the other:

{services}
"""


def main():
    """Measure, print, and save."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="short runs, to try; nothing is saved")
    args = parser.parse_args()
    text = page((1, 2.0), 20) if args.quick else page((5, 8.0), 200)
    print(text)
    if not args.quick:
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
