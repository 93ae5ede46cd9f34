"""`bag info` and `bag repair`: what the recorder left, without ROS."""

import argparse
from pathlib import Path

from walk_optimizer.cli.arguments import Subparsers, add_verb

_TEXT = """\
look into recorded bags, repair broken ones

Works on bag directories and on single .mcap files. Needs no ROS."""

_INFO = """\
say what is in a bag and whether it is whole

Reads all of it and checks every checksum; metadata.yaml is not believed. The exit code
is 1 when the bag is damaged."""

_REPAIR = """\
write a whole bag from what can be trusted of a damaged one

The damaged bag stays as it is."""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb with its two actions."""
    parser = add_verb(verbs, "bag", _TEXT, "example:\n  walk-optimizer bag info recordings/walk_1")
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    info = add_verb(actions, "info", _INFO)
    info.add_argument("bag", type=Path, help="bag directory or .mcap file")
    info.set_defaults(run=run_info)
    repair = add_verb(actions, "repair", _REPAIR)
    repair.add_argument("bag", type=Path, help="bag directory or .mcap file")
    repair.add_argument("--output", type=Path, metavar="BAG", help="default: BAG_repaired beside it")
    repair.set_defaults(run=run_repair)


def run_info(args: argparse.Namespace) -> int:
    """Describe a bag."""
    from walk_optimizer.recording import describe_bag, format_bag

    info = describe_bag(args.bag)
    print(format_bag(info))
    return 0 if info.is_whole else 1


def run_repair(args: argparse.Namespace) -> int:
    """Repair a bag."""
    from walk_optimizer.recording import repair_bag

    print(repair_bag(args.bag, args.output))
    return 0
