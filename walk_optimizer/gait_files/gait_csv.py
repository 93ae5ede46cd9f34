"""A gait as CSV: header lines `# key: value`, a line of column names, one row a grid point or node."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from walk_optimizer.errors import GaitNotFoundError
from walk_optimizer.gait import FloatArray, Gait
from walk_optimizer.gait_files.access import write_text
from walk_optimizer.transcription.tableau import NODES

COLUMNS = (
    "time",
    *(f"q{i}" for i in range(1, 7)),
    *(f"p{i}" for i in range(1, 7)),
    *(f"u{i}" for i in range(1, 4)),
    *("lambda1_xp", "lambda1_xm", "lambda1_y", "lambda2_xp", "lambda2_xm", "lambda2_y"),
    *("gamma1", "gamma2"),
)


REFINED_COLUMNS = (
    *COLUMNS[:16],
    *("lambda1_x", "lambda1_y", "lambda2_x", "lambda2_y"),
)


def gait_csv(gait: Gait) -> str:
    """Return a gait on the report's grid as CSV in SI units; every number reads back exactly as it was."""
    trajectory = gait.trajectory
    return _csv(_header(gait), COLUMNS, np.vstack([trajectory.time, trajectory.stacked()]).T)


def refined_csv(gait: Gait) -> str:
    """Return the refined part of a gait as CSV in SI units, one row a node.

    Raises:
        GaitNotFoundError: the gait has none.
    """
    if gait.refined is None:
        raise GaitNotFoundError("this gait has no refined part; export it with --grid report")
    refined, trajectory = gait.refined, gait.refined.trajectory
    header = _header(gait) | {
        "speed": refined.step_length / trajectory.step_time,
        "step_length": refined.step_length,
        "K": refined.spring.stiffness,
        "q_eq": refined.spring.equilibrium,
        "grid": "radau",
    }
    time = trajectory.breaks[:-1, None] + trajectory.lengths[:, None] * NODES
    parts = [time[:, :, None], trajectory.states[:, 1:], trajectory.torques, trajectory.forces]
    rows = np.concatenate(parts, axis=2).reshape(-1, len(REFINED_COLUMNS))
    return _csv(header, REFINED_COLUMNS, rows)


def write_csv(gait: Gait, path: Path) -> None:
    """Write a gait on the report's grid as CSV.

    Raises:
        GaitFileError: the file can't be written.
    """
    write_text(path, gait_csv(gait))


def _csv(header: dict[str, float | int | str], columns: Sequence[str], rows: FloatArray) -> str:
    """Return header lines, column names and rows as one text."""
    keys = [f"# {key}: {value}" for key, value in header.items()]
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    return "\n".join([*keys, ",".join(columns), *lines]) + "\n"


def _header(gait: Gait) -> dict[str, float | int | str]:
    """Return what describes the gait as a whole: m/s, m, s, N m/rad, rad and (N m)^2."""
    return {
        "speed": gait.speed,
        "step_length": gait.step_length,
        "step_time": gait.request.step_time,
        "N": gait.request.points,
        "spring mode": gait.request.spring_mode.value,
        "K": gait.spring.stiffness,
        "q_eq": gait.spring.equilibrium,
        "friction": gait.walker.friction_coefficient,
        "F": gait.objective,
    }
