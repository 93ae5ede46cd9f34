"""`simulate`: a gait in closed loop over many steps."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from walk_optimizer.cli.arguments import (
    Subparsers,
    add_gait_choice,
    add_verb,
    parse_count,
    parse_number,
    refuse_beside,
)
from walk_optimizer.errors import InvalidRequestError

if TYPE_CHECKING:
    from walk_optimizer.gait import Gait
    from walk_optimizer.simulation.closed_loop import ClosedLoop
    from walk_optimizer.simulation.settings import SimulationSettings
    from walk_optimizer.simulation.walk import Disturbance, SimulatedWalk

_MOST_STEPS = 1000
# Far beyond what any feedback holds: where forces or masses overflow, the integrator never ends a step.
_LARGEST_PUSH = 1e4  # [N s]
_MOST_HEAVIER = 1e3  # [%]
# No ground holds a foot so well.
_MOST_FRICTION = 10.0  # [-]
# What says how a whole table is walked; all else is about one gait.
_OF_TABLES = frozenset({"table", "walker", "library", "friction", "run"})

_TEXT = """\
walk a gait in closed loop, step after step

The walker is integrated apart from the optimiser, with knee stops, touch-downs and the
limits of friction. A linear-quadratic regulator holds it on the gait. The exit code is 1
when it falls."""

_EPILOG = """\
examples:
  walk-optimizer simulate --speed 1.5km/h --spring stiffness_and_equilibrium
  walk-optimizer simulate --speed 1.5km/h --spring stiffness_and_equilibrium --push 5
        a push forward on the hip, in N s, in the third step
  walk-optimizer simulate --speed 1.5km/h --spring stiffness --step-down 0.005 --picture walk.png
  walk-optimizer simulate --table
        all gaits of the table with all disturbances; takes a quarter of an hour
  walk-optimizer simulate --table --walker my_walker.yaml --library my_table --friction 0.8
        those of another walker, on ground with this friction"""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "simulate", _TEXT, _EPILOG)
    add_gait_choice(parser)
    parser.add_argument("--steps", metavar="N", help="steps to walk (default: 20)")
    parser.add_argument(
        "--push", metavar="N_S", help="push on the hip in N s, forward positive (default: none)"
    )
    parser.add_argument("--step-down", metavar="M", help="one step leads down by so much in m (default: 0)")
    parser.add_argument(
        "--heavier",
        metavar="PERCENT",
        help="masses are larger than the feedback knows (default: 0)",
    )
    parser.add_argument("--friction", metavar="MU", help="of the ground (default: the gait's)")
    parser.add_argument(
        "--without-feedback", action="store_true", help="play the gait's torques back and nothing else"
    )
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the walk: png, pdf, svg")
    parser.add_argument(
        "--table",
        action="store_true",
        help="all gaits of the table, as Markdown; takes --walker, --library, --friction alone",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Walk, and say how it went."""
    if args.table:
        refuse_beside("--table", args, (name for name in vars(args) if name not in _OF_TABLES))
        return _print_table(args)
    if args.without_feedback:
        refuse_beside("--without-feedback", args, ("push", "step_down"))
    push = _amount(args.push, "push", "in N s", above=-_LARGEST_PUSH, most=_LARGEST_PUSH)
    down = _amount(args.step_down, "step down", "in m")
    heavier = _amount(args.heavier, "heavier", "in %", above=-100.0, most=_MOST_HEAVIER)
    friction = _friction(args)

    from walk_optimizer.cli.gaits import chosen_gait
    from walk_optimizer.figures import picture_target
    from walk_optimizer.simulation.closed_loop import closed_loop
    from walk_optimizer.simulation.settings import simulation_settings

    if args.picture is not None:
        picture_target(args.picture)
    settings = simulation_settings()
    steps = settings.steps if args.steps is None else parse_count(args.steps, "steps", _MOST_STEPS)
    _refuse_undisturbed(args, steps, settings)
    gait = chosen_gait(args)
    loop = closed_loop(gait, settings).heavier(1 + heavier / 100)
    if friction is not None:
        loop = loop.on_ground(friction)
    disturbance = loop.disturbance(push, down)
    walk = loop.walk_without_feedback(steps) if args.without_feedback else loop.walk(steps, disturbance)
    print(_text(gait, loop, walk, steps))
    if args.picture is not None:
        _draw(gait, loop, walk, disturbance, args.picture)
    return 1 if walk.ending.is_fall else 0


