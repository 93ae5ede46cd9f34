"""`table`: Table I of the report beside ours."""

import argparse
import sys

from walk_optimizer.cli.arguments import Subparsers, add_library, add_verb, add_walker, walker_from

_TEXT = """\
show Table I of the report beside the gaits of the library

K is the stiffness of the knee springs, q_eq the angle at which they are relaxed,
F the sum over the grid points of |u|^2 / 2, and F% = 100 F / F without springs.
A lower F% is better. The report does not give F itself. With `--grid refined` F is the
integral over the step of |u|^2 / 2 dt, of the accurate solutions that controllers are fed."""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "table", _TEXT)
    parser.add_argument("--format", choices=["text", "markdown"], default="text", help="default: text")
    parser.add_argument(
        "--grid",
        choices=["report", "refined"],
        default="report",
        help="N points of implicit Euler, or the accurate one",
    )
    add_walker(parser)
    add_library(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the table."""
    from walk_optimizer.cli.table_text import markdown_table, table_text
    from walk_optimizer.library import GaitLibrary

    library = GaitLibrary(walker_from(args), args.library)
    show = markdown_table if args.format == "markdown" else table_text
    print(show(library, refined=args.grid == "refined"))
    for problem in library.problems():
        print(f"set aside: {problem}", file=sys.stderr)
    return 0
