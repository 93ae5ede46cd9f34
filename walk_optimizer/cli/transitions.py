"""`transitions`: list, verify and solve the steps between gaits and to and from standing."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from walk_optimizer.cli.arguments import Subparsers, add_verb, add_walker, walker_from

if TYPE_CHECKING:
    from walk_optimizer.transition.paces import Pace
    from walk_optimizer.transition.table import TransitionTable
    from walk_optimizer.transition.transition import Transition

_TEXT = """\
list, verify and solve the steps between gaits

Transitions lead from a stand into a gait, from one gait to another, and from a gait to
a stand. Those of the table's gaits ship with the package."""

_LIST = """\
list the transitions that are solved

Effort is the integral of |u|^2 / 2 over all steps; the torques are the largest ones."""

_VERIFY = """\
recompute the certificates of solved transitions

Dynamics, contact, friction, bounds, and how closely the steps join the gaits are
computed anew, apart from the solver. The exit code is 1 when one fails or a file can't
be used."""

_BUILD = """\
solve the transitions between the table's gaits that are still missing

Each is written as soon as it is certified: an interrupted build keeps what it has."""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb with its actions."""
    actions = add_verb(verbs, "transitions", _TEXT).add_subparsers(metavar="ACTION", required=True)
    for name, text, run in (
        ("list", _LIST, run_list),
        ("verify", _VERIFY, run_verify),
        ("build", _BUILD, run_build),
    ):
        parser = add_verb(actions, name, text, f"example:\n  walk-optimizer transitions {name}")
        parser.add_argument(
            "--folder", type=Path, help="folder of solved transitions (default: the user's cache)"
        )
        add_walker(parser)
        parser.set_defaults(run=run)


def _table(args: argparse.Namespace) -> "tuple[TransitionTable, list[tuple[Pace, Pace]]]":
    """Return the table and which paces it should join."""
    from walk_optimizer.library import GaitLibrary
    from walk_optimizer.transition.builder import table_pairs
    from walk_optimizer.transition.table import TransitionTable, packaged_stand

    walker = walker_from(args)
    pairs = table_pairs(packaged_stand(walker), GaitLibrary(walker).table_gaits())
    return TransitionTable(walker, args.folder), pairs


def _solved(args: argparse.Namespace) -> "Iterator[Transition]":
    """Return the transitions that there are; print a line for each file that was set aside."""
    table, pairs = _table(args)
    for pair in pairs:
        transition = table.find(*pair)
        if transition is not None:
            yield transition
    for problem in table.problems():
        print(f"set aside: {problem}", file=sys.stderr)


def _row(transition: "Transition") -> tuple[str, ...]:
    """Return what a line says about every transition."""
    from walk_optimizer.transition.paces import pace_name

    return pace_name(transition.source), pace_name(transition.target)


def run_list(args: argparse.Namespace) -> int:
    """List the transitions."""
    from walk_optimizer.cli.text import aligned, cost

    rows: list[tuple[str, ...]] = [("from", "to", "steps [m]", "in [s]", "effort", "hip [N m]", "knee [N m]")]
    for each in _solved(args):
        hip, knee = each.peak_torques
        lengths = " ".join(f"{length:.3f}" for length in each.step_lengths)
        times = " ".join(f"{time:.3f}" for time in each.step_times)
        rows.append((*_row(each), lengths, times, cost(each.torque_effort), f"{hip:.1f}", f"{knee:.1f}"))
    print(aligned(rows, left=(0, 1)))
    return 0


def run_verify(args: argparse.Namespace) -> int:
    """Verify the transitions."""
    from walk_optimizer.cli.text import aligned
    from walk_optimizer.transition.builder import recomputed

    rows: list[tuple[str, ...]] = [("from", "to", "worst family", "residual", "unit", "of allowed", "")]
    failed = 0
    for each in _solved(args):
        certificate = recomputed(each)
        worst, passed = certificate.worst, certificate.certified
        failed += not passed
        residual = (worst.family, f"{worst.violation:.2e}", worst.unit, f"{worst.relative:.1%}")
        rows.append((*_row(each), *residual, "certified" if passed else "FAILED"))
    print(aligned(rows, left=(0, 1, 2, 4, 6)))
    print(f"{len(rows) - 1} transitions, {len(rows) - 1 - failed} certified, {failed} failed")
    return 1 if failed or len(rows) == 1 else 0


def run_build(args: argparse.Namespace) -> int:
    """Solve what is missing; 1 when some have no solution."""
    from walk_optimizer.transition.builder import build_table
    from walk_optimizer.transition.paces import pace_name

    table, pairs = _table(args)
    missing = 0
    for source, target, outcome in build_table(table, pairs):
        missing += outcome.transition is None
        print(f"{pace_name(source)} -> {pace_name(target)}: {outcome.report.message}", flush=True)
    print(f"{len(pairs) - missing} of {len(pairs)} transitions solved; files in {table.folder}")
    return 1 if missing else 0
