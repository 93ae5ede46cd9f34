"""How often a subscriber gets nothing for a while after it, or another one, has joined the graph.

Three subscribers at a time join a bare rclpy publisher of 500 Hz, and our publisher, while one that joined
long before listens on. All are processes of their own, over shared memory and over UDP.

    .venv/bin/python benchmarks/joining_subscribers.py    # 4 minutes; writes docs/benchmarks/
"""

import argparse
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np
from report import machine, table
from stream_graph import BARE_TOPIC, TOPIC, helper, noted, running, walking_publisher

from walk_optimizer.cli.processes import isolated_environment

PAGE = Path(__file__).parent.parent / "docs" / "benchmarks" / "joining_subscribers.md"
RATE = 500.0
TOGETHER, TIMES = 3, 8
# Heartbeats come every 3 s: that long after joining all has been opened that will be, in [s].
LISTENING = 5.0
# Fast DDS waits for 333 ms; a subscriber that the kernel holds up is late by less, in [s].
GAP = 0.25
# rmw_fastrtps takes shared memory in any case where discovery is limited to this machine.
TRANSPORTS = {
    "shared memory": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
    "UDP": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"},
}


def gaps(received: np.ndarray) -> list[float]:
    """Return the gaps between arrivals in [s] that are no jitter."""
    arrivals = received[:, 1] * 1e-9
    return [float(after - before) for before, after in pairwise(arrivals) if after - before > GAP]


def joined(topic: str) -> tuple[list[list[float]], list[float]]:
    """Return the gaps of each subscriber that joins, and of the one that was there before."""
    former = helper("listener", "--topic", topic)
    time.sleep(LISTENING)
    begun, found = time.time_ns(), []
    for _ in range(TIMES):
        joining = [helper("listener", "--topic", topic) for _ in range(TOGETHER)]
        time.sleep(LISTENING)
        found += [gaps(one) for one in noted(joining)]
    (received,) = noted([former])
    return found, gaps(received[received[:, 1] > begun])


@contextmanager
def bare() -> Iterator[str]:
    """Run the bare publisher; the context is its topic."""
    with running("bare", "--rate", str(RATE)):
        yield BARE_TOPIC


@contextmanager
def ours() -> Iterator[str]:
    """Run our publisher; the context is its topic."""
    with tempfile.TemporaryDirectory() as name, walking_publisher(Path(name), os.environ) as (client, _):
        client.set_rate(RATE)
        yield TOPIC


def line(transport: str, publisher: str, topic: str) -> list[str]:
    """Return a row of the table."""
    found, former = joined(topic)
    held = sum(bool(one) for one in found)
    longest = max((gap for one in (*found, former) for gap in one), default=0.0)
    return [transport, publisher, f"{held} of {len(found)}", f"{len(former)}", f"{1e3 * longest:.0f} ms"]


def main() -> None:
    """Measure, print, and save."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    head = machine(("ros-rclpy", "ros-rmw-fastrtps-cpp", "ros-fastrtps"))
    rows = []
    for transport, variables in TRANSPORTS.items():
        os.environ.update(isolated_environment({**os.environ, **variables}))
        for name, publisher in (("bare rclpy publisher", bare), ("reference_publisher", ours)):
            with publisher() as topic:
                rows.append(line(transport, name, topic))
    header = ["transport", "publisher", "joined and had a gap", "gaps of the one before", "longest gap"]
    text = f"""# Subscribers that join

{head}

Made by `.venv/bin/python benchmarks/joining_subscribers.py`: {TOGETHER} subscribers at a time join a
stream of {RATE:.0f} Hz, {TIMES} times, and listen for {LISTENING:g} s; one more has joined before
them and listens all the time. A gap is a time of more than {1e3 * GAP:.0f} ms between two messages.

{table(header, rows)}

[Where the gaps come from](../reference_publisher.md#subscribers-that-join).
"""
    print(text)
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
