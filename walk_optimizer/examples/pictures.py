"""Pictures of the examples: poses at even times, and what each point of contact does below them."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.examples.finding import Finding, runs
from walk_optimizer.examples.finger import FingerMotion
from walk_optimizer.examples.finger_problem import Q
from walk_optimizer.examples.standing_start import StandingMotion
from walk_optimizer.examples.terrain_gait import TerrainGait
from walk_optimizer.figures.canvas import FAINT, STANCE_COLOUR, SWING_COLOUR, house_style, new_figure, save
from walk_optimizer.figures.stick_figure import leg_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

_POSES = 9
_DASHED = (4, 1.6)
# Between the poses of a walker in [m].
_SPACING = 0.45
# Fill and hatch of the bars that show a contact; a free point has none.
_BARS = {
    FootMode.STICK: {"facecolor": "#4a4f57", "edgecolor": "#4a4f57"},
    FootMode.SLIP_FORWARD: {"facecolor": "white", "edgecolor": "#4a4f57", "hatch": "////"},
    FootMode.SLIP_BACKWARD: {"facecolor": "white", "edgecolor": "#4a4f57", "hatch": "\\\\\\\\"},
}
_BAR_NAMES = {
    FootMode.STICK: "sticks",
    FootMode.SLIP_FORWARD: "slips forward",
    FootMode.SLIP_BACKWARD: "slips backward",
}


def draw_walk(motion: StandingMotion | TerrainGait, path: Path) -> None:
    """Draw poses of a walker on its ground, and its contacts."""
    _draw(motion.finding, path, lambda axes: _walker_poses(axes, motion))


def draw_finger(motion: FingerMotion, path: Path) -> None:
    """Draw poses of a finger with its disc, and their contacts."""
    _draw(motion.finding, path, lambda axes: _finger_poses(axes, motion))


def _draw(finding: Finding, path: Path, draw_poses: Callable[["Axes"], None]) -> None:
    figure = new_figure(9.5, 5.4)
    with house_style():
        poses, contacts = figure.subplots(2, 1, height_ratios=[3.4, 1])
        draw_poses(poses)
        poses.set_aspect("equal")
        poses.grid(visible=False)
        poses.set_title(finding.title)
        _draw_contacts(contacts, finding)
        save(figure, path)


def _chosen(count: int) -> NDArray[np.int64]:
    """Return the indices of the poses to draw."""
    return np.unique(np.linspace(0, count - 1, _POSES).round().astype(np.int64))


def _shade(place: float) -> float:
    """Return the opacity of a pose: later ones are darker."""
    return 0.25 + 0.75 * place


def _walker_poses(axes: "Axes", motion: StandingMotion | TerrainGait) -> None:
    """Draw leg 1 in full lines, leg 2 dashed, the hip as a dot, each pose over its own piece of ground."""
    walker, q, time = motion.walker, motion.trajectory.q, motion.trajectory.time
    legs = [leg_points(walker, q, leg) for leg in range(2)]
    tread = motion.request.step_length if isinstance(motion, TerrainGait) else 1.0
    chosen, hips = _chosen(q.shape[1]), []
    for place, index in enumerate(chosen):
        shift = np.array([[_SPACING * place], [0.0]])
        first, second = (points[:, :, index].T + shift for points in legs)
        ground = np.linspace(-0.5, 0.5, 50) * _SPACING + q[0, index]
        axes.plot(ground + shift[0], walker.terrain.height(ground, tread), color="black", linewidth=1.2)
        axes.plot(*second, color=SWING_COLOUR, linewidth=1.8, dashes=_DASHED)
        axes.plot(*first, color=STANCE_COLOUR, linewidth=2.6)
        axes.plot(*first[:, 0], "o", color="black", markersize=6)
        hips.append(first[0, 0])
    axes.set_xticks(hips, [f"{time[index]:.2f}" for index in chosen])
    axes.set(xlabel="time [s]; leg 1 full, leg 2 dashed, poses drawn apart", ylabel="y [m]")


def _finger_poses(axes: "Axes", motion: FingerMotion) -> None:
    """Draw the finger in full lines and the disc with a spoke; later poses are darker."""
    from matplotlib.patches import Circle

    finger, q = motion.finger, motion.points[Q]
    for index in _chosen(q.shape[1]):
        shade, (shoulder, elbow, x, y, angle) = _shade(index / q.shape[1]), q[:, index]
        bends = np.cumsum([shoulder, elbow])
        links = finger.link * np.cumsum(np.array([np.sin(bends), -np.cos(bends)]), axis=1)
        base = np.array([[finger.base_x], [finger.base_y]])
        axes.plot(*np.hstack([base, base + links]), "o-", color=STANCE_COLOUR, alpha=shade, markersize=3)
        outline = {"fill": False, "edgecolor": SWING_COLOUR, "linewidth": 1.6, "alpha": shade}
        axes.add_patch(Circle((x, y), finger.disc_radius, **outline))
        spoke = finger.disc_radius * np.array([np.cos(angle), np.sin(angle)])
        axes.plot([x, x + spoke[0]], [y, y + spoke[1]], color=SWING_COLOUR, alpha=shade)
    axes.axhline(0.0, color="black", linewidth=1.2)
    axes.set(xlabel="x [m]; later poses are darker", ylabel="y [m]")


def _draw_contacts(axes: "Axes", finding: Finding) -> None:
    """Draw a bar for each point of contact: filled where it sticks, hatched where it slips."""
    from matplotlib.patches import Patch

    for row, modes in enumerate(finding.schedule):
        for begin, end, mode in runs(modes):
            if mode in _BARS:
                span = (begin * finding.interval, (end - begin) * finding.interval)
                axes.broken_barh([span], (row - 0.35, 0.7), **_BARS[mode])
    axes.set_yticks(range(len(finding.points)), finding.points)
    axes.invert_yaxis()
    axes.set_xlim(0, finding.schedule.shape[1] * finding.interval)
    axes.set(xlabel="time [s]")
    axes.grid(visible=False)
    handles = [Patch(label=_BAR_NAMES[mode], **style) for mode, style in _BARS.items()]
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)
    axes.set_title("contacts that were found; blank: free", color=FAINT, fontsize=8.5)
