"""What the linear solver below IPOPT costs: the package's factorisation beside MUMPS.

The same programs from the same starts by the same IPOPT; only the linear solver differs.

    .venv/bin/python benchmarks/linear_solvers.py
"""

import argparse
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from measurements import growth_request, library_gait, walker
from report import machine, ratio, save_section, seconds, table

from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.guess.kinematic import kinematic_guess
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.refinement.mesh_adaptation import resampled
from walk_optimizer.refinement.resolve import mesh_of
from walk_optimizer.refinement.solves import BARRIER
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve import ipopt
from walk_optimizer.solve.ipopt import IpoptOptions
from walk_optimizer.transcription.problems import fixed_schedule_problem, to_scaled
from walk_optimizer.transcription.program import FloatArray, Problem
from walk_optimizer.transcription.refined import RefinedProblem

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "linear_solvers.md"
TITLE = """\
# Linear solvers

Made by `.venv/bin/python benchmarks/linear_solvers.py`: the same programs, starts and IPOPT, only the linear
solver differs. *ours* is the package's multifrontal factorisation
([how it works](../architecture.md#linear-algebra)); *MUMPS* is IPOPT's own with its default ordering, *MUMPS,
AMD* with approximate minimum degree, which the package takes where there is no C compiler. Times are of the
second run in a process, when everything is built and compiled; the fastest of three.
"""
HEADING = "Time of a solve and of an iteration"
MUMPS = (("linear_solver", "mumps"),)
SOLVERS = {
    "ours": (),
    "MUMPS, AMD": (*MUMPS, ("mumps_pivot_order", 0)),
    "MUMPS": (*MUMPS, ("mumps_pivot_order", 7)),
}
SIZES = (50, 200, 800, 2000)
RUNS = 3


@dataclass(frozen=True)
class Case:
    """A program and its start."""

    name: str
    problem: Problem
    start: FloatArray
    barrier: float | None


def schedule_case(points: int) -> Case:
    """Return a solve with given contacts from the kinematic guess."""
    request = growth_request(points)
    first = kinematic_starts(walker(), request.spring_mode)[0]
    problem = fixed_schedule_problem(request, walker(), single_impact(points))
    guess = kinematic_guess(walker(), request, first.shape)
    return Case(f"contacts given, N = {points}", problem, to_scaled(walker(), guess, first.spring), None)


def refined_case(speed: float, mode: str) -> Case:
    """Return a refined gait of the table solved again a little faster."""
    gait = library_gait(GaitRequest.for_speed(speed, mode))
    mesh = mesh_of(gait, gait.refined)
    faster = GaitRequest.for_speed(gait.request.speed * 1.01, mode)
    refined = RefinedProblem(faster, walker(), mesh)
    points = resampled(gait.refined.trajectory, gait.refined.spring, mesh, mesh)
    name = f"refined, {mode}, {mesh.intervals} intervals"
    return Case(name, refined.problem(), refined.pack(points), BARRIER)


def measured(case: Case, further: tuple) -> tuple[float, int, float]:
    """Return time in [s], iterations and scaled objective of the fastest run."""
    options = IpoptOptions(barrier=case.barrier, further=further)
    solve = partial(ipopt.solve, case.problem, case.start, options)
    solve()
    times = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        solution = solve()
        times.append(time.perf_counter() - begin)
        if not solution.solved:
            return np.nan, solution.iterations, np.nan
    return min(times), solution.iterations, solution.objective


def rows_of(case: Case) -> list[list[str]]:
    """Return one row a solver."""
    rows, ours = [], None
    for name, further in SOLVERS.items():
        spent, iterations, objective = measured(case, further)
        each = spent / max(1, iterations)
        ours = each if ours is None else ours
        row = [case.name, name, seconds(spent), str(iterations), seconds(each), ratio(each, ours)]
        rows.append([*row, f"{objective:.8g}"])
        print(" | ".join(rows[-1]), flush=True)
    return rows


def main() -> None:
    """Measure all cases and save the page."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    where = machine()
    cases = [
        *(schedule_case(points) for points in SIZES),
        refined_case(0.3185, "none"),
        refined_case(0.857, "stiffness_and_equilibrium"),
    ]
    rows = [row for case in cases for row in rows_of(case)]
    header = [
        "program",
        "linear solver",
        "solve",
        "iterations",
        "an iteration",
        "times ours",
        "objective, scaled",
    ]
    save_section(PAGE, TITLE, [HEADING], HEADING, f"{table(header, rows)}\n\n{where}")


if __name__ == "__main__":
    main()
