"""Panels that show parts of a gait; each draws into the axes that it is given."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.figures.canvas import FAINT, STANCE_COLOUR, SWING_COLOUR
from walk_optimizer.figures.stick_figure import leg_points
from walk_optimizer.gait import Gait

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

_POSES = 9
_DASHED = (4, 1.6)


def draw_poses(axes: "Axes", gait: Gait) -> None:
    """Draw stick figures of one step side by side, each over its own piece of ground."""
    q, length = gait.trajectory.q, gait.walker.leg_length
    legs = [leg_points(gait.walker, q, leg) for leg in range(2)]
    chosen = np.unique(np.linspace(0, q.shape[1] - 1, _POSES).round().astype(int))
    spacing = max(0.42 * length, 1.15 * gait.step_length)
    for place, index in enumerate(chosen):
        shift = np.array([[spacing * place], [0.0]])
        stance, swing = (points[:, :, index].T + shift for points in legs)
        axes.plot(*swing, color=SWING_COLOUR, linewidth=1.8, dashes=_DASHED, zorder=2)
        axes.plot(*swing[:, 1:], "o", color=SWING_COLOUR, markersize=3, zorder=3)
        axes.plot(*stance, color=STANCE_COLOUR, linewidth=3.0, solid_capstyle="round", zorder=4)
        axes.plot(*stance[:, 1], "o", color="white", markersize=2, zorder=5)
        axes.plot(*stance[:, 0], "o", color="black", markersize=7, zorder=6)
        # The outermost pieces reach as far as the swing foot.
        begin, end = -1.0 if place == 0 else -0.5, 1.0 if index == chosen[-1] else 0.5
        _draw_ground(axes, gait, spacing * np.linspace(begin, end, 60), shift[0, 0])
    axes.set_xticks(
        spacing * np.arange(len(chosen)), [f"{gait.trajectory.time[index]:.2f}" for index in chosen]
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)
    lowest = gait.walker.terrain.height(np.array([-spacing, spacing]), gait.request.step_length).min()
    axes.set_ylim(lowest - 0.06 * length, 1.1 * length)
    axes.set(title="One step", xlabel="time [s]", ylabel="height [m]")
    _name_legs(axes)


def _draw_ground(axes: "Axes", gait: Gait, places: FloatArray, shift: float) -> None:
    """Draw the ground at places from the stance foot of a pose, both in [m], at its place in the picture."""
    height = gait.walker.terrain.height(places, gait.request.step_length)
    axes.plot(places + shift, height, color="black", linewidth=1.2, zorder=1)


def _name_legs(axes: "Axes") -> None:
    """Write a legend for the stick figures above them."""
    from matplotlib.lines import Line2D

    legs = [
        Line2D([], [], color=STANCE_COLOUR, linewidth=3.0, label="stance leg"),
        Line2D([], [], color=SWING_COLOUR, linewidth=1.8, dashes=_DASHED, label="swing leg"),
    ]
    axes.legend(handles=legs, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2, borderaxespad=0.1)


def draw_foot_path(axes: "Axes", gait: Gait) -> None:
    """Draw the path of the swing foot relative to the stance foot, its height enlarged."""
    stance, swing = (leg_points(gait.walker, gait.trajectory.q, leg)[2] for leg in range(2))
    gap = gait.walker.terrain.gap(swing, gait.request.step_length)
    axes.plot(swing[0] - stance[0], 1000 * gap, color=SWING_COLOUR)
    axes.axhline(0.0, color="black", linewidth=1.2)
    axes.plot(0.0, 0.0, "^", color=STANCE_COLOUR, markersize=8, clip_on=False, label="stance foot")
    axes.legend(loc="upper center")
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom, top + 0.25 * (top - bottom))
    axes.set(
        title="Path of the swing foot", xlabel="ahead of the stance foot [m]", ylabel="above ground [mm]"
    )


def full_cycle(gait: Gait, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return time in [s] and a quantity of one leg over a full cycle, (2 N,) each.

    Args:
        gait: The gait.
        rows: The quantity while the leg is leg 1, the stance leg, and while it is leg 2, (2, N).
    """
    time = gait.trajectory.time
    return np.concatenate([time, time + gait.request.step_time]), np.concatenate([rows[0], rows[1]])


