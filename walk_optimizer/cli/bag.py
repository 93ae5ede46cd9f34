"""`bag info`, `bag repair` and `bag play`: what the recorder left; only playing needs ROS."""

import argparse
import sys
from pathlib import Path

from walk_optimizer.cli.arguments import Subparsers, add_verb
from walk_optimizer.errors import MissingDependencyError

_TEXT = """\
look into recorded bags, repair broken ones, play them

Works on bag directories and on single .mcap files. Only playing needs ROS."""

_INFO = """\
say what is in a bag and whether it is whole

Reads all of it and checks every checksum; metadata.yaml is not believed, but compared.
The exit code is 1 when the bag is damaged, lacks its index, or its metadata.yaml differs:
then `bag repair` writes a whole one."""

_REPAIR = """\
write a whole bag from what can be trusted of a damaged one

With an index and a metadata.yaml that fit. The damaged bag stays as it is."""

_PLAY = """\
publish the messages of a bag again, for machines without rosbag2

On their topics, with the recorded quality of service and timing, and never in a burst:
a player that was held up goes on with the recorded distances. Needs ROS. Stamps inside
of messages stay as they were.

A topic that another node publishes is refused: stop that node, play other topics, or
under other names. /diagnostics and tf beside those of others are played if --topics
names them."""

_PLAY_EXAMPLES = """\
examples:
  walk-optimizer bag play recordings/walk_1
  walk-optimizer bag play recordings/walk_1 --rate 0.5 --loop
  walk-optimizer bag play recordings/walk_1 --topics /reference_publisher/joint_reference
  walk-optimizer bag play recordings/walk_1 --topics /tf --remap /tf:=/recorded/tf"""


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
    play = add_verb(actions, "play", _PLAY, _PLAY_EXAMPLES)
    play.add_argument("bag", type=Path, help="bag directory or .mcap file")
    play.add_argument(
        "--rate", type=float, default=1.0, metavar="X", help="times the recorded speed (default: 1)"
    )
    play.add_argument(
        "--delay",
        type=float,
        default=4.0,
        metavar="SECONDS",
        help="time for subscribers to find the player, 4 at the least (default: %(default)s)",
    )
    play.add_argument("--loop", action="store_true", help="begin anew at the end, until Ctrl-C")
    play.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these (default: all)")
    play.add_argument(
        "--remap", nargs="+", default=(), metavar="FROM:=TO", help="play topics under other names"
    )
    play.set_defaults(run=run_play)


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


def run_play(args: argparse.Namespace) -> int:
    """Play a bag."""
    from walk_optimizer.recording import describe_bag

    info = describe_bag(args.bag)
    if not info.is_whole:
        _tell(f"{args.bag} is damaged: what can be trusted is played; `bag info` tells more")
    try:
        from walk_optimizer.nodes.bag_player import play_bag
    except ImportError as error:
        raise MissingDependencyError(f"playing a bag needs ROS 2: {error}") from error
    played = play_bag(args.bag, info, args.delay, _tell, args.topics, args.rate, args.loop, args.remap)
    print(f"played {played.messages} messages on {played.topics} topics")
    return 0


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
