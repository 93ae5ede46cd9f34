"""`reproduce`: Table I and the figures of the report, from our gaits."""

import argparse
from pathlib import Path

from walk_optimizer.cli.arguments import (
    Subparsers,
    add_library,
    add_verb,
    add_walker,
    output_folder,
    walker_from,
)

_TEXT = """\
build the report's table and figures again, from the gaits of the library

Table I, figures 2 to 5 (angles at seven speeds, paths of the swing foot, angles and
torques at 1.15 km/h) and the sparsity picture, each beside a sentence on what agrees
and what differs. Reads gaits, solves none."""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "reproduce", _TEXT, "example:\n  walk-optimizer reproduce --output report")
    parser.add_argument(
        "--output", type=Path, default=Path("reproduction"), metavar="FOLDER", help="default: reproduction"
    )
    add_walker(parser)
    add_library(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Draw and write."""
    from walk_optimizer.cli.table_text import table_text
    from walk_optimizer.figures.reproduction import reproduce
    from walk_optimizer.library import GaitLibrary

    library = GaitLibrary(walker_from(args), args.library)
    table = table_text(library)
    page = reproduce(library, output_folder(args.output), table)
    print(f"{table}\n\nfigures and what to see in them: {page}")
    return 0
