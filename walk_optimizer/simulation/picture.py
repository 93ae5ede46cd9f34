"""A simulated walk on one page."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.figures.canvas import (
    FAINT,
    STANCE_COLOUR,
    SWING_COLOUR,
    house_style,
    new_figure,
    save,
)
from walk_optimizer.figures.stick_figure import leg_points
from walk_optimizer.gait import Gait
from walk_optimizer.request import KMH_PER_MS
from walk_optimizer.simulation.closed_loop import ClosedLoop
from walk_optimizer.simulation.step import Stride
from walk_optimizer.simulation.walk import Disturbance, SimulatedWalk

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

_FIGURES_A_STEP = 5
_STEPS_DRAWN = 8
_SWING_UPPER_LEG, _ITS_RATE = 2, 6
# Less is the accuracy of the reference, in [rad].
_LEAST_DEVIATION = 1e-6


def walk_picture(
    gait: Gait, loop: ClosedLoop, walk: SimulatedWalk, disturbance: Disturbance, path: Path
) -> None:
    """Draw a walk: stick figures, the swing leg in its phase plane, how far it is from the gait.

    Args:
        gait: What is walked.
        loop: The gait with its feedback.
        walk: The walk.
        disturbance: What went wrong in it.
        path: File to write; its ending chooses png, pdf or svg.

    Raises:
        MissingDependencyError: matplotlib is not installed.
        GaitFileError: the file can't be written.
    """
    figure = new_figure(10.5, 7.0)
    with house_style():
        figure.suptitle(_title(gait, walk, disturbance), x=0.012, ha="left", fontsize=10.5)
        top, bottom = figure.subfigures(2, 1, height_ratios=[1, 1.25])
        _draw_figures(top.subplots(), loop, walk)
        plane, distance = bottom.subplots(1, 2)
        _draw_plane(plane, loop, walk)
        _draw_deviation(distance, loop, walk, disturbance)
        save(figure, path)


def _title(gait: Gait, walk: SimulatedWalk, disturbance: Disturbance) -> str:
    parts = [f"{gait.speed * KMH_PER_MS:.2f} km/h", f"springs: {gait.request.spring_mode.value}"]
    if disturbance.push.impulse:
        parts.append(f"push of {disturbance.push.impulse:g} N s in step {disturbance.step}")
    if disturbance.step_down:
        parts.append(f"{disturbance.step_down:g} m down in step {disturbance.step}")
    fell = walk.ending.sentence if walk.ending.is_fall else "still walking"
    return "   ·   ".join([*parts, f"{len(walk.completed)} steps, {fell}"])


def _places(walk: SimulatedWalk) -> Iterator[tuple[Stride, FloatArray, float]]:
    """Return each step with the place of its stance foot in [m] and the time at its start in [s]."""
    place, time = np.zeros(2), 0.0
    for stride in walk.strides:
        yield stride, place, time
        place, time = place + stride.foot, time + float(stride.time[-1])


def _draw_figures(axes: "Axes", loop: ClosedLoop, walk: SimulatedWalk) -> None:
    """Draw stick figures of the first steps."""
    for number, (stride, place, _) in enumerate(_places(walk)):
        if number == _STEPS_DRAWN:
            break
        chosen = np.linspace(0, len(stride.time) - 1, _FIGURES_A_STEP, endpoint=False).astype(int)
        angles = stride.states[chosen, :4].T
        hips = np.array([loop.plant.hip(state) for state in stride.states[chosen]]).T + place[:, None]
        q = np.vstack([hips, angles])
        # Left and right leg keep their colours; legs 1 and 2 trade names at every step.
        for leg, colour in enumerate((STANCE_COLOUR, SWING_COLOUR)[:: 1 if number % 2 == 0 else -1]):
            points = leg_points(loop.plant.walker, q, leg)
            axes.plot(points[:, 0], points[:, 1], color=colour, linewidth=0.9, alpha=0.8)
        axes.plot([place[0]], [place[1]], "k.", markersize=4)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(f"the first {min(_STEPS_DRAWN, len(walk.strides))} steps; dots: where feet stood")


def _draw_plane(axes: "Axes", loop: ClosedLoop, walk: SimulatedWalk) -> None:
    """Draw angle and rate of the swinging upper leg."""
    for stride in walk.strides:
        axes.plot(
            stride.states[:, _SWING_UPPER_LEG],
            stride.states[:, _ITS_RATE],
            color=SWING_COLOUR,
            linewidth=0.9,
            alpha=0.8,
        )
    states = loop.reference.states
    axes.plot(states[:, _SWING_UPPER_LEG], states[:, _ITS_RATE], color=STANCE_COLOUR, label="the gait")
    axes.plot([], [], color=SWING_COLOUR, label="the walk")
    axes.set_xlabel("swinging upper leg [rad]")
    axes.set_ylabel("its rate [rad/s]")
    axes.set_title("phase plane")
    axes.legend()


def _draw_deviation(axes: "Axes", loop: ClosedLoop, walk: SimulatedWalk, disturbance: Disturbance) -> None:
    """Draw how far the joints are from the gait at the same place of the hip."""
    for number, (stride, _, start) in enumerate(_places(walk), 1):
        deviations = [np.abs(loop.feedback.deviation(state)[:4]).max() for state in stride.states]
        axes.semilogy(start + stride.time, deviations, color=STANCE_COLOUR)
        axes.axvline(start, color=FAINT, linewidth=0.5)
        if number == disturbance.step and disturbance.push.impulse:
            push = disturbance.push
            axes.axvspan(start + push.start, start + push.end, color=SWING_COLOUR, alpha=0.4, label="push")
            axes.legend()
    axes.set_ylim(bottom=_LEAST_DEVIATION)
    axes.set_xlabel("time [s]; lines: touch-downs")
    axes.set_ylabel("[rad]")
    axes.set_title("largest deviation of a joint from the gait")
