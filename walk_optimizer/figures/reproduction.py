"""The report again, from what this project computes: Table I and its figures, with what differs.

Every sentence that is written is made from the gaits at hand: no number is typed in.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.figures import report_figures as draw
from walk_optimizer.gait import Gait
from walk_optimizer.gait_files.access import write_text
from walk_optimizer.library import GaitLibrary
from walk_optimizer.library.report_table import TABLE_I
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import KMH_PER_MS, GaitRequest, gait_table_settings
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.problems import complementarity_problem

# The speed of figures 4 and 5, by its place in the report's table: 1.15 km/h.
_CLOSE_UP = 1
_SPARSITY_POINTS = 20
# A knee bends for a "dent" when it stretches again by this much, in [degrees].
_DENT = 0.5

ModeGaits = dict[SpringMode, list[Gait]]


def reproduce(library: GaitLibrary, folder: Path, table: str) -> Path:
    """Draw the figures and write the page that compares them with the report.

    Args:
        library: Must hold the whole table.
        folder: Existing folder for the figures and the page.
        table: Table I as text.

    Returns:
        The page, `reproduction.md`.

    Raises:
        ConfigurationError: the table has not all speeds of the report.
        GaitNotFoundError: an entry of the table is missing.
        MissingDependencyError: matplotlib is not installed.
        GaitFileError: a file can't be written.
    """
    speeds = report_speeds()
    gaits = {mode: [library.find(speed, mode)[0] for speed in speeds] for mode in SpringMode}
    nominal, close_up = gaits[SpringMode.NONE], {mode: gaits[mode][_CLOSE_UP] for mode in SpringMode}
    draw.draw_sparsity(sparsity(library.walker, _SPARSITY_POINTS), _SPARSITY_POINTS, folder / "figure_1.png")
    draw.draw_angles_of_speeds(nominal, folder / "figure_2.png")
    draw.draw_foot_paths(nominal, folder / "figure_3.png")
    draw.draw_angles_of_modes(close_up, folder / "figure_4.png")
    draw.draw_torques_of_modes(close_up, folder / "figure_5.png")
    page = folder / "reproduction.md"
    write_text(page, _page(gaits, close_up, library.walker, table))
    return page


def report_speeds() -> list[float]:
    """Return the speeds of the table that are those of the report, in [m/s], slowest first.

    Raises:
        ConfigurationError: the table lacks one.
    """
    speeds = gait_table_settings().table_speeds()
    nearest = [min(speeds, key=row.distance) for row in TABLE_I]
    lacking = [
        f"{row.speed_kmh:.2f}" for row, speed in zip(TABLE_I, nearest, strict=True) if not row.is_of(speed)
    ]
    if lacking:
        raise ConfigurationError(
            "the report's table and figures need gaits of all its speeds; the table of "
            f"config/gait_table.yaml, with {len(speeds)} gaits, lacks {', '.join(lacking)} km/h"
        )
    return nearest


def sparsity(walker: WalkerParameters, points: int) -> NDArray[np.bool_]:
    """Return the pattern of the constraints' Jacobian in the order of the report, (20 N + 1, 23 N + 2).

    A complementarity constraint takes part with its product: phi(a, b) depends on the same variables.
    """
    speed = TABLE_I[_CLOSE_UP].speed_kmh / KMH_PER_MS
    request = GaitRequest.for_speed(speed, SpringMode.STIFFNESS_AND_EQUILIBRIUM, points)
    jacobian = complementarity_problem(request, walker, 1e-8).nlp.jacobian.sparsity_out(1)
    pattern = np.zeros(jacobian.shape, dtype=bool)
    pattern[tuple(np.array(jacobian.get_triplet()))] = True
    kept = [
        *range(layout.DYNAMICS.start, layout.DYNAMICS.stop),
        *range(layout.PRODUCTS.start, layout.PRODUCTS.stop),
    ]
    rows = [point * layout.REPORT_ROWS.stop + row for row in kept for point in range(points)]
    columns = [
        point * layout.POINT_WIDTH + place for place in range(layout.POINT_WIDTH) for point in range(points)
    ]
    last = [layout.POINT_WIDTH * points, layout.POINT_WIDTH * points + 1]
    return pattern[np.ix_([*rows, pattern.shape[0] - 1], [*columns, *last])]


def count_dents(gait: Gait) -> int:
    """Return how often the swing knee bends and stretches again by a visible angle."""
    knee = np.degrees(gait.trajectory.q[draw.KNEE_ROWS[1]])
    dents, bending, extreme = 0, False, knee[0]
    for angle in knee:
        extreme = min(extreme, angle) if bending else max(extreme, angle)
        if bending and angle > extreme + _DENT:
            dents, bending, extreme = dents + 1, False, angle
        elif not bending and angle < extreme - _DENT:
            bending, extreme = True, angle
    return dents


def rotation(gaits: Sequence[Gait], rows: list[int]) -> str:
    """Return how far a joint turns, in words; the largest angle need not be that of the fastest gait.

    Args:
        gaits: From slow to fast.
        rows: Of the joint's angle in q, of both legs.
    """
    ranges = [_range(gait, rows) for gait in gaits]
    largest = int(np.argmax(ranges))
    growth = "grows" if bool(np.all(np.diff(ranges) > 0)) else "does not always grow"
    return (
        f"{growth} with speed: {ranges[0]:.0f}° at the slowest, {ranges[-1]:.0f}° at the fastest, at most "
        f"{ranges[largest]:.0f}° ({gaits[largest].request.speed * KMH_PER_MS:.2f} km/h)"
    )


def _page(gaits: ModeGaits, close_up: Mapping[SpringMode, Gait], walker: WalkerParameters, table: str) -> str:
    """Return the page that shows the figures, each beside what agrees and what differs."""
    nominal = gaits[SpringMode.NONE]
    preface = (
        "Made by `walk-optimizer reproduce` from the gaits of the library, all of them certified solutions "
        f"on the report's grid: N = {nominal[0].request.points}, friction {walker.friction_coefficient:g}."
    )
    sections = (
        ("Table I", f"```\n{table}\n```", _about_table(gaits)),
        ("Section 3.3.1, figure 1: sparsity", "![sparsity](figure_1.png)", _about_sparsity(walker)),
        ("Figure 2: angles at seven speeds", "![angles](figure_2.png)", _about_angles(nominal)),
        ("Figure 3: paths of the swing foot", "![foot paths](figure_3.png)", _about_paths(nominal)),
        ("Figure 4: angles at 1.15 km/h", "![angles](figure_4.png)", _about_modes(close_up)),
        ("Figure 5: torques at 1.15 km/h", "![torques](figure_5.png)", _about_torques(close_up)),
    )
    parts = [f"## {title}\n\n{picture}\n\n{text}" for title, picture, text in sections]
    return "\n\n".join(["# The report again", preface, *parts]) + "\n"


def _about_table(gaits: ModeGaits) -> str:
    """Return how our F% compares with the report's."""
    nominal = gaits[SpringMode.NONE]
    shares = [
        (100 * gaits[mode][index].objective / nominal[index].objective, reported.relative_objective)
        for index, row in enumerate(TABLE_I)
        for mode, reported in row.results.items()
    ]
    better = sum(ours <= reported for ours, reported in shares)
    by_stiffness = _lowered(gaits, SpringMode.NONE, SpringMode.STIFFNESS)
    by_equilibrium = _lowered(gaits, SpringMode.STIFFNESS, SpringMode.STIFFNESS_AND_EQUILIBRIUM)
    stiffness = [gait.spring.stiffness for gait in gaits[SpringMode.STIFFNESS_AND_EQUILIBRIUM]]
    return (
        f"Agrees: springs lower F at {by_stiffness} of {len(nominal)} speeds, and a free equilibrium lowers "
        f"it further at {by_equilibrium}. "
        f"Differs: {better} of {len(shares)} of our F% are at or below the report's, with stiffer springs "
        f"(free equilibrium: {min(stiffness):.0f} to {max(stiffness):.0f} N m/rad). "
        "F% relates two optima, so a better gait without springs raises it: F itself, which the report does "
        "not give, would be the fair measure. The report says that about half of its solves ended noisy; "
        "ours meet every constraint within the tolerances of the certificate."
    )


