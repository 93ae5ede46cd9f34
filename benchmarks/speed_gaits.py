"""Sections of `speed.py` on gaits from nothing: single requests, and the whole table."""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import measurements as measure
from bench import (
    MODES,
    ONE_SOLVE,
    WHOLE_SEARCH,
    Bench,
    brief,
    duration,
    name_of,
    quotients,
    sampled_requests,
    table_request,
    times_text,
    verdict,
)
from isolation import Measured, run_isolated
from report import seconds, table

from walk_optimizer.cli.library_build import former_gaits
from walk_optimizer.gait import Gait
from walk_optimizer.request import GaitRequest, gait_table_settings

WHOLE_TABLE = 3600.0  # time limit in [s]

COLD_NOTE = """\
*One start* is the first kinematic guess on the full grid, the same for both. *Contacts free* adds the
relaxed complementarity problem: plain solves it to the end, ours takes its first iterations, in rounds, and
solves the contacts that it moves to. The *whole search* tries all starts: ours on a coarse grid first, plain
on the full one, with its problem built once. Compiled stage functions are in the cache, except for *nothing
compiled yet*. One start: the faster of two runs; searches: one run."""


def cold(bench: Bench) -> str:
    """Compare single requests from nothing: one start, and the whole search."""
    rows: list[list[str]] = []
    ratios: dict[str, list[float]] = {}
    for request in sampled_requests():
        name = name_of(request)
        for text, free in (("contacts given", False), ("contacts free", True)):
            functions = (measure.ours_one_start, measure.plain_one_start)
            label = f"{name}, one start, {text}"
            pair = [
                bench(one, request, free, time_limit=ONE_SOLVE, label=label, times=2) for one in functions
            ]
            rows.append(_compared(name, f"one start, {text}", *pair))
            ratios.setdefault(f"One start, {text}", []).append(quotients(pair[1], pair[0])[0])
        plain = bench(measure.plain_search, request, time_limit=WHOLE_SEARCH, label=name)
        ours = bench(measure.ours_search, request, time_limit=ONE_SOLVE, label=name)
        bare = bench(measure.ours_search_without_cache, request, time_limit=ONE_SOLVE, label=name)
        rows.append(_compared(name, "whole search", ours, plain))
        rows.append(_compared(name, "the same, nothing compiled yet", bare, plain))
        ratios.setdefault("Whole search", []).append(quotients(plain, ours)[0])
    header = ["request", "what", "ours", "plain", "ratio", "of processor time"]
    verdicts = " ".join(verdict(f"10 times faster. {what}", values, 10) for what, values in ratios.items())
    return f"{verdicts}\n\n{COLD_NOTE}\n\n{table(header, rows)}"


def _compared(name: str, what: str, ours: Measured, plain: Measured) -> list[str]:
    """Return a row of both sides and their ratios."""
    return [name, what, brief(ours), brief(plain), *map(times_text, quotients(plain, ours))]


@dataclass(frozen=True)
class Build:
    """A build of the library.

    Attributes:
        seconds: Wall time.
        processor: Processor time.
        gaits: What it stored.
    """

    seconds: float
    processor: float
    gaits: list[Gait]


def build_library() -> Build:
    """Run `walk-optimizer library build` into an empty folder; gaits that it does not find are missing."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        program = [sys.executable, "-m", "walk_optimizer.cli.main", "library", "build"]
        began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [*program, "--output", str(folder)], check=False, timeout=WHOLE_TABLE, stdout=subprocess.DEVNULL
        )
        after, elapsed = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - began
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        stored = former_gaits(folder, measure.walker())
    print(f"library build: {len(stored)} gaits in {seconds(elapsed)}", flush=True)
    return Build(elapsed, spent, stored)


def searched_once() -> float:
    """Return the wall time in [s] of a search and refinement of every entry, in one process."""
    requests = [table_request(index, mode) for mode in MODES for index in range(gait_table_settings().gaits)]
    run = run_isolated(measure.ours_table, requests, time_limit=WHOLE_TABLE)
    if run.value is None:
        raise RuntimeError(f"the table could not be measured: {run.error}")
    for request, score in zip(requests, run.value, strict=True):
        print(f"ours, {name_of(request)}, refined: {seconds(score.seconds)}", flush=True)
    return sum(score.seconds for score in run.value)


@dataclass(frozen=True)
class PlainEntry:
    """An entry of the table in the plain transcription: its search, and the refinement of what was found."""

    request: GaitRequest
    found: Measured
    refined: Measured

    @property
    def seconds(self) -> float:
        """Wall time of both; of a search that failed the time that it was given."""
        return (duration(self.found) or WHOLE_SEARCH) + (duration(self.refined) or 0.0)

    @classmethod
    def measured(cls, bench: Bench, request: GaitRequest) -> "PlainEntry":
        name = name_of(request)
        found = bench(measure.plain_search, request, time_limit=WHOLE_SEARCH, label=name)
        refined = Measured(None, "nothing to refine")
        if found.value is not None:
            arguments = (request, found.value[1], measure.refined_library_gait(request))
            refined = bench(measure.plain_refinement, *arguments, time_limit=ONE_SOLVE, label=name)
        return cls(request, found, refined)


def whole_table(bench: Bench, speeds: Sequence[int]) -> str:
    """Compare the build of the library with search and refinement of entries in the plain transcription.

    Args:
        bench: Measures.
        speeds: Indices of the speeds that plain is measured on; the others are extrapolated.
    """
    once = searched_once()
    build = build_library()
    best = {(gait.request.step_length, gait.request.spring_mode): gait for gait in build.gaits}
    entries = [PlainEntry.measured(bench, table_request(index, mode)) for mode in MODES for index in speeds]
    count = gait_table_settings().gaits
    total = sum(count / len(speeds) * entry.seconds for entry in entries)
    rows = []
    for entry in entries:
        ours = best.get((entry.request.step_length, entry.request.spring_mode))
        objective = "-" if ours is None else f"{ours.objective:.5g}"
        rows.append([name_of(entry.request), objective, brief(entry.found), brief(entry.refined)])
    header = ["entry", "our F", "plain search", "plain refinement"]
    head = verdict("20 times faster", [total / once], 20)
    note = (
        f"Each of the {count * len(MODES)} gaits searched for and refined once, one after the other in "
        f"one process: {seconds(once)}."
    )
    return f"{head}\n\n{note} {_table_note(build, total, len(speeds), count)}\n\n{table(header, rows)}"


def _table_note(build: Build, total: float, measured: int, count: int) -> str:
    share = "all entries"
    if measured < count:
        share = f"{measured} of {count} speeds of each mode and extrapolated to the others of the mode"
    refined = sum(gait.refined is not None for gait in build.gaits)
    return (
        f"`walk-optimizer library build`: {len(build.gaits)} certified gaits, {refined} of them refined, in "
        f"{seconds(build.seconds)} on {os.cpu_count()} cores, {seconds(build.processor)} of processor time; "
        f"{times_text(total / build.seconds)} times as fast as plain; it searches longer, continues every "
        "entry from its neighbours and refines all good optima, which plain does not. Plain, in one process "
        f"as a script does it: {seconds(total)}, measured on {share}; a search that fails counts with the "
        f"time that it was given. Ratio of processor times: {times_text(total / build.processor)}. Plain "
        "refinement has the phases and the adapted mesh of the shipped gait; its F is the integral of "
        "|u|^2 / 2 in (N m)^2 s."
    )