def _refuse_undisturbed(args: argparse.Namespace, steps: int, settings: "SimulationSettings") -> None:
    """Refuse a disturbance of a step that the walk does not reach.

    Raises:
        InvalidRequestError: one was given.
    """
    disturbed = settings.disturbed_step
    options = (("--push", args.push), ("--step-down", args.step_down))
    given = " and ".join(option for option, text in options if text is not None)
    if given and steps < disturbed:
        raise InvalidRequestError(
            f"{given} would disturb step {disturbed}, the walk has {steps}; allowed are at least {disturbed} "
            "steps"
        )


def _draw(
    gait: "Gait", loop: "ClosedLoop", walk: "SimulatedWalk", disturbance: "Disturbance", path: Path
) -> None:
    from walk_optimizer.simulation.picture import walk_picture

    walk_picture(gait, loop, walk, disturbance, path)
    print(f"picture in {path}")


def _text(gait: "Gait", loop: "ClosedLoop", walk: "SimulatedWalk", steps: int) -> str:
    """Return how a walk went, one line a fact."""
    from walk_optimizer.cli.text import number, speed_text
    from walk_optimizer.simulation.linearization import largest_multiplier

    done, reference = len(walk.completed), loop.reference
    ended = f"fell in step {done + 1}: {walk.ending.sentence}" if walk.ending.is_fall else "still walking"
    held = largest_multiplier(loop.step.closed_loop(loop.feedback))
    alone = largest_multiplier(loop.step.open_loop)
    effort = f"{number(walk.mean_effort, '.4g')} (N m)^2 s a step, the gait's {reference.torque_effort:.4g}"
    speed = speed_text(walk.mean_speed) if done else "-"
    return "\n".join(
        [
            f"gait           {speed_text(gait.speed)}, springs {gait.request.spring_mode.value}",
            f"steps          {done} of {steps}, {ended}",
            f"mean speed     {speed}",
            f"torque effort  {effort}",
            f"peak torque    {walk.peak_torque:.1f} N m",
            f"deviation      at most {loop.largest_deviation(walk):.2g} rad from the gait",
            f"eigenvalue     {held:.2f} a step with feedback, {alone:.3g} without",
        ]
    )


def _print_table(args: argparse.Namespace) -> int:
    """Print the table row by row."""
    from walk_optimizer.cli.arguments import walker_from
    from walk_optimizer.cli.text import markdown_line
    from walk_optimizer.library import GaitLibrary
    from walk_optimizer.simulation.settings import simulation_settings
    from walk_optimizer.simulation.table import HEADINGS, table_rows

    friction, gaits = _friction(args), GaitLibrary(walker_from(args), args.library).table_gaits()
    print(markdown_line(HEADINGS), markdown_line(["---"] * len(HEADINGS)), sep="\n")
    for row in table_rows(gaits, simulation_settings(), friction):
        print(markdown_line(row), flush=True)
    return 0


def _amount(
    text: str | None, name: str, unit: str, above: float = -math.inf, most: float = math.inf
) -> float:
    """Return the number of a disturbance; 0 where none is given."""
    return 0.0 if text is None else parse_number(text, name, unit, above, most)


def _friction(args: argparse.Namespace) -> float | None:
    """Return the friction coefficient of the ground; None for that of the gait's walker."""
    text = args.friction
    if text is None:
        return None
    return parse_number(text, "friction", "without unit", above=0.0, most=_MOST_FRICTION)
