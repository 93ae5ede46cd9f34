"""Recomputes the certificates of stored gaits, whatever the files say about themselves."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from walk_optimizer.certificate.grid import certify, landing_distance
from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Certificate, CertificateEntry, Gait
from walk_optimizer.gait_files import SUFFIX, read_gait_file
from walk_optimizer.gait_files.access import files_in
from walk_optimizer.model.parameters import WalkerParameters

# What a file states twice may differ by this much, in [m] and [s].
_STATED_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Verification:
    """What was found about one file.

    Attributes:
        path: The file.
        gait: Its gait; None when it can't be read.
        certificate: Residuals computed now; None without a gait.
        problem: Why the file fails; empty when it does not.
    """

    path: Path
    gait: Gait | None
    certificate: Certificate | None
    problem: str

    @property
    def passed(self) -> bool:
        """Whether the file holds a certified gait."""
        return not self.problem


def verify_file(path: Path, walker: WalkerParameters) -> Verification:
    """Read a gait file and compute its certificate anew."""
    try:
        gait = read_gait_file(path, walker)
    except GaitFileError as error:
        return Verification(path, None, None, str(error))
    certificate = certify(gait.walker, gait.request, gait.spring, gait.trajectory)
    failed = ", ".join(
        f"{entry.family} is {entry.amount}, allowed {entry.tolerance:.3g}"
        for entry in (*certificate.entries, *_stated_entries(gait), *_refined_entries(gait))
        if not entry.met
    )
    return Verification(path, gait, certificate, f"{path}: {failed}" if failed else "")


def _stated_entries(gait: Gait) -> tuple[CertificateEntry, ...]:
    """Return how far the step length and times that a file states are from its trajectory and request."""
    landing = landing_distance(gait.walker, gait.trajectory)
    ends = gait.request.interval * np.arange(1, gait.trajectory.points + 1)
    lateness = float(np.abs(gait.trajectory.time - ends).max())
    return (
        CertificateEntry("step_length", abs(gait.step_length - landing), "m", _STATED_TOLERANCE),
        CertificateEntry("time", lateness, "s", _STATED_TOLERANCE),
    )


def _refined_entries(gait: Gait) -> tuple[CertificateEntry, ...]:
    """Return the residuals of the refined part, computed now; none without one."""
    if gait.refined is None:
        return ()
    entries = certify_refined(gait.walker, gait.request, gait.refined).entries
    return tuple(replace(entry, family=f"refined {entry.family}") for entry in entries)


def verify_folder(folder: Path, walker: WalkerParameters) -> list[Verification]:
    """Verify every gait file of a folder, in the order of their names.

    Raises:
        GaitFileError: the folder is missing, can't be read, or holds no gait file: nothing verified is no
            success.
    """
    paths = files_in(folder, SUFFIX)
    if not paths:
        raise GaitFileError(f"{folder}: no gait files")
    return [verify_file(path, walker) for path in paths]
