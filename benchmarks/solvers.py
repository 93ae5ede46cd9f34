"""What each back end does on the report's problems: converged by our own residuals, iterations, time, F.

Every solve runs in a process that is killed at its limit, two at a time. Failures stay in the table. SNOPT
takes part where pydrake is installed (`pip install 'walk-optimizer[snopt]'`).

    .venv/bin/python benchmarks/solvers.py --output docs/benchmarks/solvers.md
"""

import argparse
import math
import os
import resource
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from isolation import run_isolated
from other_solvers import OTHERS, available, solve_with
from report import machine, table

from walk_optimizer.certificate.grid import certify
from walk_optimizer.compiler import COMPILER_VARIABLE
from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.gait import Trajectory
from walk_optimizer.guess.kinematic import kinematic_guess
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer.search import completed
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.back_end import SolveOptions
from walk_optimizer.solve.registry import BACK_ENDS, back_end
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.solution import FloatArray, IterationState, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.problems import (
    complementarity_problem,
    fixed_schedule_problem,
    from_scaled,
    to_scaled,
)
from walk_optimizer.transcription.program import Problem

# Processor time of a solve in [s], which is the same on a busy machine.
TIME_LIMIT = 10.0
# Wall time after which a process is killed whatever it does, in [s].
LOST = 300.0
NEAR = 1e-9
# Optima whose F agree to this relative difference are taken for one.
SAME = 1e-3
SCHEDULE, COLD, WARM = "schedule", "complementarity", "complementarity, from the schedule's optimum"
STEPS = {
    "1.15 km/h, none": (0.25, 0.785, SpringMode.NONE),
    "2.44 km/h, stiffness_and_equilibrium": (0.40, 0.59, SpringMode.STIFFNESS_AND_EQUILIBRIUM),
}


@dataclass(frozen=True)
class Case:
    """One solve: which program, on how many points, by which solver."""

    gait: str
    problem: str
    points: int
    solver: str


@dataclass(frozen=True)
class Row:
    """What became of it.

    Attributes:
        says: The solver's own verdict.
        residual: Largest residual of the certificate in units of its tolerance.
        family: The family of constraints that it belongs to.
        iterations: In the solver's own count.
        seconds: Processor time of the solve, building the solver included.
        objective: F in [(N m)^2].
    """

    says: str
    residual: float = float("inf")
    family: str = "-"
    iterations: int = 0
    seconds: float = float("nan")
    objective: float = float("nan")

    @property
    def solved(self) -> bool:
        """Whether the solver says so and the residuals agree."""
        return self.says == Status.SOLVED.value and self.residual <= 1


def run_case(case: Case) -> Row:
    """Solve one case in this process."""
    if case.solver not in BACK_ENDS:
        # Some of them ask CasADi for derivatives that compiled functions do not have.
        os.environ[COMPILER_VARIABLE] = ""
    walker = WalkerParameters.from_yaml()
    request = GaitRequest.for_step(*STEPS[case.gait], case.points)
    problem, start = _posed(request, walker, case.problem)
    options = SolveOptions(solver_settings().tolerance, 1000, NEAR if case.problem == WARM else None)
    begin = _processor_time()
    limit = math.ceil(begin + TIME_LIMIT)
    # For solvers that never ask whether to go on; child processes begin at zero.
    resource.setrlimit(resource.RLIMIT_CPU, (limit + 2, limit + 2))

    def monitor(_: IterationState) -> Status | None:
        return Status.TIME_LIMIT if _processor_time() - begin > TIME_LIMIT else None

    if case.solver in BACK_ENDS:
        solution = back_end(case.solver).solve(problem, start, options, monitor)
    else:
        solution = solve_with(case.solver, problem, start, options)
    return _judged(request, walker, solution, _processor_time() - begin)


def _processor_time() -> float:
    """Return the processor time of this process and of its children that have ended in [s]."""
    return sum(os.times()[:4])


def _posed(request: GaitRequest, walker: WalkerParameters, kind: str) -> tuple[Problem, FloatArray]:
    """Return the program and its start."""
    first = kinematic_starts(walker, request.spring_mode)[0]
    start = to_scaled(walker, kinematic_guess(walker, request, first.shape), first.spring)
    schedule = fixed_schedule_problem(request, walker, single_impact(request.points))
    if kind == SCHEDULE:
        return schedule, start
    relaxed = complementarity_problem(request, walker, solver_settings().relaxation)
    if kind == COLD:
        return relaxed, start
    optimum = back_end("ipopt").solve(schedule, start, SolveOptions())
    points, spring = from_scaled(walker, optimum.x)
    return relaxed, to_scaled(walker, completed(walker, points), spring)


def _judged(request: GaitRequest, walker: WalkerParameters, solution: Solution, seconds: float) -> Row:
    points, spring = from_scaled(walker, solution.x)
    trajectory = Trajectory.from_stacked(completed(walker, points), request.step_time)
    worst = certify(walker, request, spring, trajectory).worst
    says = solution.status.value
    objective = trajectory.torque_cost
    return Row(says, worst.relative, worst.family, solution.iterations, seconds, objective)


