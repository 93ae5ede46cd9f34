"""Which contact phases the steps of a transition have."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.refined_trajectory import RefinedTrajectory
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
    return observed_phases(refined_of(gait).trajectory)


def _begun(source: Pace, walked: tuple[Phase, ...]) -> tuple[Phase, ...]:
    """Return the phases of the first step: where the feet are follows from the state that it begins in."""
    if not isinstance(source, Standing):
        own = observed_phases(refined_of(source).trajectory)[0]
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


def observed_phases(trajectory: RefinedTrajectory) -> tuple[Phase, ...]:
    """Return the phases of a periodic step, read off its forces and impulses."""
    loads, impacts = (
        np.abs(values).reshape(trajectory.intervals, -1, 2, 2).max(axis=(1, 3)) > 0
        for values in (trajectory.forces, trajectory.impulses)
    )
    changes = np.any(loads[1:] != loads[:-1], axis=1) | np.any(impacts[1:], axis=1)
    starts = [0, *(np.flatnonzero(changes) + 1).tolist()]
    before = [loads[-1][::-1], *(loads[first] for first, _ in pairwise(starts))]
    return tuple(
        Phase(
            modes=_modes(loads[start]),
            impact=_modes(impacts[start]),
            landing=(bool(impacts[start][0] and not stood[0]), bool(impacts[start][1] and not stood[1])),
            start=float(trajectory.breaks[start] / trajectory.step_time),
        )
        for start, stood in zip(starts, before, strict=True)
    )


def _modes(touching: np.ndarray) -> Modes:
    first, second = (_STICK if foot else _FREE for foot in touching)
    return first, second
