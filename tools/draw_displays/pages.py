"""The window of RViz, as rviz/walker.rviz lays it out."""

from __future__ import annotations

from pathlib import Path

import yaml
from camera import rviz_camera
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from recording import Recording
from view3d import View3D

ROOT = Path(__file__).resolve().parents[2]


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


def new_figure(width: float, height: float) -> Figure:
    """Return an empty picture of a size in [inch]."""
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure
