"""Contact phases of a step: what the refined grid takes from the report's grid."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import FootMode, Schedule

# A contact that lasts no longer than this many grid points is an impulse on the refined grid.
INSTANT_POINTS = 2
# What a foot does for no more than this part of the step may be left out: brushes, slips as it lifts off.
BRIEF_PART = 0.04
Modes = tuple[FootMode, FootMode]
# Which feet land.
Landing = tuple[bool, bool]


@dataclass(frozen=True)
class Phase:
    """A part of the step in which no foot changes its behaviour.

    Attributes:
        modes: What each foot does.
        impact: What each foot does in the impact that begins the phase; `FREE` feet take no impulse.
        landing: Which feet come down as the phase begins. In an impact, the others that take part stood
            before; where the phase begins without one, the foot is set down softly.
        start: Where the phase begins, as a part of the step in [0, 1).
    """

    modes: Modes
    impact: Modes
    landing: Landing
    start: float

    @property
    def begins_with_impact(self) -> bool:
        """Whether any foot takes an impulse as the phase begins."""
        return any(mode is not FootMode.FREE for mode in self.impact)


def is_single_support(phases: tuple[Phase, ...]) -> bool:
    """Return whether foot 1 lands, stands and sticks all through the step, while foot 2 swings."""
    alone = (FootMode.STICK, FootMode.FREE)
    return [(one.modes, one.impact, one.landing) for one in phases] == [(alone, alone, (True, False))]


def phase_shares(phases: tuple[Phase, ...]) -> NDArray[np.float64]:
    """Return the lengths of a step's phases as parts of it; they add up to 1."""
    return np.diff([phase.start for phase in phases] + [1.0])


def phases_of(schedule: Schedule) -> tuple[Phase, ...]:
    """Return the phases of a schedule (2, N), the first one beginning with the step.

    Runs of a few points become part of the impact of the phase after them. Wherever a foot makes
    contact anew, every foot that stands then or right after takes part in the impact. Of feet that slip
    only those that land take part, and stick in it: impulses that slip are the coarse grid's picture of a
    slip that ends with the step.
    """
    runs = _runs(schedule)
    last = max(index for index, (length, _) in enumerate(runs) if length > INSTANT_POINTS)
    before = _relabelled(runs[last][1])
    phases: list[Phase] = []
    # What happens in the last instant of a step belongs to the impact that begins the next.
    instant = [_relabelled(modes) for _, modes in runs[last + 1 :]]
    start = 0
    for length, modes in runs[: last + 1]:
        if length <= INSTANT_POINTS:
            instant.append(modes)
            continue
        seen = [*instant, modes]
        contacts = _first_contacts(seen)
        first, second = (not before[foot] and bool(contacts[foot]) for foot in range(2))
        hit = contacts if first or second else (FootMode.FREE, FootMode.FREE)
        impact = _in_impact(hit[0], lands=first), _in_impact(hit[1], lands=second)
        phases.append(Phase(modes, impact, (first, second), start / schedule.shape[1]))
        before, instant = modes, []
        start += length
    return tuple(phases)


def _in_impact(mode: FootMode, *, lands: bool) -> FootMode:
    """Return what a foot does in an impact."""
    return (FootMode.STICK if lands else FootMode.FREE) if mode.slips else mode


def without_brief_modes(schedule: Schedule) -> Schedule:
    """Return the schedule in which what a foot does briefly, but at the start, counts as before it."""
    steady = schedule.copy()
    for modes in steady:
        changes = np.flatnonzero(np.diff(modes)) + 1
        for start, end in pairwise([*changes.tolist(), modes.size]):
            if end - start <= _longest_brief(schedule):
                modes[start:end] = modes[start - 1]
    return steady


def with_steady_end(schedule: Schedule) -> Schedule:
    """Return the schedule in which what a foot does briefly as the step ends counts as before it."""
    steady = schedule.copy()
    for modes in steady:
        last = int(np.max(np.flatnonzero(np.diff(modes)), initial=-1)) + 1
        if last and modes.size - last <= _longest_brief(schedule):
            modes[last:] = modes[last - 1]
    return steady


def _longest_brief(schedule: Schedule) -> float:
    return max(float(INSTANT_POINTS), BRIEF_PART * float(schedule.shape[1]))


def _runs(schedule: Schedule) -> list[tuple[int, Modes]]:
    """Return length and modes of each run of equal columns."""
    changes = np.flatnonzero(np.any(np.diff(schedule, axis=1) != 0, axis=0)) + 1
    bounds = np.concatenate([[0], changes, [schedule.shape[1]]])
    return [
        (int(end - begin), (FootMode(schedule[0, begin]), FootMode(schedule[1, begin])))
        for begin, end in pairwise(bounds)
    ]


def _relabelled(modes: Modes) -> Modes:
    return modes[1], modes[0]


def _first_contacts(seen: list[Modes]) -> Modes:
    """Return for each foot the first contact among modes in order, `FREE` where there is none."""
    contacts = (next((one[foot] for one in seen if one[foot]), FootMode.FREE) for foot in range(2))
    first, second = contacts
    return first, second
