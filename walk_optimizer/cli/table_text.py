"""Table I of the report beside ours, as text: blocks of columns, one for each spring mode."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from walk_optimizer.cli.text import aligned, cost, markdown_line, number
from walk_optimizer.errors import GaitNotFoundError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.library.report_table import ReportResult, reported
from walk_optimizer.model.parameters import KneeSpring, SpringMode
from walk_optimizer.request import KMH_PER_MS, gait_table_settings

Rows = list[Sequence[str]]

_LEGEND = """\
{cost}, K in N m/rad, q_eq in rad. F% = 100 F / F of none at the same speed.
A dash: not in the library, or not in the report."""
_COSTS = {
    False: "F = sum over the grid points of |u|^2 / 2 in (N m)^2",
    True: "F = integral over the step of |u|^2 / 2 dt in (N m)^2 s, on the refined grid",
}


@dataclass(frozen=True)
class _Shown:
    """What the table shows of a gait: its springs and its cost."""

    spring: KneeSpring
    cost: float


def table_text(library: GaitLibrary, *, refined: bool = False) -> str:
    """Return the table, one line for each speed, of the report's grid or of the refined one."""
    speeds = gait_table_settings().table_speeds()
    nominal = _nominal(library, speeds, refined)
    blocks = [
        _block("speed", [("m/s", "km/h", "report"), *_speed_rows(speeds)]),
        _block("none", [("F",), *((cost(value),) for value in nominal)]),
    ]
    for mode in (SpringMode.STIFFNESS, SpringMode.STIFFNESS_AND_EQUILIBRIUM):
        blocks.append(_block(mode.value, _our_rows(library, mode, nominal, refined)))
        blocks.append(_block("report", _report_rows(speeds, mode)))
    return (
        "\n".join(" | ".join(line).rstrip() for line in zip(*blocks, strict=True))
        + f"\n{_LEGEND.format(cost=_COSTS[refined])}"
    )


def markdown_table(library: GaitLibrary, *, refined: bool = False) -> str:
    """Return the table as Markdown; bold where our F% is at or below the report's."""
    speeds = gait_table_settings().table_speeds()
    nominal = _nominal(library, speeds, refined)
    columns = [
        ["km/h", "---", *(f"{speed * KMH_PER_MS:.2f}" for speed in speeds)],
        ["none: F", "---", *map(cost, nominal)],
    ]
    for mode in (SpringMode.STIFFNESS, SpringMode.STIFFNESS_AND_EQUILIBRIUM):
        head, *ours = _our_rows(library, mode, nominal, refined)
        marked = [_marked(row, _result(speed, mode)) for row, speed in zip(ours, speeds, strict=True)]
        columns.append([f"{mode.value}: {', '.join(head)}", "---", *map(", ".join, marked)])
        head, *theirs = _report_rows(speeds, mode)
        columns.append([f"report: {', '.join(head)}", "---", *map(", ".join, theirs)])
    return "\n".join(markdown_line(line) for line in zip(*columns, strict=True))


def _marked(row: Sequence[str], result: ReportResult | None) -> list[str]:
    """Return a row whose last entry, F%, is bold when it is at or below the report's."""
    *rest, share = row
    better = result is not None and share != "-" and float(share) <= result.relative_objective
    return [*rest, f"**{share}**" if better else share]


def _block(title: str, rows: Rows) -> list[str]:
    """Return the lines of a block, equally wide, under its title and a rule."""
    lines = aligned(rows).splitlines()
    width = max(len(title), *map(len, lines))
    body = [line.rjust(width) for line in lines]
    return [title.center(width), body[0], "-" * width, *body[1:]]


def _speed_rows(speeds: Sequence[float]) -> Rows:
    """Return speeds in both units and as the report prints them, cut off after two decimals."""
    rows = ((speed, reported(speed)) for speed in speeds)
    return [
        (f"{speed:.4f}", f"{speed * KMH_PER_MS:.2f}", f"{row.speed_kmh:.2f}" if row else "-")
        for speed, row in rows
    ]


def _our_rows(library: GaitLibrary, mode: SpringMode, nominal: Sequence[float], refined: bool) -> Rows:
    """Return K, q_eq where it is free, F and F% of the library's gaits."""
    free = mode is SpringMode.STIFFNESS_AND_EQUILIBRIUM
    rows: Rows = [("K", *(["q_eq"] if free else []), "F", "F%")]
    for speed, reference in zip(gait_table_settings().table_speeds(), nominal, strict=True):
        shown = _shown(library, speed, mode, refined)
        if shown is None:
            rows.append(["-"] * len(rows[0]))
            continue
        equilibrium = [f"{shown.spring.equilibrium:.3f}"] if free else []
        share = number(100 * shown.cost / reference, ".1f")
        rows.append((f"{shown.spring.stiffness:.2f}", *equilibrium, cost(shown.cost), share))
    return rows


def _report_rows(speeds: Sequence[float], mode: SpringMode) -> Rows:
    """Return K, q_eq where it was free, and F% of the report."""
    free = mode is SpringMode.STIFFNESS_AND_EQUILIBRIUM
    rows: Rows = [("K", *(["q_eq"] if free else []), "F%")]
    for speed in speeds:
        result = _result(speed, mode)
        if result is None:
            rows.append(["-"] * len(rows[0]))
            continue
        equilibrium = [f"{result.equilibrium:.2f}"] if free else []
        rows.append((f"{result.stiffness:.2f}", *equilibrium, f"{result.relative_objective:.0f}"))
    return rows


def _result(speed: float, mode: SpringMode) -> ReportResult | None:
    """Return what the report found; None where it has no such speed."""
    row = reported(speed)
    return row.results[mode] if row else None


def _nominal(library: GaitLibrary, speeds: Sequence[float], refined: bool) -> list[float]:
    """Return F without springs at each speed, NaN where it is not in the library."""
    found = [_shown(library, speed, SpringMode.NONE, refined) for speed in speeds]
    return [math.nan if shown is None else shown.cost for shown in found]


def _shown(library: GaitLibrary, speed: float, mode: SpringMode, refined: bool) -> _Shown | None:
    """Return springs and cost of a gait of the library; None when it is not there."""
    try:
        gait, _ = library.find(speed, mode)
    except GaitNotFoundError:
        return None
    if not refined:
        return _Shown(gait.spring, gait.objective)
    if gait.refined is None:
        return None
    return _Shown(gait.refined.spring, gait.refined.trajectory.torque_effort)
