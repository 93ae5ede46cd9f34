"""`example`: problems whose contacts nobody gives."""

import argparse
from pathlib import Path

from walk_optimizer.cli.arguments import Subparsers, add_verb, positive_seconds

_TEXT = """\
find contacts where no schedule is given

The contacts of these problems are found by complementarity alone, from a first guess
that says nothing about them. Prints what was found and its residuals, which are
computed apart from the solver; the exit code is 1 if they are too large."""

_EPILOG = """\
examples:
  walk-optimizer example standing-start --output start.png
        from rest on both feet to walking
  walk-optimizer example stairs
        a gait whose steps land 3 cm higher; also: slope-up, slope-down (5 degrees)
  walk-optimizer example finger
        a finger moves a disc that it does not touch at first"""

# As the core has them (`examples/catalogue.py`), which is imported when the verb runs.
_NAMES = ("standing-start", "slope-up", "slope-down", "stairs", "finger")


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "example", _TEXT, _EPILOG)
    parser.add_argument("name", metavar="NAME", choices=_NAMES, help=", ".join(_NAMES))
    parser.add_argument("--output", type=Path, metavar="PICTURE", help="draw it: png, pdf or svg")
    parser.add_argument("--time-limit", metavar="SECONDS", help="give up after this time")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Solve, print, draw."""
    time_limit = None if args.time_limit is None else positive_seconds(args.time_limit, "time limit")

    from walk_optimizer.cli.text import certificate_text
    from walk_optimizer.examples.catalogue import solve_example
    from walk_optimizer.figures.canvas import picture_target

    if args.output:
        picture_target(args.output)
    example = solve_example(args.name, time_limit)
    print("\n".join(example.finding.lines()))
    print(f"\n{certificate_text(example.finding.certificate)}")
    if args.output:
        example.draw(args.output)
        print(f"\npicture: {args.output}")
    return 0 if example.finding.certificate.certified else 1
