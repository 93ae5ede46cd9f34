"""Values of the core to messages, and back."""

import math
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.msg import Certificate as CertificateMessage
from walk_optimizer_interfaces.msg import Gait as GaitMessage
from walk_optimizer_interfaces.msg import GaitSummary as GaitSummaryMessage
from walk_optimizer_interfaces.msg import RefinedStep
from walk_optimizer_interfaces.msg import SolverReport as SolverReportMessage

from walk_optimizer.errors import GaitFileError, WalkOptimizerError
from walk_optimizer.gait import Certificate, CertificateEntry, Gait, RefinedGait, Trajectory
from walk_optimizer.gait_files.checks import positive
from walk_optimizer.gait_files.refined import REFINED_PREFIX, ROW_SHAPES, refined_trajectory
from walk_optimizer.library.entries import GaitSummary
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.references.profile import EulerProfile
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import FamilyViolation, Progress, SolveReport, Status

# Status of a report where no solve was started.
REFUSED = "refused"

# Field of the message, attribute of the trajectory, rows.
_ARRAYS = (
    ("q", "q", 6),
    ("p", "p", 6),
    ("u", "u", 3),
    ("ground_reaction", "reaction", 6),
    ("slip_speed", "slip_speed", 2),
)


def doubles(values: NDArray[np.float64]) -> "array[float]":
    """Return values row by row as the array type that messages take without checking each element."""
    return array("d", np.ascontiguousarray(values, dtype=np.float64).tobytes())


def gait_to_message(gait: Gait) -> GaitMessage:
    """Return a gait as a message."""
    message = GaitMessage(
        walker=gait.walker.fingerprint(),
        speed=gait.speed,
        step_length=gait.step_length,
        step_time=gait.request.step_time,
        spring_mode=gait.request.spring_mode.value,
        stiffness=gait.spring.stiffness,
        equilibrium=gait.spring.equilibrium,
        friction_coefficient=gait.walker.friction_coefficient,
        method=EulerProfile.method,
        points=gait.trajectory.points,
        objective=gait.objective,
        torque_effort=gait.torque_effort,
        time=doubles(gait.trajectory.time),
        certificate=certificate_to_message(gait.certificate),
        refined=[] if gait.refined is None else [refined_to_message(gait.refined)],
    )
    for field, attribute, _ in _ARRAYS:
        setattr(message, field, doubles(getattr(gait.trajectory, attribute)))
    return message


def refined_to_message(refined: RefinedGait) -> RefinedStep:
    """Return the refined part of a gait as a message."""
    message = RefinedStep(
        intervals=refined.trajectory.intervals,
        step_length=refined.step_length,
        stiffness=refined.spring.stiffness,
        equilibrium=refined.spring.equilibrium,
        torque_effort=refined.trajectory.torque_effort,
        certificate=certificate_to_message(refined.certificate),
    )
    for name in ("breaks", *ROW_SHAPES):
        setattr(message, name, doubles(getattr(refined.trajectory, name)))
    return message


def trajectory_from_message(message: GaitMessage) -> Trajectory:
    """Return the trajectory of a gait message.

    Raises:
        GaitFileError: an array is not of the size that `points` says, or not finite.
    """
    points = message.points
    if points == 0:
        raise GaitFileError("gait message: points is 0, expected at least 1")
    arrays = {"time": _array("time", message.time, (points,))}
    for field, attribute, rows in _ARRAYS:
        arrays[attribute] = _array(field, getattr(message, field), (rows, points))
    if not all(np.isfinite(values).all() for values in arrays.values()):
        raise GaitFileError("gait message: a number of the trajectory is not finite")
    return Trajectory(**arrays)


def refined_from_message(message: GaitMessage) -> RefinedGait | None:
    """Return the refined part of a gait message; None where there is none.

    Raises:
        GaitFileError: an array is not of the size that `intervals` says, or not finite, or the
            intervals don't fill the step.
    """
    if not message.refined:
        return None
    (step,) = message.refined
    shapes = {"breaks": (step.intervals + 1,)} | {
        name: (step.intervals, *rest) for name, rest in ROW_SHAPES.items()
    }
    arrays = {
        f"{REFINED_PREFIX}{name}": _array(f"refined {name}", getattr(step, name), shape)
        for name, shape in shapes.items()
    }
    return RefinedGait(
        trajectory=refined_trajectory(arrays, message.step_time),
        spring=_spring(step),
        step_length=positive(step.step_length, "gait message: step_length of the refined part"),
        certificate=certificate_from_message(step.certificate),
    )


def _spring(message: GaitMessage | RefinedStep) -> KneeSpring:
    """Return the knee spring of a message; raise GaitFileError unless its numbers are finite."""
    if not (math.isfinite(message.stiffness) and math.isfinite(message.equilibrium)):
        raise GaitFileError(
            f"gait message: K is {message.stiffness} N m/rad and q_eq {message.equilibrium} rad, "
            "expected finite numbers"
        )
    return KneeSpring(message.stiffness, message.equilibrium)


