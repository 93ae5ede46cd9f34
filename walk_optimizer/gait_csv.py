"""A gait as CSV: header lines `# key: value`, a line of column names, one row a grid point."""

from pathlib import Path

import numpy as np

from walk_optimizer.gait import Gait
from walk_optimizer.gait_files.access import write_text

COLUMNS = (
    "time",
    *(f"q{i}" for i in range(1, 7)),
    *(f"p{i}" for i in range(1, 7)),
    *(f"u{i}" for i in range(1, 4)),
    *("lambda1_xp", "lambda1_xm", "lambda1_y", "lambda2_xp", "lambda2_xm", "lambda2_y"),
    *("gamma1", "gamma2"),
)


def gait_csv(gait: Gait) -> str:
    """Return a gait as CSV in SI units; every number reads back exactly as it was."""
    header = "".join(f"# {key}: {value}\n" for key, value in _header(gait).items())
    trajectory = gait.trajectory
    rows = np.vstack(
        [
            trajectory.time,
            trajectory.q,
            trajectory.p,
            trajectory.u,
            trajectory.reaction,
            trajectory.slip_speed,
        ]
    ).T
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    return header + "\n".join([",".join(COLUMNS), *lines]) + "\n"


def write_csv(gait: Gait, path: Path) -> None:
    """Write a gait as CSV.

    Raises:
        GaitFileError: the file can't be written.
    """
    write_text(path, gait_csv(gait))


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
