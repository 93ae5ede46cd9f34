"""`library`: build, verify and list the table of gaits."""

import argparse
import sys
from pathlib import Path

from walk_optimizer.cli import library_build
from walk_optimizer.cli.arguments import Subparsers, add_library, add_verb, add_walker, walker_from

_TEXT = """\
build, verify and list the table of gaits

The table of seven speeds and three spring modes ships with the package. Gaits of your
own are stored in your cache folder, beside it."""

_VERIFY = """\
recompute the certificates of stored gaits

Dynamics, contact, friction, bounds, periodicity and speed are computed anew, apart from
the solver. Each line names the family that comes closest to its tolerance. The exit code
is 1 when a gait fails or a file can't be read."""

_LIST = """\
list the gaits that the library holds

F% relates F to the gait without springs at the same speed and number of points."""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb with its actions."""
    actions = add_verb(verbs, "library", _TEXT).add_subparsers(metavar="ACTION", required=True)
    library_build.add_parser(actions)
    verify = add_verb(actions, "verify", _VERIFY, "example:\n  walk-optimizer library verify")
    verify.add_argument("--folder", type=Path, help="gait files (default: those that ship with the package)")
    add_walker(verify)
    verify.set_defaults(run=run_verify)
    listing = add_verb(actions, "list", _LIST)
    add_walker(listing)
    add_library(listing)
    listing.set_defaults(run=run_list)


def run_verify(args: argparse.Namespace) -> int:
    """Verify a folder."""
    from walk_optimizer.cli.text import aligned
    from walk_optimizer.library import table_folder
    from walk_optimizer.library.verification import verify_folder
    from walk_optimizer.request import KMH_PER_MS

    found = verify_folder(args.folder or table_folder(), walker_from(args))
    rows = [("m/s", "km/h", "springs", "N", "worst family", "residual", "unit", "of allowed", "")]
    for each in found:
        if each.gait is not None and each.certificate is not None:
            request, worst = each.gait.request, each.certificate.worst
            rows.append(
                (
                    f"{request.speed:.4f}",
                    f"{request.speed * KMH_PER_MS:.2f}",
                    request.spring_mode.value,
                    str(request.points),
                    worst.family,
                    f"{worst.violation:.2e}",
                    worst.unit,
                    f"{worst.relative:.1%}",
                    "certified" if each.passed else "FAILED",
                )
            )
    print(aligned(rows, left=(2, 4, 6, 8)))
    failed = [each for each in found if not each.passed]
    print(f"{len(found)} files, {len(found) - len(failed)} certified, {len(failed)} failed")
    for each in failed:
        print(f"failed: {each.problem}", file=sys.stderr)
    return 1 if failed else 0


def run_list(args: argparse.Namespace) -> int:
    """List the library."""
    from walk_optimizer.cli.text import aligned, cost, number
    from walk_optimizer.library import GaitLibrary
    from walk_optimizer.request import KMH_PER_MS

    library = GaitLibrary(walker_from(args), args.library)
    rows = [("m/s", "km/h", "springs", "N", "K", "q_eq", "F", "F%", "from")]
    rows += [
        (
            f"{row.speed:.4f}",
            f"{row.speed * KMH_PER_MS:.2f}",
            row.spring_mode.value,
            str(row.points),
            f"{row.stiffness:.2f}",
            f"{row.equilibrium:.3f}",
            cost(row.objective),
            number(row.relative_objective, ".1f"),
            row.source.value,
        )
        for row in library.summaries()
    ]
    print(aligned(rows, left=(2, 8)))
    for problem in library.problems():
        print(f"set aside: {problem}", file=sys.stderr)
    return 0
