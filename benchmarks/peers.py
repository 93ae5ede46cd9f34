"""What a user would pick instead, on the same walker, speed and first guess, judged by our certificate.

Each solve runs in a process of its own with a time limit; a peer that is missing gets a row that says so.
`requirements-peers.txt` says how to install them:

    PYTHONPATH=. peers/bin/python benchmarks/peers.py
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import measurements as measure
import peer_opty
import peer_solvers
from bench import name_of, score_of, table_request
from isolation import Measured, run_isolated
from report import machine, seconds, table

from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import GaitRequest

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "peers.md"
PACKAGES = ("casadi", "pympcc", "cyipopt-wheels", "pounce-solver", "drake", "opty", "sympy")
SPEED_INDEX = 1  # of the table: 1.15 km/h
# Time on top of a solver's own limit, for building its problem and for the last iteration, in [s].
BUILDING = 60.0
MODULES = {"pympcc": "pympcc", "pounce": "pounce", "SNOPT": "pydrake", "opty": "opty"}
TITLE = """\
# Peers

Made by `PYTHONPATH=. peers/bin/python benchmarks/peers.py`; `benchmarks/requirements-peers.txt` says how to
install the peers. All solve for the same gait of the same walker from the same kinematic first guess, on the
report's grid of N points, with exact sparse derivatives from CasADi. Times include building the problem. F is
the sum over the grid points of |u|^2 / 2 in (N m)^2 and depends on N. The residual is the worst of the
package's certificate in units of its tolerance: above 1 is no gait, whatever the solver says of it.

- *walk_optimizer* and *plain Opti* solve with given contacts, then the relaxed complementarity problem.
- *pympcc* solves the complementarity problem by its Scholtes method from the first guess, with its own
  sequence of relaxations down to ours.
- *pounce* is a port of IPOPT: given contacts, then the relaxed problem, as the plain transcription does.
- *SNOPT* (in Drake's wheel) solves the relaxed problem from the first guess, the bound on the products being
  driven to ours in three solves. It uses no second derivatives, so its grids are small.
- *opty* has no complementarity: its ground is smooth, a damped spring that gives 5 mm under the weight with
  friction that sets in over 0.1 m/s, so it solves another problem; firmer ground did not converge. It gives
  IPOPT no second derivatives. It is judged as the others are, which it can't meet; F is of its own problem.
"""


@dataclass(frozen=True)
class Entry:
    """A row: who solves, on how many points, by which function.

    Attributes:
        name: Of the peer.
        module: That has to be there.
        points: N.
        solve: Takes the request.
        limit: Time limit of the process in [s].
    """

    name: str
    module: str
    points: int
    solve: Callable[[GaitRequest], measure.Score]
    limit: float


def entries() -> list[Entry]:
    """Return all rows."""
    ours = partial(measure.ours_one_start, free_contacts=True)
    plain = partial(measure.plain_one_start, free_contacts=True)
    rows = [Entry("walk_optimizer", "walk_optimizer", points, ours, BUILDING) for points in (20, 50, 200)]
    rows += [
        Entry("walk_optimizer, whole search", "walk_optimizer", 200, measure.ours_search, 120.0),
        Entry("plain Opti", "casadi", 200, plain, 120.0),
    ]
    for name, points, function, limit in (
        ("pympcc", 50, peer_solvers.pympcc, 60.0),
        ("pympcc", 200, peer_solvers.pympcc, 100.0),
        ("pounce, given contacts", 200, partial(peer_solvers.pounce, free_contacts=False), 60.0),
        ("pounce", 200, partial(peer_solvers.pounce, free_contacts=True), 60.0),
        ("SNOPT", 10, peer_solvers.snopt, 30.0),
        ("SNOPT", 20, peer_solvers.snopt, 45.0),
        ("SNOPT", 50, peer_solvers.snopt, 75.0),
        ("opty, smooth contact", 50, peer_opty.opty, 90.0),
    ):
        module = MODULES[name.split(",")[0]]
        rows.append(Entry(name, module, points, partial(function, time_limit=limit), limit + BUILDING))
    return rows


def row_of(entry: Entry, measured: Measured) -> list[object]:
    """Return the cells of an entry."""
    score = score_of(measured)
    if score is None:
        return [entry.name, entry.points, "-", "-", "-", "-", f"**{measured.error}**"]
    verdict = "certified" if score.certified else f"**{score.family} x {score.residual:.2g}**"
    steps = score.iterations or "-"
    return [
        *(entry.name, entry.points, seconds(score.seconds), steps, f"{score.objective:.5g}"),
        *(verdict, score.status.split(",")[0]),
    ]


def measured(entry: Entry) -> Measured:
    """Return what the entry's process returned."""
    if find_spec(entry.module) is None:
        return Measured(None, f"{entry.module} is not installed")
    # The grid may be coarser than what the package lets users ask for.
    request = replace(table_request(SPEED_INDEX, SpringMode.NONE), points=entry.points)
    return run_isolated(entry.solve, request, time_limit=entry.limit)


def main() -> None:
    """Run all peers and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="NAME", help="only peers whose name contains this")
    parser.add_argument("--output", type=Path, default=PAGE, help="Markdown page to write")
    args = parser.parse_args()
    where, rows = machine(PACKAGES), []
    for entry in entries():
        if args.only in entry.name:
            rows.append(row_of(entry, measured(entry)))
            print(*rows[-1], sep=" | ", flush=True)
    header = ["solver", "N", "time", "iterations", "F", "our residuals", "what it says"]
    name = name_of(table_request(SPEED_INDEX, SpringMode.NONE))
    text = f"{TITLE}\n{name}:\n\n{table(header, rows)}\n\n{where}\n"
    print(f"\n{text}")
    args.output.parent.mkdir(parents=True, exist_ok=True)
    args.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
