"""Sections of `speed.py` on what a running system meets: new speeds, finer grids, start-up and memory."""

import math
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import pairwise, product

import measurements as measure
import numpy as np
from bench import (
    MODES,
    ONE_SOLVE,
    WHOLE_SEARCH,
    Bench,
    brief,
    duration,
    met,
    name_of,
    sampled_requests,
    score_of,
    table_request,
    times_text,
    verdict,
)
from isolation import Measured
from report import seconds, table

from walk_optimizer.request import GaitRequest, gait_table_settings

GROWTH_POINTS = (100, 200, 400, 800, 1200, 2000)
PLAIN_GROWTH_POINTS = (100, 200, 400)
SLOWER_NEIGHBOURS = (1, 3, 5)  # of the table, one for each spring mode
SHARES = (0.1, 0.5)  # of the way to the next speed of the table
LINEAR = 1.05  # exponent that counts as linear, for the noise of the times

RESOLVE_NOTE = """\
The start is the table's gait of the next lower speed; the new speed is a tenth of the way, or half of
it, to the next one. Ours is the [condensed method](../architecture.md#near-starts) to the tolerance of
plain, with its certificate and whatever meshes it takes. *Again* is the median of five such solves more in
the same process: ours as a running node asks for it, and what the ratios and the part of the step's
duration go by. *Plain* has the same start and keeps its mesh, without estimating its error; it is
compared as its script runs, with building its problem, and once without. *Plain without a library*
searches from its own starts on the report's grid and refines what it finds, on the same mesh. F is the
integral of |u|^2 / 2 in (N m)^2 s."""


def resolve(bench: Bench) -> str:
    """Compare new speeds from the nearest gait of the library, at refined accuracy."""
    speeds = list(pairwise(gait_table_settings().table_speeds()))
    rows, given, alone, parts = [], [], [], []
    for (index, mode), share in product(zip(SLOWER_NEIGHBOURS, MODES, strict=True), SHARES):
        low, high = speeds[index]
        neighbour = table_request(index, mode)
        request = GaitRequest.for_speed(low + share * (high - low), mode)
        label = f"{name_of(request)}, {100 * (request.speed / low - 1):.1f} % faster"
        ours = bench(
            measure.ours_resolve, request, measure.library_gait(neighbour), time_limit=ONE_SOLVE, label=label
        )
        model = measure.refined_library_gait(neighbour)
        plain, bare = (
            bench(function, request, model, time_limit=WHOLE_SEARCH, label=label)
            for function in (measure.plain_resolve, measure.plain_without_library)
        )
        time = _repeated(ours)
        given.append((duration(plain) or math.nan) / time)
        alone.append((duration(bare) or math.nan) / time)
        parts.append(time / request.step_time)
        numbers = map(times_text, (given[-1], _repeated(plain) / time, alone[-1], parts[-1]))
        rows.append([label, _with_repeat(ours), _with_repeat(plain), brief(bare), *numbers])
    longest = max(parts, key=lambda part: part if math.isfinite(part) else math.inf)
    share_text = f"Goal: below a tenth of the step's duration. Measured: at most {times_text(longest)} of it"
    head = " ".join(
        [
            verdict("100 times faster. Plain from the same start", given, 100),
            verdict("100 times faster. Plain without a library", alone, 100),
            f"{share_text}, {met(longest < 0.1)}.",
        ]
    )
    header = ["new speed", "ours", "plain", "plain without a library", "plain over ours"]
    header += ["without building", "without a library over ours", "part of the step's duration"]
    return f"{head}\n\n{RESOLVE_NOTE}\n\n{table(header, rows)}"


def _repeated(measured: Measured) -> float:
    """Return the wall time of runs after the first; not a number of a solve that failed."""
    score = score_of(measured)
    return math.nan if score is None else score.again


def _with_repeat(measured: Measured) -> str:
    score = score_of(measured)
    return brief(measured) + ("" if score is None else f"; again {seconds(score.again)}")


def growth(bench: Bench) -> str:
    """Fit the cost of one solve with given contacts against N."""
    rows, fits, reached = [], [], False
    for name, function, sizes in (
        ("ours", measure.ours_growth, GROWTH_POINTS),
        ("plain", measure.plain_growth, PLAIN_GROWTH_POINTS),
    ):
        runs = {
            points: bench(function, points, time_limit=WHOLE_SEARCH, label=f"N {points}") for points in sizes
        }
        rows += [_growth_row(name, points, run) for points, run in runs.items()]
        solved = {points: score for points, run in runs.items() if (score := score_of(run)) is not None}
        if len(solved) > 1:
            whole = exponent(list(solved), [one.seconds for one in solved.values()])
            each = exponent(list(solved), [one.again / one.iterations for one in solved.values()])
            fits.append(f"{name} N^{whole:.2f}, per iteration N^{each:.2f}")
            reached |= name == "ours" and max(whole, each) <= LINEAR
    note = (
        "One solve at 1.92 km/h without springs with contacts given, from the kinematic guess. The number of "
        "iterations depends on N too. *Again* is the same solve a second time in the same process."
    )
    header = ["", "N", "first", "again", "again, per iteration", "peak memory"]
    head = f"Goal: at most linear. Fitted: {'; '.join(fits)}; {met(reached)}."
    return f"{head}\n\n{note}\n\n{table(header, rows)}"


def _growth_row(name: str, points: int, run: Measured) -> list[object]:
    score = score_of(run)
    numbers = ["-", "-"]
    if score is not None:
        numbers = [seconds(score.again), seconds(score.again / max(1, score.iterations))]
    return [name, points, brief(run), *numbers, f"{run.peak_memory:.0f} MB"]


def exponent(points: Sequence[int], values: Sequence[float]) -> float:
    """Return the slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(points), np.log(values), 1)[0])


_RUN = [sys.executable, "-c"]
STARTS = {
    "import walk_optimizer": [*_RUN, "import walk_optimizer"],
    "import walk_optimizer.optimizer": [*_RUN, "import walk_optimizer.optimizer"],
    "walk-optimizer --help": [sys.executable, "-m", "walk_optimizer.cli.main", "--help"],
}
COMPARISONS = {
    "Python alone": [*_RUN, "pass"],
    "import casadi": [*_RUN, "import casadi"],
    "import casadi, scipy.integrate": [*_RUN, "import casadi, scipy.integrate"],
}


def startup(bench: Bench) -> str:
    """Measure the start of the package and of the command, and the memory of a solve."""
    rows, slowest = [], 0.0
    for name, command in {**STARTS, **COMPARISONS}.items():
        times = [_run_time(command) for _ in range(7)]
        rows.append([name, seconds(min(times)), seconds(max(times))])
        slowest = max(slowest, min(times)) if name in STARTS else slowest
    memory, largest = [], 0.0
    for request in sampled_requests():
        label = f"{name_of(request)}, search and refinement"
        run = bench(measure.ours_search, request, True, time_limit=ONE_SOLVE, label=label)
        largest = max(largest, run.peak_memory)
        memory.append([label, brief(run), f"{run.peak_memory:.0f} MB"])
    head = (
        f"Goal: import and `--help` below 0.5 s. Measured: {seconds(slowest)}, {met(slowest < 0.5)}. "
        f"Goal: a solve below 500 MB. Measured: {largest:.0f} MB, {met(largest < 500)}."
    )
    starts = table(["start", "least of 7", "largest"], rows)
    return f"{head}\n\n{starts}\n\n{table(['solve', 'result', 'peak memory'], memory)}"


def _run_time(command: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - began
