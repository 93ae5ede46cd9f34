"""Whether the gaits of the table are left for better ones, when the search begins near them but not at them.

Every gait is deformed at random, by a little or by a lot, and continued from there with each contact family
and with its own contacts. Where that ends near the table's F, complementarity may look for other contacts.

    .venv/bin/python benchmarks/perturbed_gaits.py
"""

import argparse
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from packaged import packaged_library
from report import machine, table

from walk_optimizer.gait import Gait, Trajectory
from walk_optimizer.model.parameters import KneeSpring, SpringMode
from walk_optimizer.optimizer.search import SAME_OPTIMUM, Candidate, Search, distinct
from walk_optimizer.request import KMH_PER_MS
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import table_solver_settings
from walk_optimizer.transcription import layout

FloatArray = NDArray[np.float64]

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "perturbed_gaits.md"
# Deformations are of this size, evenly distributed in the logarithm: in [rad] for angles, relative to the
# largest value for momenta, relative to the value for torques.
SMALLEST, LARGEST = 0.01, 0.5
HARMONICS = 5
# The hip is moved by so much of the angles' size, in [m/rad].
HIP = 0.2
# The logarithm of K varies by so many times the size, q_eq by so many.
STIFFNESS, EQUILIBRIUM = 3.0, 0.5
# Contacts are freed where F is within this factor of the table's.
NEAR = 1.25
TIME_LIMIT = 20.0  # [s] of one deformed gait
TITLE = f"""\
# Gaits from deformed gaits

Made by `.venv/bin/python benchmarks/perturbed_gaits.py --count {{count}} --seed {{seed}}`. Each gait of the
table is deformed {{count}} times by smooth random curves: the angles by {SMALLEST:g} to {LARGEST:g} rad,
momenta, torques and springs in proportion. Each is solved on the table's grid with both contact families and
with contacts of its own; where F comes within {100 * (NEAR - 1):.0f} % of the table's, complementarity looks
for other contacts. *Ended*: how many of them led to an optimum. *The table's*: at how many the best was the
table's gait, to {100 * SAME_OPTIMUM:g} % of F. *Best*: the best F of all, beside the table's.
"""


@dataclass(frozen=True)
class Returned:
    """Where the deformed copies of one gait led to.

    Attributes:
        gait: Of the table.
        objectives: F of the best optimum of each copy that led to one.
    """

    gait: Gait
    objectives: FloatArray

    @property
    def change(self) -> float:
        """The best F relative to the table's, minus 1."""
        return float(self.objectives.min(initial=math.inf)) / self.gait.objective - 1

    def row(self) -> list[str]:
        """Return the row of the page."""
        same = np.isclose(self.objectives, self.gait.objective, rtol=SAME_OPTIMUM)
        change = f"{100 * self.change:+.3f} %" if abs(self.change) > SAME_OPTIMUM else "the same"
        name = f"{self.gait.speed * KMH_PER_MS:.2f} km/h {self.gait.request.spring_mode}"
        best = f"{self.objectives.min(initial=math.inf):.5g}, {change}"
        return [name, str(self.objectives.size), str(same.sum()), f"{self.gait.objective:.5g}", best]


def deformed(gait: Gait, size: float, rng: np.random.Generator) -> Gait:
    """Return a gait whose curves and spring are moved at random.

    Args:
        gait: The gait.
        size: Of the deformation.
        rng: Source of the randomness.
    """
    points = gait.trajectory.stacked()
    angles = size * _curves(6, points.shape[1], rng)
    angles[:2] *= HIP
    points[layout.Q] += angles
    largest = np.abs(points[layout.P]).max(axis=1, keepdims=True)
    points[layout.P] += size * largest * _curves(6, points.shape[1], rng)
    points[layout.U] *= 1 + size * _curves(3, points.shape[1], rng)
    trajectory = Trajectory.from_stacked(points, gait.request.step_time)
    return replace(gait, trajectory=trajectory, spring=_deformed_spring(gait, size, rng))


def _curves(rows: int, points: int, rng: np.random.Generator) -> FloatArray:
    """Return smooth random curves of size 1, (rows, points): higher harmonics are smaller."""
    order = np.arange(HARMONICS)[:, None, None]
    sizes, phases = rng.normal(size=(2, HARMONICS, rows, 1))
    curves: FloatArray = np.sum(
        sizes / (1 + order) * np.sin(np.pi * order * np.linspace(0, 1, points) + phases), axis=0
    )
    return curves


def _deformed_spring(gait: Gait, size: float, rng: np.random.Generator) -> KneeSpring:
    spring, mode = gait.spring, gait.request.spring_mode
    if mode is SpringMode.NONE:
        return spring
    stiffness = spring.stiffness * math.exp(STIFFNESS * size * rng.normal())
    if mode is SpringMode.STIFFNESS:
        return KneeSpring(stiffness, spring.equilibrium)
    moved = spring.equilibrium + EQUILIBRIUM * size * rng.normal()
    return KneeSpring(stiffness, float(np.clip(moved, 0.1, math.pi - 1e-3)))


def _best_from(deformed_gait: Gait, table_objective: float) -> Candidate | None:
    """Return the best optimum that a deformed gait leads to; None without any."""
    settings = table_solver_settings()
    session = SolveSession(settings, TIME_LIMIT, None)
    search = Search(deformed_gait.request, deformed_gait.walker, session, settings.relaxation)
    optima = distinct(search.from_gait(deformed_gait))
    if not optima or optima[0].objective > NEAR * table_objective:
        return optima[0] if optima else None
    return search.with_free_contacts(optima[0], settings.contact_rounds, settings.contact_iterations)


def returned(gait: Gait, count: int, seed: int) -> Returned:
    """Deform a gait `count` times and search from there."""
    mode = list(SpringMode).index(gait.request.spring_mode)
    rng = np.random.default_rng([seed, round(1e4 * gait.speed), mode])
    sizes = np.exp(rng.uniform(math.log(SMALLEST), math.log(LARGEST), count))
    found = (_best_from(deformed(gait, size, rng), gait.objective) for size in sizes)
    return Returned(gait, np.array([one.objective for one in found if one is not None]))


def page(rows: Sequence[Returned], count: int, seed: int, began: str) -> str:
    """Return the page."""
    better = [one for one in rows if one.change < -SAME_OPTIMUM]
    largest = max((-one.change for one in better), default=0.0)
    most = f", by {100 * largest:.2g} % of F at most" if better else ""
    summary = f"{len(better)} of {len(rows)} entries are improved on{most}."
    header = ["gait", "ended", "the table's", "table: F", "best: F"]
    title = TITLE.format(count=count, seed=seed).strip()
    return "\n\n".join([title, summary, table(header, [one.row() for one in rows]), began])


def main() -> None:
    """Deform every gait of the packaged table, and save the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=25, help="deformations of each gait")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--output", type=Path, default=PAGE)
    args = parser.parse_args()
    gaits = packaged_library().gaits()
    began = machine()
    repeated = [[one] * len(gaits) for one in (args.count, args.seed)]
    with ProcessPoolExecutor(args.processes) as pool:
        rows = list(pool.map(returned, gaits, *repeated))
    text = page(rows, args.count, args.seed, began)
    args.output.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
