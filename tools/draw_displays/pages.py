"""The windows of RViz and Foxglove, as rviz/walker.rviz and foxglove/walker.json lay them out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from camera import foxglove_camera, rviz_camera
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from recording import Recording
from sensor_msgs.msg import JointState
from view3d import View3D

ROOT = Path(__file__).resolve().parents[2]
# Length of a frame's axes when a layout says nothing, [m].
FOXGLOVE_AXIS = 0.154


def draw_rviz(recording: Recording, path: Path) -> None:
    """Draw the view of RViz with its list of displays."""
    config = yaml.safe_load((ROOT / "rviz" / "walker.rviz").read_text(encoding="utf-8"))
    manager = config["Visualization Manager"]
    figure = new_figure(12.0, 7.2)
    side, middle = figure.add_axes((0.0, 0.0, 0.25, 1.0)), figure.add_axes((0.25, 0.0, 0.75, 1.0))
    colour = [int(part) / 255 for part in manager["Global Options"]["Background Color"].split(";")]
    middle.set_facecolor(colour)
    view = View3D(middle, rviz_camera(manager["Views"]["Current"], recording), recording, 9.0 / 7.2)
    lines = [("Global Options", f"Fixed Frame: {manager['Global Options']['Fixed Frame']}")]
    for display in manager["Displays"]:
        kind = display["Class"].split("/")[1]
        topic = display.get("Description Topic") or display.get("Topic") or {"Value": "tf"}
        lines.append((f"{display['Name']} ({kind})", topic["Value"]))
        if kind == "RobotModel":
            view.robot()
        elif kind == "TF":
            view.frames(0.2 * display["Marker Scale"])
        else:
            shown = {name for name, enabled in display["Namespaces"].items() if enabled}
            view.markers(shown)
            lines += [("", f"    {name}") for name in sorted(shown)]
    list_displays(side, lines)
    figure.savefig(path, dpi=110)


def list_displays(axes: Axes, lines: list[tuple[str, str]]) -> None:
    """Write what a program displays."""
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
    axes.set_facecolor("#fafafa")
    y = 0.965
    axes.text(0.05, y, "Displays", fontsize=12, weight="bold", va="center")
    for title, text in lines:
        if title:
            y -= 0.05
            axes.text(0.05, y, f"\N{BALLOT BOX WITH CHECK} {title}", fontsize=9.5, va="center")
        y -= 0.03
        axes.text(0.12, y, text, fontsize=8.5, color="#555555", va="center", family="monospace")


def draw_foxglove(recording: Recording, path: Path) -> None:
    """Draw the panels of the Foxglove layout."""
    layout = json.loads((ROOT / "foxglove" / "walker.json").read_text(encoding="utf-8"))
    figure = new_figure(13.0, 7.2)
    for name, (left, bottom, width, height) in rectangles(layout["layout"], (0.0, 0.0, 1.0, 1.0)).items():
        panel = layout["configById"][name]
        title = figure.add_axes((left, bottom + height - 0.045, width, 0.045))
        title.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[], facecolor="#ffffff")
        title.text(0.012, 0.45, panel["foxglovePanelTitle"], fontsize=10, va="center")
        body = (left, bottom, width, height - 0.045)
        if name.startswith("3D!"):
            axes = figure.add_axes(body)
            axes.set_facecolor(panel["scene"]["backgroundColor"])
            aspect = body[2] * 13.0 / (body[3] * 7.2)
            view = View3D(axes, foxglove_camera(panel, recording), recording, aspect)
            view.robot()
            view.frames(FOXGLOVE_AXIS)
            (topic,) = (one for one in panel["topics"].values() if one["visible"])
            view.markers({name for name, settings in topic["namespaces"].items() if settings["visible"]})
        else:
            inner = (left + 0.052, bottom + 0.055, width - 0.066, height - 0.13)
            plot(figure.add_axes(inner), panel, recording.references)
    figure.savefig(path, dpi=110)


def rectangles(part: Any, box: tuple[float, float, float, float]) -> dict[str, tuple[float, ...]]:
    """Return the place of each panel of a layout: left, bottom, width, height."""
    if isinstance(part, str):
        return {part: box}
    left, bottom, width, height = box
    share = part["splitPercentage"] / 100
    if part["direction"] == "row":
        first = left, bottom, width * share, height
        second = left + width * share, bottom, width * (1 - share), height
    else:
        first = left, bottom + height * (1 - share), width, height * share
        second = left, bottom, width, height * (1 - share)
    return rectangles(part["first"], first) | rectangles(part["second"], second)


def plot(axes: Axes, panel: dict[str, Any], references: list[JointState]) -> None:
    """Draw the lines of a plot panel over the time that it follows."""
    stamps = np.array([one.header.stamp.sec + one.header.stamp.nanosec * 1e-9 for one in references])
    window = stamps > stamps[-1] - panel["followingViewWidth"]
    for line in panel["paths"]:
        field_name, index = line["value"].rsplit(".", 1)[1].rstrip("]").split("[")
        values = np.array([getattr(one, field_name)[int(index)] for one in references])
        axes.plot(
            stamps[window] - stamps[-1],
            values[window],
            color=line["color"],
            linewidth=1.2,
            label=line["label"],
        )
    axes.set_ylabel(panel["yAxisLabel"], fontsize=8)
    axes.set_xlim(-panel["followingViewWidth"], 0)
    axes.set_xlabel("time [s], 0 is now", fontsize=8, labelpad=1)
    axes.tick_params(labelsize=8)
    axes.grid(color="#e4e6ea", linewidth=0.6)
    axes.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 0.98), ncols=4, fontsize=8, frameon=False, columnspacing=1.0
    )


def new_figure(width: float, height: float) -> Figure:
    """Return an empty picture of a size in [inch]."""
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure
