"""Values of the core to messages, and back."""

import math
from array import array

import numpy as np
from builtin_interfaces.msg import Duration
from numpy.typing import NDArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.msg import Certificate as CertificateMessage
from walk_optimizer_interfaces.msg import Gait as GaitMessage
from walk_optimizer_interfaces.msg import GaitSummary as GaitSummaryMessage
from walk_optimizer_interfaces.msg import SolverReport as SolverReportMessage

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Certificate, CertificateEntry, Gait, Trajectory
from walk_optimizer.library_entries import GaitSummary
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.references import JOINTS, Cycle
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import FamilyViolation, Progress, SolveReport, Status

METHOD = "implicit_euler"

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
        speed=gait.speed,
        step_length=gait.step_length,
        step_time=gait.request.step_time,
        spring_mode=gait.request.spring_mode.value,
        stiffness=gait.spring.stiffness,
        equilibrium=gait.spring.equilibrium,
        friction_coefficient=gait.walker.friction_coefficient,
        method=METHOD,
        points=gait.trajectory.points,
        objective=gait.objective,
        torque_effort=gait.torque_effort,
        time=doubles(gait.trajectory.time),
        certificate=certificate_to_message(gait.certificate),
    )
    for field, attribute, _ in _ARRAYS:
        setattr(message, field, doubles(getattr(gait.trajectory, attribute)))
    return message


def trajectory_from_message(message: GaitMessage) -> Trajectory:
    """Return the trajectory of a gait message.

    Raises:
        GaitFileError: an array is not of the size that `points` says, or not finite.
    """
    points = message.points
    arrays = {"time": np.array(message.time)}
    for field, attribute, rows in _ARRAYS:
        arrays[attribute] = np.array(getattr(message, field))
        if arrays[attribute].size != rows * points:
            raise GaitFileError(
                f"gait message: {field} has {arrays[attribute].size} numbers, expected {rows} x {points}"
            )
        arrays[attribute] = arrays[attribute].reshape(rows, points)
    if points == 0 or arrays["time"].size != points:
        raise GaitFileError(f"gait message: time has {arrays['time'].size} numbers, expected {points} > 0")
    if not all(np.isfinite(values).all() for values in arrays.values()):
        raise GaitFileError("gait message: a number is not finite")
    return Trajectory(**arrays)


def gait_from_message(
    message: GaitMessage, report: SolverReportMessage, walker: WalkerParameters, request: GaitRequest
) -> Gait:
    """Return the gait of a message, solved for a walker and a request that the receiver knows."""
    return Gait(
        walker=walker,
        request=request,
        spring=KneeSpring(message.stiffness, message.equilibrium),
        trajectory=trajectory_from_message(message),
        report=report_from_message(report),
        certificate=certificate_from_message(message.certificate),
        step_length=message.step_length,
    )


def request_of_message(message: GaitMessage) -> GaitRequest:
    """Return the request that a gait message answers, as far as it tells."""
    mode = SpringMode.parse(message.spring_mode)
    return GaitRequest(message.step_length, message.step_time, mode, message.points)


def certificate_to_message(certificate: Certificate) -> CertificateMessage:
    """Return a certificate as a message."""
    return CertificateMessage(
        family=[entry.family for entry in certificate.entries],
        violation=[entry.violation for entry in certificate.entries],
        tolerance=[entry.tolerance for entry in certificate.entries],
        unit=[entry.unit for entry in certificate.entries],
        certified=certificate.certified,
    )


def certificate_from_message(message: CertificateMessage) -> Certificate:
    """Return the certificate of a message; it is judged anew, not believed."""
    rows = zip(message.family, message.violation, message.unit, message.tolerance, strict=True)
    return Certificate(tuple(CertificateEntry(*row) for row in rows))


def report_to_message(report: SolveReport) -> SolverReportMessage:
    """Return a solver report as a message."""
    return SolverReportMessage(
        status=report.status.value,
        message=report.message,
        back_end=report.back_end,
        start=report.start,
        starts=report.starts,
        iterations=report.iterations,
        solve_time=report.solve_time,
        objective=report.objective,
        family=[entry.family for entry in report.violations],
        violation=[entry.violation for entry in report.violations],
        unit=[entry.unit for entry in report.violations],
    )


def report_from_message(message: SolverReportMessage) -> SolveReport:
    """Return the solver report of a message."""
    rows = zip(message.family, message.violation, message.unit, strict=True)
    return SolveReport(
        status=Status(message.status),
        message=message.message,
        back_end=message.back_end,
        start=message.start,
        starts=message.starts,
        iterations=message.iterations,
        solve_time=message.solve_time,
        objective=message.objective,
        violations=tuple(FamilyViolation(*row) for row in rows),
    )


def progress_to_message(progress: Progress) -> OptimizeGaitAction.Feedback:
    """Return progress of a solve as action feedback."""
    return OptimizeGaitAction.Feedback(
        stage=progress.stage,
        iteration=progress.iteration,
        objective=float(progress.objective),
        infeasibility=float(progress.infeasibility),
        elapsed=float(progress.elapsed),
    )


def summary_to_message(summary: GaitSummary) -> GaitSummaryMessage:
    """Return a row of the gait table as a message."""
    return GaitSummaryMessage(
        speed=summary.speed,
        step_length=summary.step_length,
        step_time=summary.step_time,
        spring_mode=summary.spring_mode.value,
        stiffness=summary.stiffness,
        equilibrium=summary.equilibrium,
        objective=summary.objective,
        relative_objective=summary.relative_objective,
        points=summary.points,
        certified=summary.certified,
    )


def cycle_to_message(cycle: Cycle) -> JointTrajectory:
    """Return a cycle as joint_trajectory_controller takes it.

    The stamp stays 0, which means "begin when it arrives"; with a real one, a replay is refused as
    past. The last velocity is 0, because a trajectory that does not end at rest is refused unless the
    controller is told otherwise.
    """
    velocity = cycle.velocity.copy()
    velocity[:, -1] = 0.0
    return JointTrajectory(
        joint_names=list(JOINTS),
        points=[
            JointTrajectoryPoint(
                positions=doubles(cycle.position[:, index]),
                velocities=doubles(velocity[:, index]),
                effort=doubles(cycle.effort[:, index]),
                time_from_start=_duration(time),
            )
            for index, time in enumerate(cycle.time.tolist())
        ],
    )


def _duration(seconds: float) -> Duration:
    whole = math.floor(seconds)
    return Duration(sec=whole, nanosec=min(round((seconds - whole) * 1e9), 999_999_999))
