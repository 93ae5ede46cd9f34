"""Gaits, reports and certificates as texts for people."""

import math
from collections.abc import Sequence

from walk_optimizer.gait import Certificate, Gait
from walk_optimizer.request import KMH_PER_MS, GaitRequest
from walk_optimizer.solve.status import SolveReport


def speed_text(speed: float) -> str:
    """Return a speed in [m/s] in both units."""
    return f"{speed:.4f} m/s ({speed * KMH_PER_MS:.2f} km/h)"


def request_text(request: GaitRequest) -> str:
    """Return a request as one line."""
    return (
        f"{speed_text(request.speed)}, step of {request.step_length:.4f} m in {request.step_time:.4f} s, "
        f"springs {request.spring_mode.value}, N = {request.points}"
    )


def gait_text(gait: Gait) -> str:
    """Return what a gait costs and which springs it has."""
    spring = gait.spring
    return "\n".join(
        [
            f"F              {gait.objective:.6g} (N m)^2, sum over N = {gait.request.points} of |u|^2 / 2",
            f"torque effort  {gait.torque_effort:.6g} (N m)^2 s, its integral over the step",
            f"K              {spring.stiffness:.4g} N m/rad",
            f"q_eq           {spring.equilibrium:.4f} rad",
            f"step           {gait.step_length:.4f} m, {speed_text(gait.speed)}",
        ]
    )


def refinement_text(gait: Gait) -> str:
    """Return what refining a gait led to, as one line."""
    if gait.refined is None:
        return "no: what is walked is the gait on the report's grid"
    refined, worst = gait.refined, gait.refined.certificate.worst
    return (
        f"{refined.trajectory.intervals} intervals, torque effort "
        f"{refined.trajectory.torque_effort:.6g} (report's grid: {gait.torque_effort:.6g}), "
        f"{worst.family} at {worst.relative:.0%} of its limit"
    )


def report_text(report: SolveReport) -> str:
    """Return how a solve went."""
    effort = f"{report.starts} starts, {report.iterations} iterations, {report.solve_time:.2f} s"
    return (
        f"status         {report.status.value}: {report.message}\n"
        f"solver         {report.back_end or '-'}, {effort}; kept: {report.start or '-'}"
    )


def certificate_text(certificate: Certificate) -> str:
    """Return the residuals as a table."""
    rows = [
        (
            entry.family,
            f"{entry.violation:.2e}",
            f"{entry.tolerance:.2e}",
            entry.unit,
            "" if entry.met else "FAILED",
        )
        for entry in certificate.entries
    ]
    return aligned([("certificate", "residual", "allowed", "unit", ""), *rows], left=(0, 3, 4))


def aligned(rows: Sequence[Sequence[str]], left: Sequence[int] = ()) -> str:
    """Return rows in columns as wide as their widest text.

    Args:
        rows: Texts, equally many in each row.
        left: Columns that are aligned on the left; the others are on the right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(
            text.ljust(width) if column in left else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


def markdown_line(cells: Sequence[str]) -> str:
    """Return a line of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def number(value: float, pattern: str) -> str:
    """Return a number, or a dash where there is none."""
    return "-" if math.isnan(value) else format(value, pattern)


def cost(value: float) -> str:
    """Return F with three or four digits, written out."""
    return number(value, ".0f" if value >= 1000 else ".1f" if value >= 10 else ".3g")
