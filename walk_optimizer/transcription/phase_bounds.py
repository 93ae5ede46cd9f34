"""Bounds of the rows and forces of a phase: what a foot does there, as equations and inequalities."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.transcription import radau
from walk_optimizer.transcription.layout import STATE_WIDTH
from walk_optimizer.transcription.phases import Landing, Modes, Phase
from walk_optimizer.transcription.tableau import STAGES

FloatArray = NDArray[np.float64]
# Lower and upper bounds of a stage's rows; rows without any take no part.
RowBounds = tuple[FloatArray, FloatArray]
# Phases with their numbers of intervals.
PhaseLayout = tuple[tuple[Phase, int], ...]

# Rows of contact in a point or an impact, two of each: gaps, velocities along x and y, sides of cones.
_GAP, _TANGENTIAL, _NORMAL, _CONE = 0, 2, 4, 6


def kept_rows(bounds: RowBounds) -> NDArray[np.bool_]:
    """Return which rows have a bound."""
    return np.isfinite(bounds[0]) | np.isfinite(bounds[1])


def stage_bounds(layout: PhaseLayout, landing: Landing, landing_speed: float = 0.0) -> list[RowBounds]:
    """Return the bounds of each stage's rows: of each phase its impact, where it has one, and intervals.

    Args:
        layout: The phases.
        landing: Which feet land at the end of the last one.
        landing_speed: Least speed towards the ground in [m/s] of feet that land in the impacts between
            phases; 0 sets no bound. What the last phase ends in is for the ends of the chain to bound.
    """
    bounds: list[RowBounds] = []
    phases = [phase for phase, _ in layout]
    landings = [
        *((phase.landing, phase.begins_with_impact, landing_speed) for phase in phases[1:]),
        (landing, True, 0.0),
    ]
    stops = [*(_stopping(*pair) for pair in pairwise(phases)), (False, False)]
    for (phase, intervals), after, stopping in zip(layout, landings, stops, strict=True):
        bounds += [impact_bounds(phase)] * phase.begins_with_impact
        bounds += [interval_bounds(phase.modes)] * (intervals - 1)
        bounds.append(_ended(_stopped(interval_bounds(phase.modes), stopping), *after))
    return bounds


def _stopping(phase: Phase, after: Phase) -> tuple[bool, bool]:
    """Return which feet slip in a phase and stick in the one after it without an impact that stops them."""
    first, second = (
        before.slips and then is FootMode.STICK and hit is FootMode.FREE
        for before, then, hit in zip(phase.modes, after.modes, after.impact, strict=True)
    )
    return first, second


def _stopped(bounds: RowBounds, stopping: tuple[bool, bool]) -> RowBounds:
    """Return the bounds of an interval at the end of which slipping feet come to rest."""
    low, high = bounds
    for foot in np.flatnonzero(stopping):
        row = low.size - radau.CONTACT_ROWS + _TANGENTIAL + foot
        low[row] = high[row] = 0.0
    return low, high


def interval_bounds(modes: Modes) -> RowBounds:
    """Return the bounds of an interval's rows: dynamics, then contacts at each node."""
    contact = _contact_bounds(modes)
    dynamics = np.zeros(STAGES * STATE_WIDTH)
    low, high = (np.concatenate([dynamics, *[side] * STAGES]) for side in contact)
    return low, high


def _ended(bounds: RowBounds, landing: Landing, with_impact: bool, speed: float) -> RowBounds:
    """Return the bounds of an interval at the end of which feet land, in an impact at least at a speed.

    What follows pins the gap of a landing foot, an impact or else the end of the chain: the last node
    must not bound it once more. Without an impact the foot is set down, and at rest there.
    """
    low, high = bounds
    last_low, last_high = low[-radau.CONTACT_ROWS :], high[-radau.CONTACT_ROWS :]
    for foot in np.flatnonzero(landing):
        last_low[_GAP + foot] = -np.inf
        if not with_impact:
            for row in (_TANGENTIAL + foot, _NORMAL + foot):
                last_low[row] = last_high[row] = 0.0
        elif speed:
            last_high[_NORMAL + foot] = -speed
    return low, high


def impact_bounds(phase: Phase) -> RowBounds:
    """Return the bounds of an impact's rows: momentum, then contacts.

    A landing foot is on the ground. One that stood before is there already: to pin it once more
    would ask twice for the same.
    """
    contact = _contact_bounds(phase.impact)
    low, high = (np.concatenate([np.zeros(STATE_WIDTH), side]) for side in contact)
    for foot in range(2):
        gap = STATE_WIDTH + _GAP + foot
        low[gap], high[gap] = (0.0, 0.0) if phase.landing[foot] else (-np.inf, np.inf)
    return low, high


def _contact_bounds(modes: Modes) -> RowBounds:
    """Return the bounds of the contact rows, (10,) each.

    A foot that stands has zero velocity, one in the air stays above the ground. One that slips has
    its tangential force on the side of the cone against it.
    """
    low, high = np.full(radau.CONTACT_ROWS, -np.inf), np.full(radau.CONTACT_ROWS, np.inf)

    def pin(row: int) -> None:
        low[row] = high[row] = 0.0

    for foot, mode in enumerate(modes):
        if mode is FootMode.FREE:
            low[_GAP + foot] = 0.0
            continue
        pin(_NORMAL + foot)
        # Rows of the cone: mu f_y - f_x, then mu f_y + f_x.
        low[_CONE + 2 * foot : _CONE + 2 * foot + 2] = 0.0
        if mode is FootMode.STICK:
            pin(_TANGENTIAL + foot)
        elif mode is FootMode.SLIP_FORWARD:
            low[_TANGENTIAL + foot] = 0.0
            pin(_CONE + 2 * foot + 1)
        else:
            high[_TANGENTIAL + foot] = 0.0
            pin(_CONE + 2 * foot)
    return low, high


def force_bounds(modes: Sequence[FootMode], least: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of forces or impulses, (4,) each: none on a free foot, no pulling.

    Args:
        modes: What each foot does.
        least: Least vertical force in [N] on a foot that stands alone.
    """
    stands = np.array([mode is not FootMode.FREE for mode in modes])
    high = np.where(np.repeat(stands, 2), np.inf, 0.0)
    low = np.where([True, False, True, False], -high, 0.0)
    if stands.sum() == 1:
        low[1::2][stands] = least
    return low, high
