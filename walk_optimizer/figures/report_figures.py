"""The figures of the report, drawn from our gaits: lighter is faster, line styles tell modes apart."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.figures.canvas import house_style, new_figure, save
from walk_optimizer.figures.panels import full_cycle
from walk_optimizer.figures.stick_figure import leg_points
from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import KMH_PER_MS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

HIP_ROWS, KNEE_ROWS = [2, 4], [3, 5]
# Distinct without colour: full, long dashes, dots; grey levels only support that.
_MODE_LINES = {
    SpringMode.NONE: {"color": "black", "linestyle": "-", "linewidth": 1.8},
    SpringMode.STIFFNESS: {"color": "#555555", "linestyle": (0, (5, 2)), "linewidth": 1.6},
    SpringMode.STIFFNESS_AND_EQUILIBRIUM: {"color": "#999999", "linestyle": "-", "linewidth": 2.6},
}
_MODE_NAMES = {
    SpringMode.NONE: "none: no springs",
    SpringMode.STIFFNESS: r"stiffness: $K$ chosen, $q_\mathrm{eq} = \pi$",
    SpringMode.STIFFNESS_AND_EQUILIBRIUM: r"stiffness_and_equilibrium: $K$ and $q_\mathrm{eq}$ chosen",
}


def draw_angles_of_speeds(gaits: Sequence[Gait], path: Path) -> None:
    """Draw report figure 2: hip and knee angle of one leg over a full cycle for all speeds."""
    figure = new_figure(9.5, 3.8)
    with house_style():
        hip, knee = figure.subplots(1, 2)
        for gait, grey in zip(gaits, _greys(len(gaits)), strict=True):
            degrees = np.degrees(gait.trajectory.q)
            for axes, rows in ((hip, HIP_ROWS), (knee, KNEE_ROWS)):
                time, values = full_cycle(gait, degrees[rows])
                axes.plot(50 * time / gait.request.step_time, values, color=grey, label=_speed(gait))
        for axes, title in ((hip, "Hip angle"), (knee, "Knee angle (180° is stretched)")):
            axes.set(title=title, xlabel="gait cycle [%], stance up to 50 %", ylabel="angle [°]")
            axes.set_xlim(0, 100)
            axes.axvspan(50, 100, color="#f0f1f3", zorder=0)
        figure.legend(*hip.get_legend_handles_labels(), loc="outside right center", title="speed [km/h]")
        save(figure, path)


def draw_foot_paths(gaits: Sequence[Gait], path: Path) -> None:
    """Draw report figure 3: paths of the swing foot relative to the stance foot for all speeds."""
    figure = new_figure(9.5, 3.6)
    with house_style():
        axes = figure.subplots()
        for gait, grey in zip(gaits, _greys(len(gaits)), strict=True):
            ahead, height = foot_path(gait)
            axes.plot(ahead, 1000 * height, color=grey, label=_speed(gait))
        axes.axhline(0.0, color="black", linewidth=1.2)
        axes.plot(0.0, 0.0, "^", color="black", markersize=8, clip_on=False)
        axes.set(
            xlabel="ahead of the stance foot (▲) [m]", ylabel="height [mm]", title="Path of the swing foot"
        )
        figure.legend(*axes.get_legend_handles_labels(), loc="outside right center", title="speed [km/h]")
        save(figure, path)


def foot_path(gait: Gait) -> tuple[FloatArray, FloatArray]:
    """Return how far the swing foot is ahead of the stance foot, and its height, in [m], (N,) each."""
    stance, swing = (leg_points(gait.walker, gait.trajectory.q, leg)[2] for leg in range(2))
    return swing[0] - stance[0], swing[1]


def draw_angles_of_modes(gaits: Mapping[SpringMode, Gait], path: Path) -> None:
    """Draw report figure 4: hip and knee angle over a full cycle for the three spring modes."""
    rows = {mode: np.degrees(gait.trajectory.q) for mode, gait in gaits.items()}
    hip = {mode: values[HIP_ROWS] for mode, values in rows.items()}
    knee = {mode: values[KNEE_ROWS] for mode, values in rows.items()}
    _draw_modes(gaits, {"Hip angle": hip, "Knee angle (180° is stretched)": knee}, "angle [°]", path)


def draw_torques_of_modes(gaits: Mapping[SpringMode, Gait], path: Path) -> None:
    """Draw report figure 5: hip and knee torque on one leg for the three spring modes."""
    torques = {mode: gait.trajectory.u for mode, gait in gaits.items()}
    hip = {mode: np.array([u[0], -u[0]]) for mode, u in torques.items()}
    knee = {mode: u[1:] for mode, u in torques.items()}
    _draw_modes(gaits, {"Hip torque": hip, "Knee torque (motor)": knee}, "torque [N m]", path)


def _draw_modes(
    gaits: Mapping[SpringMode, Gait],
    quantities: Mapping[str, Mapping[SpringMode, FloatArray]],
    label: str,
    path: Path,
) -> None:
    """Draw quantities of one leg, (2, N) each, over a full cycle, one panel a quantity."""
    figure = new_figure(9.5, 3.9)
    with house_style():
        panels = figure.subplots(1, 2)
        for axes, (title, values) in zip(panels, quantities.items(), strict=True):
            for mode, gait in gaits.items():
                axes.plot(*full_cycle(gait, values[mode]), label=_MODE_NAMES[mode], **_MODE_LINES[mode])
            axes.set(title=title, xlabel="time [s]", ylabel=label)
            step = next(iter(gaits.values())).request.step_time
            axes.axvspan(step, 2 * step, color="#f0f1f3", zorder=0)
            axes.set_xlim(0, 2 * step)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        save(figure, path)


def draw_sparsity(pattern: NDArray[np.bool_], points: int, path: Path) -> None:
    """Draw figure 1 of report section 3.3.1: where the Jacobian of the constraints is not zero.

    Args:
        pattern: Rows: 12 dynamics and 8 complementarity constraints of N points each, then the step
            length; columns: 23 variables of N points each, then K and q_eq. (20 N + 1, 23 N + 2).
        points: N.
        path: File to write.
    """
    figure = new_figure(7.6, 7.0)
    with house_style():
        axes = figure.subplots()
        rows, columns = np.nonzero(pattern)
        axes.scatter(columns, rows, s=0.6, color="black", linewidths=0)
        _label_blocks(axes, points)
        axes.set(xlim=(-1, pattern.shape[1]), ylim=(pattern.shape[0], -1))
        axes.set_title(f"Jacobian of the constraints, N = {points}")
        axes.set_aspect("equal")
        save(figure, path)


def _label_blocks(axes: "Axes", points: int) -> None:
    """Name the blocks of variables and constraints; between two grid lines the points run from 1 to N."""
    reactions = [rf"$\lambda_{{{foot}{part}}}$" for foot in (1, 2) for part in ("x^+", "x^-", "y")]
    letters = [
        f"${letter}_{i}$" for letter, count in (("q", 6), ("p", 6), ("u", 3)) for i in range(1, count + 1)
    ]
    columns = [*letters, *reactions, r"$\gamma_1$", r"$\gamma_2$"]
    rows = [f"${letter}_{{{i}}}$" for letter in ("dq", "dp") for i in range(1, 7)]
    rows += [rf"$\varphi_{{{i}_{foot}}}$" for foot in (1, 2) for i in range(1, 5)]
    for axis, names in ((axes.xaxis, columns), (axes.yaxis, rows)):
        axis.set_ticks(points * np.arange(len(names) + 1) - 0.5, [""] * (len(names) + 1))
        axis.set_ticks(points * (np.arange(len(names)) + 0.5), names, minor=True, fontsize=8)
        axis.set_tick_params(which="minor", length=0)


def _greys(count: int) -> list[str]:
    """Return grey levels, lighter for later ones."""
    return [str(level) for level in np.linspace(0.0, 0.75, count)]


def _speed(gait: Gait) -> str:
    return f"{gait.request.speed * KMH_PER_MS:.2f}"