def _lowered(gaits: ModeGaits, mode: SpringMode, freer: SpringMode) -> int:
    """Return at how many speeds a mode with more freedom takes less torque."""
    pairs = zip(gaits[mode], gaits[freer], strict=True)
    return sum(more.objective < less.objective for less, more in pairs)


def _about_sparsity(walker: WalkerParameters) -> str:
    """Return the size and the filling of the Jacobian."""
    most = int(sparsity(walker, _SPARSITY_POINTS)[:-1].sum(axis=1).max())
    return (
        "Agrees: 20 N + 1 rows, 23 N + 2 columns, a diagonal for each pair of a constraint and a variable, "
        "beside it the point before, K and q_eq at the right border, the step length in the last row. "
        f"No other row has more than {most} entries; the report's bound is 23 + 12 + 2 = 37. "
        f"N = {_SPARSITY_POINTS} here, so that single points are visible."
    )


def _about_angles(gaits: Sequence[Gait]) -> str:
    """Return how the rotation of the joints changes with speed."""
    dents = ", ".join(str(count_dents(gait)) for gait in gaits)
    return (
        f"The rotation of the hip {rotation(gaits, draw.HIP_ROWS)}. That of the knee "
        f"{rotation(gaits, draw.KNEE_ROWS)}. In the report both grow. "
        "The report sees two dents of the knee angle in the swing of slow gaits, which melt into one for "
        f"fast ones; ours have, from slow to fast, {dents} (counted where the knee stretches again by more "
        f"than {_DENT}°)."
    )


