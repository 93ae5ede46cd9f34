"""`urdf`: the walker as a robot description."""

import argparse
import math
import sys
from pathlib import Path

from walk_optimizer.cli.arguments import Subparsers, add_verb, add_walker
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters

_TEXT = """\
write the walker as URDF

Joints left_hip, left_knee, right_hip, right_knee with the positions that the publisher
streams; the base base_link is the hip, x is forward, z up. Masses, lengths and the hip
limit are those of the walker, what is drawn and the limits are in
config/description.yaml. URDF knows no springs: with --stiffness they are written as
Gazebo reads them."""

_EPILOG = """\
examples:
  walk-optimizer urdf --output walker.urdf
  walk-optimizer urdf --walker heavy.yaml --stiffness 228 --equilibrium 3.109"""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "urdf", _TEXT, _EPILOG)
    add_walker(parser)
    parser.add_argument("--stiffness", metavar="K", help="of both knees in N m/rad (default: no springs)")
    parser.add_argument(
        "--equilibrium", metavar="Q_EQ", help="of both knees in rad, with --stiffness (default: pi)"
    )
    parser.add_argument("--output", type=Path, metavar="FILE", help="default: standard output")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the description."""
    from walk_optimizer.cli.arguments import walker_from
    from walk_optimizer.description.settings import description_settings
    from walk_optimizer.description.urdf import walker_urdf
    from walk_optimizer.gait_files.access import writable_target, write_text

    walker = walker_from(args)
    text = walker_urdf(walker, description_settings(), _spring(args, walker))
    if args.output is None:
        sys.stdout.write(text)
        return 0
    writable_target(args.output)
    write_text(args.output, text)
    print(f"description in {args.output}")
    return 0


def _spring(args: argparse.Namespace, walker: WalkerParameters) -> KneeSpring:
    """Return the knee springs that were asked for.

    Raises:
        InvalidRequestError: no walker has such springs, or only their equilibrium is given.
    """
    stiffness = 0.0 if args.stiffness is None else _number(args.stiffness)
    equilibrium = math.pi if args.equilibrium in (None, "pi") else _number(args.equilibrium)
    if not 0 <= stiffness <= walker.stiffness_limit:
        raise InvalidRequestError(
            f"stiffness is {args.stiffness} N m/rad, allowed is 0 to {walker.stiffness_limit:g} N m/rad"
        )
    if not 0 <= equilibrium <= math.pi:
        raise InvalidRequestError(f"equilibrium is {args.equilibrium} rad, allowed is 0 to pi")
    if args.equilibrium is not None and args.stiffness is None:
        raise InvalidRequestError(
            "--equilibrium is that of springs: give their --stiffness too, or leave it out"
        )
    return KneeSpring(stiffness, equilibrium)


def _number(text: str) -> float:
    """Return the number of a text; one that is none is not a number."""
    try:
        return float(text)
    except ValueError:
        return math.nan
