"""The bytes of a gait file: a gait to bytes, and back after every check (docs/gait_format.md)."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import GaitFileError, InvalidRequestError
from walk_optimizer.gait import Certificate, Gait, Trajectory
from walk_optimizer.gait_files.checks import check_shape, positive
from walk_optimizer.gait_files.container import FileFormat, packed, unpacked
from walk_optimizer.gait_files.header import from_plain, to_plain
from walk_optimizer.gait_files.refined import REFINED_PREFIX, refined_arrays, refined_from, refined_header
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import SolveReport

GAIT_FORMAT = FileFormat(
    "walk_optimizer.gait",
    1,
    "gait file",
    frozenset({"walker", "request", "spring", "report", "certificate", "step_length", "refined"}),
)
_ROWS = {"q": 6, "p": 6, "u": 3, "reaction": 6, "slip_speed": 2}


def encode(gait: Gait) -> bytes:
    """Return the bytes of a gait file; equal gaits give equal bytes."""
    arrays = {name: getattr(gait.trajectory, name) for name in _trajectory_names()}
    entries = {
        "walker": to_plain(gait.walker),
        "request": to_plain(gait.request),
        "spring": to_plain(gait.spring),
        "report": to_plain(gait.report),
        "certificate": to_plain(gait.certificate),
        "step_length": gait.step_length,
        "refined": refined_header(gait.refined),
    }
    return packed(GAIT_FORMAT, entries, arrays | refined_arrays(gait.refined))


def decode(data: bytes) -> Gait:
    """Return the gait that the bytes of a gait file hold.

    Raises:
        GaitFileError: the bytes are no whole gait file of this version.
    """
    return _gait(*unpacked(GAIT_FORMAT, data))


def _trajectory_names() -> tuple[str, ...]:
    """Return the names of the arrays of the report's grid."""
    return tuple(entry.name for entry in fields(Trajectory))


def _gait(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Gait:
    """Return the gait of a header and its arrays."""
    request = _request(header)
    return Gait(
        walker=from_plain(WalkerParameters, header["walker"], "walker"),
        request=request,
        spring=from_plain(KneeSpring, header["spring"], "spring"),
        trajectory=_trajectory(arrays, request.points),
        report=from_plain(SolveReport, header["report"], "report"),
        certificate=from_plain(Certificate, header["certificate"], "certificate"),
        step_length=positive(header["step_length"], "step_length"),
        refined=refined_from(header["refined"], arrays, request.step_time),
    )


def _request(header: Mapping[str, Any]) -> GaitRequest:
    """Return the request, validated as any user's."""
    request = from_plain(GaitRequest, header["request"], "request")
    try:
        return GaitRequest.for_step(
            request.step_length, request.step_time, request.spring_mode, request.points
        )
    except InvalidRequestError as error:
        raise GaitFileError(f"request: {error}") from error


def _trajectory(arrays: Mapping[str, NDArray[Any]], points: int) -> Trajectory:
    """Return the trajectory after a check of names, shapes and times."""
    names = _trajectory_names()
    plain = {name for name in arrays if not name.startswith(REFINED_PREFIX)}
    wrong = sorted(plain ^ set(names))
    if wrong:
        raise GaitFileError(f"missing or unknown arrays: {', '.join(wrong)}")
    for name in names:
        check_shape(name, arrays[name], (points,) if name == "time" else (_ROWS[name], points))
    if np.any(np.diff(arrays["time"], prepend=0.0) <= 0):
        raise GaitFileError("array time does not increase from above 0")
    return Trajectory(**{name: arrays[name] for name in names})
