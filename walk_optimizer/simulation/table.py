"""What feedback makes of each gait, as rows of a table."""

from collections.abc import Iterable, Iterator

from walk_optimizer.gait import Gait
from walk_optimizer.request import KMH_PER_MS
from walk_optimizer.simulation.closed_loop import ClosedLoop, closed_loop
from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.linearization import largest_multiplier
from walk_optimizer.simulation.robustness import Robustness, robustness
from walk_optimizer.simulation.settings import SimulationSettings

HEADINGS = (
    "km/h",
    "springs",
    "lands at [m/s]",
    "eigenvalue alone",
    "with feedback",
    "walks",
    "push on [N s]",
    "push back [N s]",
    "1 cm down",
    "5 % heavier",
    "leg 0.01 rad off",
)


def table_rows(
    gaits: Iterable[Gait], settings: SimulationSettings, friction: float | None = None
) -> Iterator[tuple[str, ...]]:
    """Return a row for each gait of the table, one after the other: each takes a minute.

    Args:
        gaits: Those of the table.
        settings: Of the walks.
        friction: Coefficient of the ground [-]; that of the gaits' walker by default.
    """
    for gait in gaits:
        loop = closed_loop(gait, settings)
        loop = loop if friction is None else loop.on_ground(friction)
        names = (f"{gait.speed * KMH_PER_MS:.2f}", gait.request.spring_mode.value)
        yield *names, *orbit_cells(loop), *robustness_cells(robustness(loop, settings.steps))


def orbit_cells(loop: ClosedLoop) -> tuple[str, str, str]:
    """Return how fast the foot lands, and the largest eigenvalues without feedback and with it."""
    alone, held = loop.step.open_loop, loop.step.closed_loop(loop.feedback)
    return (
        f"{loop.step.landing_speed:.3f}",
        f"{largest_multiplier(alone):.3g}",
        f"{largest_multiplier(held):.2f}",
    )


def robustness_cells(found: Robustness) -> tuple[str, ...]:
    """Return how walks ended, and the largest pushes."""
    pushes = (f"{push:.1f}" if push else "none" for push in (found.push_forward, found.push_backward))
    others = (found.step_down, found.heavier, found.start_error)
    return _word(found.alone), *pushes, *map(_word, others)


def _word(ending: Ending) -> str:
    return ending.value.replace("_", " ") if ending.is_fall else "yes"