def _array(name: str, numbers: Sequence[float], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the numbers of a message as an array; raise GaitFileError unless they are so many."""
    if len(numbers) != math.prod(shape):
        expected = " x ".join(map(str, shape))
        raise GaitFileError(f"gait message: {name} has {len(numbers)} numbers, expected {expected}")
    return np.array(numbers, dtype=np.float64).reshape(shape)


def gait_from_message(
    message: GaitMessage, report: SolverReportMessage, walker: WalkerParameters, request: GaitRequest
) -> Gait:
    """Return the gait of a message, solved for a walker and a request that the receiver knows.

    Raises:
        GaitFileError: it was solved for another walker, or what it holds is not the whole of a gait.
    """
    if message.walker != walker.fingerprint():
        raise GaitFileError(
            f"the gait is for a walker with the fingerprint {message.walker or 'none'}, expected "
            f"{walker.fingerprint()}; give all nodes the same walker_file"
        )
    return Gait(
        walker=walker,
        request=request,
        spring=_spring(message),
        trajectory=trajectory_from_message(message),
        report=report_from_message(report),
        certificate=certificate_from_message(message.certificate),
        step_length=positive(message.step_length, "gait message: step_length"),
        refined=refined_from_message(message),
    )


def request_of_message(message: GaitMessage) -> GaitRequest:
    """Return the request that a gait message answers, as far as it tells.

    Raises:
        GaitFileError: the step has no length or no duration.
        InvalidRequestError: the spring mode is unknown.
    """
    length, time = (
        positive(getattr(message, one), f"gait message: {one}") for one in ("step_length", "step_time")
    )
    return GaitRequest(length, time, SpringMode.parse(message.spring_mode), message.points)


def certificate_to_message(certificate: Certificate) -> CertificateMessage:
    """Return a certificate as a message."""
    return CertificateMessage(
        **_columns(certificate.entries, ("family", "violation", "tolerance", "unit")),
        certified=certificate.certified,
    )


def certificate_from_message(message: CertificateMessage) -> Certificate:
    """Return the certificate of a message; it is judged anew, not believed.

    Raises:
        GaitFileError: its columns are not equally long.
    """
    columns = (message.family, message.violation, message.unit, message.tolerance)
    rows = _rows(columns, "gait message: the columns of a certificate")
    return Certificate(tuple(CertificateEntry(*row) for row in rows))


def report_to_message(report: SolveReport) -> SolverReportMessage:
    """Return a solver report as a message."""
    columns = _columns(report.violations, ("family", "violation", "unit"))
    return _message(SolverReportMessage, report, status=report.status.value, **columns)


def refusal_to_message(error: WalkOptimizerError) -> SolverReportMessage:
    """Return the report on a request that was refused before a solve started."""
    return SolverReportMessage(status=REFUSED, message=str(error), objective=math.nan)


def report_from_message(message: SolverReportMessage) -> SolveReport:
    """Return the solver report of a message.

    Raises:
        GaitFileError: its status is unknown, or its columns are not equally long.
    """
    columns = (message.family, message.violation, message.unit)
    rows = _rows(columns, "solver report: the columns of its violations")
    known = [status.value for status in Status]
    if message.status not in known:
        raise GaitFileError(f"solver report: no status {message.status!r}; there are {', '.join(known)}")
    values: dict[str, Any] = {
        "status": Status(message.status),
        "violations": tuple(FamilyViolation(*row) for row in rows),
    }
    same = {one.name for one in fields(SolveReport)} - values.keys()
    return SolveReport(**values, **{name: getattr(message, name) for name in same})


def progress_to_message(progress: Progress, time_limit: float) -> OptimizeGaitAction.Feedback:
    """Return progress of a solve that may last `time_limit` in [s] as action feedback."""
    time_left = max(time_limit - progress.elapsed, 0.0)
    return _message(OptimizeGaitAction.Feedback, progress, time_left=time_left)


def summary_to_message(summary: GaitSummary) -> GaitSummaryMessage:
    """Return a row of the gait table as a message."""
    return _message(GaitSummaryMessage, summary, spring_mode=summary.spring_mode.value)


def _message(kind: type, value: object, **given: Any) -> Any:
    """Return a message with the fields given, all others being attributes of a value by the same name."""
    names = kind.get_fields_and_field_types().keys() - given.keys()  # type: ignore[attr-defined]
    return kind(**given, **{name: getattr(value, name) for name in names})


def _columns(entries: Sequence[FamilyViolation], names: Sequence[str]) -> dict[str, list[Any]]:
    """Return attributes of entries as the parallel arrays of a message."""
    return {name: [getattr(entry, name) for entry in entries] for name in names}


def _rows(columns: Sequence[Sequence[Any]], what: str) -> Iterable[tuple[Any, ...]]:
    """Return the rows of a message's parallel arrays.

    Raises:
        GaitFileError: they are not equally long; says so of `what`.
    """
    if len(set(map(len, columns))) > 1:
        raise GaitFileError(f"{what} are not equally long")
    return zip(*columns, strict=True)
