"""Runs measurements, each once, and puts them into words."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from isolation import Measured, run_isolated
from measurements import Score
from report import seconds

from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import KMH_PER_MS, GaitRequest, gait_table_settings

ONE_SOLVE, WHOLE_SEARCH = 300.0, 1200.0  # time limits in [s]
MODES = tuple(SpringMode)
SAMPLED_SPEEDS = (0, 3, 6)  # of the table: slow, middle, fast


class Bench:
    """Measures, and tells what it does. The same measurement of two sections is made once."""

    def __init__(self) -> None:
        self._known: dict[Any, Measured] = {}

    def __call__(
        self, function: Callable[..., Any], *arguments: Any, time_limit: float, label: str, times: int = 1
    ) -> Measured:
        """Return the fastest of some runs of a function, each in a new process.

        Args:
            function: What is measured.
            arguments: Of the function.
            time_limit: Of a run in [s].
            label: Names the arguments.
            times: Number of runs.
        """
        key = (function, label)
        if key not in self._known:
            runs = [run_isolated(function, *arguments, time_limit=time_limit) for _ in range(times)]
            self._known[key] = min(runs, key=lambda one: duration(one) or math.inf)
            print(f"{function.__name__}, {label}: {brief(self._known[key])}", flush=True)
        return self._known[key]


def score_of(measured: Measured) -> Score | None:
    """Return the score of a measurement, which may stand first in a tuple; None of a failure."""
    return measured.value[0] if isinstance(measured.value, tuple) else measured.value


def duration(measured: Measured) -> float | None:
    """Return the wall time in [s]; None of a failure."""
    score = score_of(measured)
    return None if score is None else score.seconds


def quotients(theirs: Measured, ours: Measured) -> tuple[float, float]:
    """Return the ratios of wall time and of processor time; not numbers where either failed."""
    above, below = score_of(theirs), score_of(ours)
    if above is None or below is None:
        return math.nan, math.nan
    return above.seconds / below.seconds, above.processor / below.processor


def brief(measured: Measured) -> str:
    """Return time, iterations, F and a residual that is too large; of a failure the reason."""
    score = score_of(measured)
    if score is None:
        return f"**{measured.error}**"
    steps = f" ({score.iterations} it.)" if score.iterations else ""
    text = f"{seconds(score.seconds)}{steps}, F {score.objective:.5g}"
    return text if score.certified else f"{text}, **{score.status}, {score.family} x {score.residual:.2g}**"


def times_text(value: float) -> str:
    """Return a ratio; a dash where there is none."""
    return f"{value:.3g}" if math.isfinite(value) else "-"


def verdict(goal: str, ratios: Iterable[float], least: float) -> str:
    """Return the line on a goal: geometric mean and range of the ratios that were measured."""
    known = [one for one in ratios if math.isfinite(one)]
    if not known:
        return f"Goal: {goal}. Nothing could be compared."
    mean = math.exp(float(np.mean(np.log(known))))
    spread = f" (from {min(known):.3g} to {max(known):.3g})" if len(known) > 1 else ""
    return f"Goal: {goal}. Measured: {mean:.3g} times{spread}, {met(mean >= least)}."


def met(reached: bool) -> str:
    """Return whether a goal is met."""
    return "met" if reached else "**missed**"


def table_request(index: int, mode: SpringMode) -> GaitRequest:
    """Return the request of an entry of the table."""
    return GaitRequest.for_step(*gait_table_settings().table_steps()[index], mode)


def sampled_requests() -> list[GaitRequest]:
    """Return a slow, a middle and a fast request, each of another spring mode."""
    return [table_request(*one) for one in zip(SAMPLED_SPEEDS, MODES, strict=True)]


def name_of(request: GaitRequest) -> str:
    """Return speed and springs of a request."""
    return f"{request.speed * KMH_PER_MS:.2f} km/h {request.spring_mode.value}"
