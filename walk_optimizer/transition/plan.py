"""Which contact phases the steps of a transition have."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.replay import contact_modes
from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.gait import Gait
from walk_optimizer.transcription.phases import Landing, Modes, Phase
from walk_optimizer.transition.paces import Pace, refined_of
from walk_optimizer.transition.standing import Standing

_FREE, _STICK = FootMode.FREE, FootMode.STICK
_NO_FOOT, _SWING_FOOT = (False, False), (False, True)
_BOTH: Modes = (_STICK, _STICK)
# Parts of a step that begins or ends on both feet, in which both stand: first guesses.
_LIFTING, _SETTLING = 0.35, 0.5


@dataclass(frozen=True)
class ContactPlan:
    """The contacts of all steps of a transition, the legs named as in the first step.

    Attributes:
        steps: Phases of each step; they begin at parts of that step.
        landing: Which feet land at the end of the last step.
    """

    steps: tuple[tuple[Phase, ...], ...]
    landing: Landing


def contact_plan(source: Pace, target: Pace, steps: int) -> ContactPlan:
    """Return the contacts of a transition of some steps.

    Steps from a gait begin with its impact; steps to a gait walk with its phases. From a stand both feet
    stand first; to a stand the foot that lands stays beside the other.
    """
    walked = _walking_phases(source, target)
    first = list(_begun(source, walked))
    every = [first, *(list(walked) for _ in range(1, steps))]
    if isinstance(target, Standing):
        every[-1] = _ended(every[-1])
    named = [tuple(_exchanged(phase) if k % 2 else phase for phase in each) for k, each in enumerate(every)]
    if isinstance(target, Standing):
        return ContactPlan(tuple(named), _NO_FOOT)
    first_foot, second_foot = walked[0].landing
    return ContactPlan(
        tuple(named), (first_foot, second_foot) if steps % 2 == 0 else (second_foot, first_foot)
    )


def _walking_phases(source: Pace, target: Pace) -> tuple[Phase, ...]:
    """Return the phases of the gait that is walked: the target's, unless that is a stand."""
    gait = source if isinstance(target, Standing) else target
    if isinstance(gait, Standing):
        raise TypeError("a transition needs a gait at one of its ends")
    return observed_phases(gait)


def _begun(source: Pace, walked: tuple[Phase, ...]) -> tuple[Phase, ...]:
    """Return the phases of the first step: where the feet are follows from the state that it begins in."""
    if not isinstance(source, Standing):
        own = observed_phases(source)[0]
        return replace(walked[0], impact=own.impact, landing=_NO_FOOT), *walked[1:]
    lifted = replace(walked[0], impact=(_FREE, _FREE), landing=_NO_FOOT)
    rest = [
        replace(phase, start=_LIFTING + (1 - _LIFTING) * phase.start)
        for phase in (lifted, *walked[1:])
        if phase.modes != _BOTH
    ]
    return Phase(_BOTH, (_FREE, _FREE), _NO_FOOT, 0.0), *rest


def _ended(phases: list[Phase]) -> list[Phase]:
    """Return the phases of a step in which the foot that lands stays beside the other."""
    shortened = [replace(phase, start=phase.start * (1 - _SETTLING)) for phase in phases]
    return [*shortened, Phase(_BOTH, (_FREE, _FREE), _SWING_FOOT, 1 - _SETTLING)]


def _exchanged(phase: Phase) -> Phase:
    """Return a phase with the names of the legs exchanged."""
    (a, b), (c, d), (e, f) = phase.modes, phase.impact, phase.landing
    return Phase((b, a), (d, c), (f, e), phase.start)


def observed_phases(gait: Gait) -> tuple[Phase, ...]:
    """Return the phases of a gait's step, read off the forces, impulses and velocities of its feet."""
    refined = refined_of(gait)
    trajectory = refined.trajectory
    modes = contact_modes(gait.walker, refined.spring, trajectory)
    impacts = [_impact(impulse) for impulse in trajectory.impulses]
    later = range(1, trajectory.intervals)
    starts = [0, *(i for i in later if modes[i] != modes[i - 1] or impacts[i] != (_FREE, _FREE))]
    before = [modes[-1][::-1], *(modes[first] for first, _ in pairwise(starts))]
    return tuple(
        Phase(
            modes=modes[start],
            impact=impacts[start],
            landing=_landing(impacts[start], stood),
            start=float(trajectory.breaks[start] / trajectory.step_time),
        )
        for start, stood in zip(starts, before, strict=True)
    )


def _impact(impulse: NDArray[np.float64]) -> Modes:
    """Return which feet take an impulse (4,) in [N s]."""
    first, second = (_STICK if foot.any() else _FREE for foot in impulse.reshape(2, 2))
    return first, second


def _landing(impact: Modes, stood: Modes) -> Landing:
    """Return which feet take part in an impact without having stood before it."""
    first, second = (hit is not _FREE and mode is _FREE for hit, mode in zip(impact, stood, strict=True))
    return first, second
