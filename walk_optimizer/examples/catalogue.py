"""The examples by name, each with its picture."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from walk_optimizer.errors import InvalidRequestError, quoted
from walk_optimizer.examples import pictures
from walk_optimizer.examples.finding import Finding
from walk_optimizer.examples.finger import move_disc
from walk_optimizer.examples.finger_model import Finger
from walk_optimizer.examples.finger_problem import FingerTask
from walk_optimizer.examples.standing_start import StandingStart, set_off
from walk_optimizer.examples.terrain_gait import find_contacts
from walk_optimizer.guess.kinematic import GuessShape
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings

_SLOPE = math.radians(5)
TERRAINS = {
    "slope-up": Terrain(slope=_SLOPE),
    "slope-down": Terrain(slope=-_SLOPE),
    "stairs": Terrain(step_up=0.03),
}
NAMES = ("standing-start", *TERRAINS, "finger")
# A step of the table's second speed, on a coarse grid.
_STEP = GaitRequest(step_length=0.25, step_time=0.785, spring_mode=SpringMode.NONE, points=50)
_SHAPE = GuessShape(clearance=0.05, flexion=0.03)


@dataclass(frozen=True)
class Example:
    """A solved example.

    Attributes:
        finding: What it found.
        draw: Draws it into a file.
    """

    finding: Finding
    draw: Callable[[Path], None]


def solve_example(name: str, time_limit: float | None = None) -> Example:
    """Solve an example.

    Args:
        name: One of `NAMES`.
        time_limit: In [s]; that of the solver's settings by default.

    Raises:
        InvalidRequestError: there is no such example; the message lists them.
    """
    settings = solver_settings()
    session = SolveSession(settings, settings.time_limit if time_limit is None else time_limit, None)
    if name == "finger":
        disc = move_disc(Finger(), FingerTask(), session)
        return Example(disc.finding, lambda path: pictures.draw_finger(disc, path))
    if name in TERRAINS:
        walker = replace(WalkerParameters.from_yaml(), terrain=TERRAINS[name])
        gait = find_contacts(walker, _STEP, _SHAPE, session)
        return Example(gait.finding, lambda path: pictures.draw_walk(gait, path))
    if name == "standing-start":
        start = set_off(WalkerParameters.from_yaml(), StandingStart(), session)
        return Example(start.finding, lambda path: pictures.draw_walk(start, path))
    raise InvalidRequestError(f"there is no example {quoted(name)}; known are {', '.join(NAMES)}")
