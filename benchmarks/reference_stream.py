"""How evenly references are streamed, beside a bare rclpy timer with a bare publisher in the same run.

Every figure comes from a subscriber in another process: the stamps of the messages, and when they arrived.
The lateness of a message is how far its stamp is behind the most punctual ones of the same schedule. A
second table tells how the stream bears more subscribers, a third how soon a service answers.

    .venv/bin/python benchmarks/reference_stream.py            # 12 minutes; writes docs/benchmarks/
    .venv/bin/python benchmarks/reference_stream.py --quick    # to try: a minute and a half, prints only
"""

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np
from report import machine, table
from std_srvs.srv import Trigger
from stream_figures import Runs
from stream_graph import BARE_TOPIC, GAIT, LIBRARY, TOPIC, measured, recorded, running, walking_publisher
from walk_optimizer_interfaces.srv import GetGait

from walk_optimizer.cli.processes import isolated_environment

PAGE = Path(__file__).parent.parent / "docs" / "benchmarks" / "reference_stream.md"
RATES = (500.0, 1000.0)
SUBSCRIBERS = (1, 2, 4)
# Rate in [Hz] and number of subscribers.
CASES = (*((min(RATES), count) for count in SUBSCRIBERS), (max(RATES), 1))
# No figure is to be worse than the bare timer's by more than this part.
AIM = 0.1


def bare_round(seconds):
    """Return the figures of the bare timer in each case."""
    found = {}
    for rate, count in CASES:
        with running("bare", "--rate", str(rate)) as process:
            found[rate, count] = measured(process.pid, BARE_TOPIC, rate, count, seconds)
    return found


def publisher_round(seconds, folder):
    """Return the figures of the publisher in each case, and by rates while it records."""
    found, recording = {}, {}
    with walking_publisher(folder, os.environ) as (client, pid):
        for rate, count in CASES:
            client.set_rate(rate)
            found[rate, count] = measured(pid, TOPIC, rate, count, seconds)
        for rate in RATES:
            client.set_rate(rate)
            with recorded(client, folder / f"bag_{rate:.0f}"):
                recording[rate, 1] = measured(pid, TOPIC, rate, 1, seconds)
    return found, recording


def typical(rounds):
    """Return the runs of each case of rounds."""
    return {case: Runs.of([one[case] for one in rounds]) for case in rounds[0]}


def measured_streams(rounds, seconds):
    """Return the runs of the bare timer, of the publisher, and while it records, by cases.

    They take turns, each time with new processes, so that the machine's moods meet all of them.
    """
    results = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as name:
            results.append((bare_round(seconds), *publisher_round(seconds, Path(name))))
    return [typical(kind) for kind in zip(*results, strict=True)]


def measured_services(count):
    """Return the times in [s] of calls of a bare service, and of the library's."""
    with tempfile.TemporaryDirectory() as name, walking_publisher(Path(name), os.environ) as (client, _):
        with running("service"):
            bare = client.latencies(Trigger, "/service/bare", count)
        return bare, client.latencies(GetGait, f"{LIBRARY}/get_gait", count, **GAIT)


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
        rows.append(row("publisher, recording", rate, recording[rate, 1], reference))
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


def service_table(bare, own):
    rows = [
        [
            name,
            *(f"{1e3 * value:.1f}" for value in np.percentile(times, (50, 99))),
            f"{np.median(times) / np.median(bare):.1f}",
        ]
        for name, times in (("bare std_srvs/Trigger", bare), ("gait_library/get_gait of a stored gait", own))
    ]
    return table(["service", "median [ms]", "99 % [ms]", "/ bare"], rows)


def page(rounds, seconds, calls):
    """Measure everything and return the page.

    Args:
        rounds: Number of runs of each kind.
        seconds: That each of them takes.
        calls: Number of calls of each service.
    """
    os.environ.update(isolated_environment(os.environ))
    head = machine(("ros-rclpy", "ros-sensor-msgs", "numpy"))
    bare, runs, recording = measured_streams(rounds, seconds)
    services = service_table(*measured_services(calls))
    return f"""# The stream of references

{head}

Measured by `benchmarks/reference_stream.py`, beside a bare rclpy timer that publishes the same message and
nothing else; {rounds} rounds in which they take turns, each run with new processes and of {seconds:g} s, of
which the median is given. The publisher also publishes torques and commands at each tick. Lateness and age
are the 50th, 99th and 99.9th percentile, the worst age is the 99th percentile of the worst run. The last
column compares rates, 99th percentiles and shares of a core; the aim is to be within {100 * AIM:.0f} %, what
misses it is bold.

Measuring begins four seconds after a subscriber has joined: until then Fast DDS may once deliver nothing for
a third of a second, to this and to the bare publisher's subscribers
([why](../reference_publisher.md#subscribers-that-join)).

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
    text = page(1, 2.0, 20) if args.quick else page(5, 8.0, 200)
    print(text)
    if not args.quick:
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
