"""How often a request within the walker's range ends with a certified gait.

Draws walkers (masses and lengths within a factor of 1.4 of the report's, friction 0.4 to 1.2), steps,
spring modes and grids, asks for each gait from scratch, and counts. Nothing is left out: a request
without a gait stays in the table with the reason.

    .venv/bin/python benchmarks/random_requests.py --count 200 --output docs/random_requests.md
"""

import argparse
import math
import os
import platform
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi
import numpy as np
from report import table

from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import Outcome, optimize
from walk_optimizer.request import GaitRequest, gait_table_settings

TIME_LIMIT = 120.0
HEADINGS = ["seed", "step [m]", "step [s]", "springs", "N", "what is missing"]
_SPREAD = math.log(1.4)


@dataclass(frozen=True)
class Trial:
    """One random request and what became of it."""

    seed: int
    request: GaitRequest
    outcome: Outcome


def random_walker(random: np.random.Generator) -> WalkerParameters:
    """Return a walker near the report's."""
    nominal = WalkerParameters()
    names = ("hip_mass", "upper_leg_mass", "lower_leg_mass", "upper_leg_length", "lower_leg_length")
    values = {name: getattr(nominal, name) * math.exp(random.uniform(-_SPREAD, _SPREAD)) for name in names}
    return WalkerParameters(**values, friction_coefficient=random.uniform(0.4, 1.2))


def random_request(random: np.random.Generator) -> GaitRequest:
    """Return a step within the range of speeds that may be asked for."""
    settings = gait_table_settings()
    length = random.uniform(0.15, 0.55)
    speed = random.uniform(settings.minimum_speed, settings.maximum_speed)
    mode = list(SpringMode)[random.integers(3)]
    return GaitRequest.for_step(length, length / speed, mode, random.integers(40, 101))


def run_trial(seed: int) -> Trial:
    """Ask for the gait of a seed."""
    random = np.random.default_rng(seed)
    walker, request = random_walker(random), random_request(random)
    return Trial(seed, request, optimize(request, walker, time_limit=TIME_LIMIT))


def summary(trials: Sequence[Trial]) -> str:
    """Return the counts and a row for each request without a gait, as Markdown."""
    solved = [one.outcome.gait for one in trials if one.outcome.gait is not None]
    refined = sum(gait.refined is not None for gait in solved)
    times = np.array([one.outcome.report.solve_time for one in trials])
    statuses = Counter(one.outcome.report.status.value for one in trials)
    lines = [
        "# Random requests",
        "",
        (
            f"Made by `benchmarks/random_requests.py --count {len(trials)}`: {platform.machine()}, "
            f"{os.cpu_count()} cores, Python {platform.python_version()}, CasADi {casadi.__version__}, "
            f"time limit {TIME_LIMIT:.0f} s."
        ),
        "",
        f"- certified gaits: {len(solved)} of {len(trials)} ({100 * len(solved) / len(trials):.1f} %)",
        f"- of them refined and certified on the refined grid too: {refined}",
        f"- how they ended: {', '.join(f'{count} {name}' for name, count in statuses.most_common())}",
        (
            f"- time of a request, one after the other: median {np.median(times):.1f} s, "
            f"90 % {np.quantile(times, 0.9):.1f} s, largest {times.max():.1f} s"
        ),
    ]
    short = [one for one in trials if one.outcome.gait is None or one.outcome.gait.refined is None]
    if short:
        lines += ["", table(HEADINGS, map(missing, short))]
    return "\n".join(lines) + "\n"


def missing(trial: Trial) -> list[object]:
    """Return the row of a request that has no gait, or none on the refined grid."""
    request, outcome = trial.request, trial.outcome
    what = outcome.report.message if outcome.gait is None else "refinement"
    step = [f"{request.step_length:.3f}", f"{request.step_time:.3f}"]
    return [trial.seed, *step, request.spring_mode.value, request.points, what]


def main() -> None:
    """Run the trials and write the summary."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200, help="number of requests")
    parser.add_argument("--output", type=Path, help="Markdown file to write")
    args = parser.parse_args()
    trials = []
    for seed in range(args.count):
        trials.append(run_trial(seed))
        print(f"{seed + 1}/{args.count}: {trials[-1].outcome.report.status.value}", flush=True)
    text = summary(trials)
    print(text)
    if args.output is not None:
        args.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
