"""How far the report's own formulation gets, at the seven speeds and in the three spring modes of the report.

Each solve has a limit of iterations and of time, and runs in a process of its own. Nothing is left out.

    .venv/bin/python benchmarks/reference_formulation.py --output docs/reference_formulation.md
"""

import argparse
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from isolation import run_isolated
from packaged import packaged_library
from report import machine, save_section, table

from walk_optimizer.errors import GaitNotFoundError
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer.reference_solve import FIRST_ORDER, OPTIONS, solve_reference
from walk_optimizer.request import KMH_PER_MS, GaitRequest, gait_table_settings

HESSIANS = {"exact": OPTIONS, "first order": FIRST_ORDER}
HEADING = "Measured"


@dataclass(frozen=True)
class Trial:
    """One solve."""

    request: GaitRequest
    hessian: str
    iterations: int
    time_limit: float


def run_trial(trial: Trial) -> tuple[str, ...]:
    """Return the cells of a row: how it ended, iterations, time, worst residual, F."""
    options = replace(HESSIANS[trial.hessian], maximum_iterations=trial.iterations)
    walker = WalkerParameters.from_yaml()
    outcome = solve_reference(trial.request, walker, options=options, time_limit=trial.time_limit)
    report, worst = outcome.report, outcome.certificate.worst
    return (
        report.status.value,
        "yes" if outcome.gait is not None else "no",
        str(report.iterations),
        f"{report.solve_time:.0f}",
        f"{worst.relative:.1e}",
        f"{worst.family}, {worst.violation:.2g} {worst.unit}",
        f"{report.objective:.4g}",
    )


def measured(trial: Trial) -> tuple[str, ...]:
    """Run a trial in a process of its own."""
    result = run_isolated(run_trial, trial, time_limit=2 * trial.time_limit + 60)
    cells = result.value or (result.error, "no", "-", "-", "-", "-", "-")
    speed = f"{trial.request.speed * KMH_PER_MS:.2f}"
    row = (speed, trial.request.spring_mode.value, trial.hessian, *cells, _ours(trial.request))
    print(" | ".join(row), flush=True)
    return row


def _ours(request: GaitRequest) -> str:
    """Return F of the packaged table, brought to the trial's number of points."""
    try:
        gait = packaged_library().find(request.speed, request.spring_mode)[0]
    except GaitNotFoundError:
        return "-"
    return f"{gait.objective * request.points / gait.request.points:.4g}"


def trials(points: int, iterations: int, time_limit: float) -> list[Trial]:
    """Return all trials: every speed and mode with exact second derivatives, one without."""
    steps = gait_table_settings().table_steps()
    requests = [GaitRequest.for_step(*step, mode, points) for mode in SpringMode for step in steps]
    every = [Trial(request, "exact", iterations, time_limit) for request in requests]
    return [*every, replace(every[1], hessian="first order")]


def section(rows: list[tuple[str, ...]], args: argparse.Namespace, begun: str) -> str:
    """Return the measured section."""
    header = (
        "km/h", "springs", "second derivatives", "ended", "certified", "iterations", "time [s]",
        "worst / allowed", "worst residual", "F", "our F",
    )  # fmt: skip
    command = f"benchmarks/reference_formulation.py --points {args.points} --iterations {args.iterations}"
    gaits = sum(row[4] == "yes" for row in rows)
    return (
        f"`{command} --time-limit {args.time_limit:.0f}`: {begun}\n\n"
        f"Certified gaits: {gaits} of {len(rows)}. *Our F* is that of the packaged table (N = 200), "
        f"brought to N = {args.points}.\n\n{table(header, rows)}\n"
    )


def main() -> None:
    """Measure, print, save."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=50)
    parser.add_argument("--iterations", type=int, default=1000)
    parser.add_argument("--time-limit", type=float, default=60.0)
    parser.add_argument("--output", type=Path, help="page whose measured section is renewed")
    args = parser.parse_args()
    begun = machine()
    with ThreadPoolExecutor(2) as pool:
        rows = list(pool.map(measured, trials(args.points, args.iterations, args.time_limit)))
    text = section(rows, args, begun)
    print(text)
    if args.output is not None:
        title = args.output.read_text(encoding="utf-8").split(f"## {HEADING}")[0]
        save_section(args.output, title, (HEADING,), HEADING, text)


if __name__ == "__main__":
    main()