def _about_paths(gaits: Sequence[Gait]) -> str:
    """Return how the path of the swing foot changes with speed."""
    heights = ", ".join(f"{1000 * float(draw.foot_path(gait)[1].max()):.0f}" for gait in gaits)
    return (
        "Agrees: the shape of the path changes with the speed, so one shape for all speeds can't be optimal. "
        f"The highest points are, from slow to fast, {heights} mm; nothing in the problem asks for "
        "clearance. The axis of the height is enlarged."
    )


def _about_modes(gaits: Mapping[SpringMode, Gait]) -> str:
    """Return how the springs change the angles."""
    listed = ", ".join(f"{mode.value} {_range(gait, draw.KNEE_ROWS):.1f}°" for mode, gait in gaits.items())
    stiffness = gaits[SpringMode.STIFFNESS_AND_EQUILIBRIUM].spring.stiffness
    return (
        f"Agrees: springs change the angles. The knee rotates by: {listed}. Differs: in the report a free "
        "equilibrium brings the angles back to those without springs, with a soft spring; ours has "
        f"{stiffness:.0f} N m/rad and carries the stance leg, whose knee moves on it."
    )


def _about_torques(gaits: Mapping[SpringMode, Gait]) -> str:
    """Return how the springs change the torques."""
    hip = {mode: float(np.abs(gait.trajectory.u[0]).max()) for mode, gait in gaits.items()}
    listed = ", ".join(f"{mode.value} {torque:.2f} N m" for mode, torque in hip.items())
    lower = hip[SpringMode.STIFFNESS_AND_EQUILIBRIUM] < hip[SpringMode.NONE]
    verdict = "Agrees: knee springs also lower" if lower else "Differs: knee springs do not lower"
    return f"{verdict} the largest torque at the hip, which has no spring: {listed}."


def _range(gait: Gait, rows: list[int]) -> float:
    """Return the range of an angle over the cycle in [degrees]."""
    return float(np.degrees(np.ptp(gait.trajectory.q[rows])))
