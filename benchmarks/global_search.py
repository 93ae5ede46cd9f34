"""How many starts and optima the search for each gait of the table has, and which start won.

Every entry is searched for from all kinematic guesses, and continued from its neighbours in speed and
from the spring mode with less freedom in the table that ships. No entry may be worse than any of these.

    .venv/bin/python benchmarks/global_search.py
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from packaged import packaged_library
from report import machine, table

from walk_optimizer.contact.schedule import CONTACT_FAMILIES
from walk_optimizer.gait import Gait
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.optimizer.search import SAME_OPTIMUM, Candidate, Search, distinct
from walk_optimizer.optimizer.table_builder import loosened
from walk_optimizer.request import KMH_PER_MS
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import table_solver_settings

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "global_search.md"
MODES = tuple(SpringMode)
TITLE = """\
# Global search

Made by `.venv/bin/python benchmarks/global_search.py`. *Starts*: kinematic first guesses, each solved with
single support on the coarse grid. *Optima*: their distinct optima, solved with both contact families on the
grid of the table, with F, the sum over its points of |u|^2 / 2 in (N m)^2, best first. *Slower*, *faster*
and *less freedom*: F of the optimum that continues the neighbour in speed, or the gait of the spring mode
with less freedom, of the table that ships. *Table*: F of the shipped gait, which also had its contacts
freed, and the start that won. Families are `single-impact` (the foot behind lifts as the other lands),
`double-impact` (it still stands in that instant) and `found` (contacts that complementarity found).
"""


@dataclass(frozen=True)
class Entry:
    """What was found for one entry of the table."""

    gait: Gait
    starts: int
    optima: list[Candidate]
    continued: list[float | None]

    @property
    def beaten(self) -> bool:
        """Whether anything is better than the table."""
        values = [one.objective for one in self.optima] + [one for one in self.continued if one is not None]
        return min(values) < self.gait.objective * (1 - SAME_OPTIMUM)

    def row(self) -> list[str]:
        """Return the entry as a row of the page."""
        request = self.gait.request
        shown = ", ".join(f"{one.objective:.5g}" for one in self.optima[:4])
        more = f", {len(self.optima) - 4} more" if len(self.optima) > 4 else ""
        continued = ["-" if one is None else f"{one:.5g}" for one in self.continued]
        won = f"{self.gait.objective:.5g}: {self.gait.report.start}" + (" **beaten**" if self.beaten else "")
        name = f"{self.gait.speed * KMH_PER_MS:.2f} km/h {request.spring_mode}"
        return [name, str(self.starts), f"{len(self.optima)}: {shown}{more}", *continued, won]


def _search_of(gait: Gait) -> Search:
    settings = table_solver_settings()
    session = SolveSession(settings, settings.time_limit, None)
    return Search(gait.request, gait.walker, session, settings.relaxation)


def optima_from_starts(gait: Gait) -> tuple[int, list[Candidate]]:
    """Return how many starts there are, and the distinct optima on the gait's grid that they lead to."""
    search, points = _search_of(gait), gait.request.points
    starts = kinematic_starts(gait.walker, gait.request.spring_mode)
    coarse = distinct(search.from_start(start, table_solver_settings().coarse_points) for start in starts)
    return len(starts), distinct(
        search.with_family(candidate, contacts, points, "fixed_schedule")
        for candidate, contacts in product(coarse, CONTACT_FAMILIES)
    )


def continued(gait: Gait, seed: Gait | None) -> float | None:
    """Return F of the best optimum that continues a seed; None without a seed or without an optimum."""
    if seed is None:
        return None
    optima = distinct(_search_of(gait).from_gait(loosened(seed, gait.request.spring_mode)))
    return optima[0].objective if optima else None


def measured(gait: Gait, seeds: list[Gait | None]) -> Entry:
    """Search for one entry."""
    starts, optima = optima_from_starts(gait)
    return Entry(gait, starts, optima, [continued(gait, seed) for seed in seeds])


def seeds_of(table_gaits: Sequence[Gait], gait: Gait) -> list[Gait | None]:
    """Return the slower and the faster neighbour, and the gait of the mode with less freedom."""
    mode = gait.request.spring_mode
    by_speed = sorted(
        (one for one in table_gaits if one.request.spring_mode is mode), key=lambda one: one.speed
    )
    index = by_speed.index(gait)
    slower = by_speed[index - 1] if index else None
    faster = by_speed[index + 1] if index + 1 < len(by_speed) else None
    lesser = [
        one
        for one in table_gaits
        if one.request.step_length == gait.request.step_length
        and MODES.index(one.request.spring_mode) == MODES.index(mode) - 1
    ]
    return [slower, faster, lesser[0] if lesser else None]


def main() -> None:
    """Search for every entry, two at a time, and save the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--output", type=Path, default=PAGE)
    args = parser.parse_args()
    gaits = packaged_library().gaits()
    began = machine()
    with ProcessPoolExecutor(args.processes) as pool:
        entries = list(pool.map(measured, gaits, [seeds_of(gaits, one) for one in gaits]))
    header = ["gait", "starts", "optima: F", "slower", "faster", "less freedom", "table: F, start"]
    beaten = sum(entry.beaten for entry in entries)
    summary = f"{beaten} of {len(entries)} entries are beaten by any of these."
    text = "\n\n".join([TITLE.strip(), summary, table(header, [entry.row() for entry in entries]), began])
    args.output.parent.mkdir(parents=True, exist_ok=True)
    args.output.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