def draw_angles(hip: "Axes", knee: "Axes", gait: Gait) -> None:
    """Draw hip and knee angle of one leg over a full cycle."""
    degrees = np.degrees(gait.trajectory.q)
    for axes, rows, title in ((hip, [2, 4], "Hip angle"), (knee, [3, 5], "Knee angle (180° is stretched)")):
        axes.plot(*full_cycle(gait, degrees[rows]), color=STANCE_COLOUR)
        axes.set(title=title, ylabel="angle [°]")
        _mark_phases(axes, gait)
    if gait.spring.stiffness > 0:
        relaxed = math.degrees(gait.spring.equilibrium)
        knee.axhline(relaxed, color=FAINT, dashes=(5, 3), linewidth=1.0)
        knee.annotate(
            r"$q_\mathrm{eq}$",
            (1, relaxed),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            color=FAINT,
        )
    hip.set_title("of one leg; shaded: its swing", loc="right", fontsize=8.5, color=FAINT)


def draw_torques(hip: "Axes", knee: "Axes", gait: Gait) -> None:
    """Draw the torques at hip and knee of one leg over a full cycle, and the spring's at the knee."""
    u, q, spring = gait.trajectory.u, gait.trajectory.q, gait.spring
    hip.plot(*full_cycle(gait, np.array([u[0], -u[0]])), color=STANCE_COLOUR)
    hip.set(title="Hip torque", ylabel="torque [N m]")
    knee.plot(*full_cycle(gait, u[1:]), color=STANCE_COLOUR, label="motor")
    if spring.stiffness > 0:
        torque = spring.stiffness * (spring.equilibrium - q[[3, 5]])
        knee.plot(*full_cycle(gait, torque), color=SWING_COLOUR, dashes=_DASHED, label="spring")
        knee.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2, borderaxespad=0.1)
    knee.set(title="Knee torque", ylabel="torque [N m]")
    for axes in (hip, knee):
        _mark_phases(axes, gait)


def draw_reaction(vertical: "Axes", horizontal: "Axes", gait: Gait) -> None:
    """Draw the ground reaction on one foot over a full cycle, in body weights.

    The impact is one point, many times the weight: it is written, and the axis shows the rest.
    """
    reaction = gait.trajectory.reaction / gait.walker.weight
    up, forward = reaction[[2, 5]], reaction[[0, 3]] - reaction[[1, 4]]
    for axes, rows, title in (
        (vertical, up, f"Vertical ground reaction / body weight ({gait.walker.weight:.0f} N)"),
        (horizontal, forward, "Horizontal ground reaction / body weight"),
    ):
        time, values = full_cycle(gait, rows)
        axes.plot(time, values, color=STANCE_COLOUR)
        axes.set(title=title, ylabel="force [-]", xlabel="time [s]")
        _limit_to_bulk(axes, time, values)
        _mark_phases(axes, gait)


def _limit_to_bulk(axes: "Axes", time: FloatArray, values: FloatArray) -> None:
    """Let the axis show all but single points far outside, and write the largest of those."""
    low, high = (float(bound) for bound in np.percentile(values, [1, 99]))
    margin = 0.15 * max(high - low, 0.1)
    peak = int(np.argmax(np.abs(values)))
    clipped = not low - margin <= values[peak] <= high + margin
    down, up = (3 if clipped and values[peak] < 0 else 1), (3 if clipped and values[peak] > 0 else 1)
    axes.set_ylim(min(low, 0.0) - down * margin, max(high, 0.0) + up * margin)
    if clipped:
        upwards = bool(values[peak] > 0)
        axes.annotate(
            f"impact {values[peak]:.1f}",
            (time[peak], axes.get_ylim()[upwards]),
            xytext=(7, -10 if upwards else 4),
            textcoords="offset points",
            fontsize=8.5,
        )


def _mark_phases(axes: "Axes", gait: Gait) -> None:
    """Shade the swing phase of the leg, which is the second half of the cycle."""
    step = gait.request.step_time
    axes.axvspan(step, 2 * step, color="#f0f1f3", zorder=0)
    axes.set_xlim(0, 2 * step)