def measured(case: Case) -> Row:
    """Solve one case in a process of its own."""
    if case.solver in BACK_ENDS and BACK_ENDS[case.solver].missing:
        return Row("not installed")
    if case.solver in OTHERS and not available(case.solver):
        return Row("library missing")
    result = run_isolated(run_case, case, time_limit=LOST)
    row = result.value if result.value is not None else Row(result.error.split(":")[0])
    print(f"{case.gait} | {case.problem} | N = {case.points} | {case.solver}: {row.says}", flush=True)
    return row


def cases(points: Sequence[int]) -> list[Case]:
    """Return all cases, those of one program together."""
    kinds = [(gait, SCHEDULE) for gait in STEPS] + [(next(iter(STEPS)), kind) for kind in (COLD, WARM)]
    programs = [(gait, kind, count) for gait, kind in kinds for count in points]
    first = programs[0]
    return [Case(*program, solver) for program in programs for solver in BACK_ENDS] + [
        Case(*first, solver) for solver in OTHERS
    ]


def section(rows: dict[Case, Row], heading: str) -> str:
    """Return the table of a kind of program."""
    lines = []
    for case, row in rows.items():
        rivals = [rows[one] for one in rows if replace(one, solver="") == replace(case, solver="")]
        best = min((one.objective for one in rivals if one.solved), default=float("nan"))
        lines.append((case.gait, case.points, case.solver, *_cells(row, best)))
    header = (
        "gait",
        "N",
        "solver",
        "converged",
        "says",
        "worst residual",
        "iterations",
        "processor time [s]",
        "F",
    )
    return f"## {heading}\n\n{table(header, lines)}\n"


def _cells(row: Row, best: float) -> tuple[str, ...]:
    if np.isnan(row.seconds):
        return ("no", row.says, "-", "-", "-", "-")
    if row.solved:
        converged = "yes" if row.objective <= best * (1 + SAME) else "**yes, to a worse optimum**"
    else:
        converged = "no"
    residual = f"{row.residual:.1e}, {row.family}"
    effort = (f"{row.iterations}", f"{row.seconds:.2f}", f"{row.objective:.5g}")
    return (converged, row.says, residual, *effort)


_TITLE = f"""# Solvers

What each back end does on the report's programs, from the same starts. `config/solver.yaml` or
`walk-optimizer solve --solver NAME` chooses one.

In short: IPOPT is the default, since it solves what the others do not, and sooner. With a given schedule
every back end finds the same optimum on coarse grids. Uno takes the fewest iterations, and ends exactly on
its bounds, but its quadratic programs become slow from N = 50 on. fatrop and SNOPT solve schedules, and not
the complementarity problem.

A solve has *converged* if its solver says so and every residual of our own certificate is within its
tolerance; *worst residual* is in units of that tolerance. F is in (N m)^2. A solver counts what it calls
iterations; for SNOPT these are evaluations. A solve may take {TIME_LIMIT:.0f} s of processor time. fatrop and
SNOPT can't be watched: where they are stopped, the row shows their start, with 0 iterations. *Code -9*: one
quadratic program went on beyond the limit, and the process was killed. `ipopt` is IPOPT with the package's
factorisation, `uno` is Uno's filter SQP, `fatrop` factorises stage by stage, `snopt` is Drake's.
"""


def page(rows: dict[Case, Row], begun: str) -> str:
    """Return the whole page."""
    headings = {
        SCHEDULE: "Contacts given by a schedule, from the kinematic guess",
        COLD: "Complementarity (relaxed), from the kinematic guess",
        WARM: "Complementarity (relaxed), from the optimum of the schedule, as the pipeline does it",
    }
    parts = [_TITLE, f"`benchmarks/solvers.py`: {begun}\n"]
    for kind, heading in headings.items():
        some = {case: row for case, row in rows.items() if case.problem == kind and case.solver in BACK_ENDS}
        parts.append(section(some, heading))
    others = {case: row for case, row in rows.items() if case.solver in OTHERS}
    ipopt = {case: row for case, row in rows.items() if case.solver == "ipopt" and _same(case, others)}
    parts.append(section(ipopt | others, "Other solvers of the CasADi wheel, on the smallest program"))
    parts.append("\n".join(f"- `{name}`: {text}" for name, text in OTHERS.items()) + "\n")
    return "\n".join(parts)


def _same(case: Case, others: dict[Case, Row]) -> bool:
    return any(replace(one, solver="") == replace(case, solver="") for one in others)


def main() -> None:
    """Measure, print, save."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, nargs="+", default=[20, 50, 200])
    parser.add_argument("--output", type=Path, help="Markdown file to write")
    args = parser.parse_args()
    begun = machine(("casadi", "drake", "numpy"))
    everything = cases(args.points)
    with ThreadPoolExecutor(2) as pool:
        rows = dict(zip(everything, pool.map(measured, everything), strict=True))
    text = page(rows, begun)
    print(text)
    if args.output is not None:
        args.output.parent.mkdir(parents=True, exist_ok=True)
        args.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
