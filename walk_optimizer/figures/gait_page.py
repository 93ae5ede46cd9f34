"""A gait on one page."""

from pathlib import Path

from walk_optimizer.figures import panels
from walk_optimizer.figures.canvas import house_style, new_figure, save
from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import KMH_PER_MS


def gait_picture(gait: Gait, path: Path) -> None:
    """Draw a gait: stick figures of a step, angles and torques of a cycle, ground reaction.

    Args:
        gait: The gait.
        path: File to write; its ending chooses png, pdf or svg.

    Raises:
        MissingDependencyError: matplotlib is not installed.
        GaitFileError: the file can't be written.
    """
    figure = new_figure(10.5, 9.0)
    with house_style():
        figure.suptitle(_title(gait), x=0.012, ha="left", fontsize=10.5)
        top, bottom = figure.subfigures(2, 1, height_ratios=[1, 2.1])
        poses, foot_path = top.subplots(1, 2, width_ratios=[2.6, 1])
        panels.draw_poses(poses, gait)
        panels.draw_foot_path(foot_path, gait)
        rows = bottom.subplots(3, 2)
        drawings = (panels.draw_angles, panels.draw_torques, panels.draw_reaction)
        for (left, right), draw in zip(rows, drawings, strict=True):
            draw(left, right, gait)
        save(figure, path)


def _title(gait: Gait) -> str:
    """Return speed, mode, springs and cost as one line."""
    mode = gait.request.spring_mode
    parts = [f"{gait.speed:.4f} m/s ({gait.speed * KMH_PER_MS:.2f} km/h)", f"springs: {mode.value}"]
    if mode is not SpringMode.NONE:
        equilibrium = f"$q_\\mathrm{{eq}}$ = {gait.spring.equilibrium:.3f} rad"
        parts.append(f"K = {gait.spring.stiffness:.1f} N m/rad, {equilibrium}")
    parts.append(f"F = {gait.objective:.4g} (N m)², N = {gait.request.points}")
    return "   ·   ".join(parts)
