"""`solve`: one gait, its report and its certificate."""

import argparse
from pathlib import Path

from walk_optimizer.cli.arguments import (
    Subparsers,
    add_library,
    add_request,
    add_verb,
    add_walker,
    positive_seconds,
    request_from,
    walker_from,
)

_TEXT = """\
solve for the gait of least torque at a speed

Several first guesses are tried; the best optimum is solved with free contacts and
checked by a certificate that is computed apart from the solver. A gait that fails its
certificate is not a gait: the exit code is then 1 and nothing is stored."""

_EPILOG = """\
examples:
  walk-optimizer solve --speed 0.3185
  walk-optimizer solve --speed 1.15km/h --spring stiffness_and_equilibrium --save
  walk-optimizer solve --speed 0.5 --points 400 --time-limit 60 --export gait.csv"""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "solve", _TEXT, _EPILOG)
    add_request(parser)
    add_walker(parser)
    add_library(parser)
    parser.add_argument("--time-limit", metavar="SECONDS", help="give up after this time")
    parser.add_argument("--save", action="store_true", help="store the gait in the library")
    parser.add_argument("--export", type=Path, metavar="CSV", help="write the numbers to a file")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Solve, print, store."""
    request, walker = request_from(args), walker_from(args)
    time_limit = None if args.time_limit is None else positive_seconds(args.time_limit)

    from walk_optimizer.cli.gaits import solve
    from walk_optimizer.cli.text import (
        certificate_text,
        gait_text,
        refinement_text,
        report_text,
        request_text,
    )
    from walk_optimizer.gait_csv import write_csv
    from walk_optimizer.gait_files.access import writable_target
    from walk_optimizer.library import GaitLibrary

    # Before the work, not after it: where the gait goes must be writable.
    library = GaitLibrary(walker, args.library, writable=True) if args.save else None
    if args.export:
        writable_target(args.export)
    print(request_text(request))
    outcome = solve(request, walker, time_limit)
    print(report_text(outcome.report))
    if outcome.gait is None:
        return 1
    print(gait_text(outcome.gait))
    print(f"refined        {refinement_text(outcome.gait)}")
    print(f"\n{certificate_text(outcome.gait.certificate)}")
    if args.export:
        write_csv(outcome.gait, args.export)
        print(f"\nexported to {args.export}")
    if library is not None:
        print(f"\nstored as {library.store(outcome.gait)}")
    return 0
