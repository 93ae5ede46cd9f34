"""`picture`: a gait on one page."""

import argparse
from pathlib import Path

from walk_optimizer.cli.arguments import Subparsers, add_gait_choice, add_verb

_TEXT = """\
draw a gait: stick figures, angles, torques, ground reaction

The gait comes from the library; one that the library lacks is solved. The ending of the
file name chooses the format: png, pdf, svg."""

_EPILOG = """\
example:
  walk-optimizer picture --speed 1.15km/h --spring stiffness_and_equilibrium --output gait.png"""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "picture", _TEXT, _EPILOG)
    add_gait_choice(parser)
    parser.add_argument(
        "--output", type=Path, default=Path("gait.png"), metavar="FILE", help="default: gait.png"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Draw the gait."""
    from walk_optimizer.cli.gaits import chosen_gait
    from walk_optimizer.figures import gait_picture, picture_target

    picture_target(args.output)
    gait_picture(chosen_gait(args), args.output)
    print(f"picture in {args.output}")
    return 0
