"""Gaits that look like gaits but were never solved: for what only stores, shows or passes them on."""

from dataclasses import replace

import numpy as np

from walk_optimizer.gait import Certificate, CertificateEntry, FloatArray, Gait, RefinedGait, Trajectory
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import FamilyViolation, SolveReport, Status
from walk_optimizer.transcription.tableau import NODES_WITH_START


def made_up_gait(
    speed: float = 0.25 / 0.785,
    mode: str = "none",
    points: int = 20,
    torque: float = 1.0,
    walker: WalkerParameters | None = None,
    certified: bool = True,
) -> Gait:
    """Return a gait of plausible shape; its dynamics are made up, its certificate says what is asked."""
    walker = walker or WalkerParameters()
    request = GaitRequest.for_speed(speed, mode, points)
    stiffness = 0.0 if mode == "none" else 12.5
    equilibrium = 3.11 if mode == "stiffness_and_equilibrium" else np.pi
    return Gait(
        walker=walker,
        request=request,
        spring=KneeSpring(stiffness, equilibrium),
        trajectory=_trajectory(request, walker, torque),
        report=SolveReport(
            status=Status.SOLVED,
            message="converged to an optimum",
            back_end="ipopt",
            start="kinematic",
            starts=3,
            iterations=41,
            solve_time=1.25,
            objective=float("nan"),
            violations=(FamilyViolation("dynamics", 1e-9, "N"),),
        ),
        certificate=Certificate(
            (
                CertificateEntry("dynamics", 1e-9 if certified else 2.5, "N", 7e-4),
                CertificateEntry("penetration", 0.0, "m", 1e-6),
            )
        ),
        step_length=request.step_length,
    )


def with_report_status(gait: Gait, status: Status) -> Gait:
    """Return the gait with another status in its report."""
    return replace(gait, report=replace(gait.report, status=status, message=status.sentence))


def all_modes() -> list[str]:
    """Return the names of the spring modes."""
    return [mode.value for mode in SpringMode]


def with_refinement(gait: Gait, certified: bool = True, intervals: int = 5) -> Gait:
    """Return the gait with a refined part: the same motion and twice the torques, on uneven intervals."""
    breaks = gait.request.step_time * np.linspace(0, 1, intervals + 1) ** 1.5
    places = breaks[:-1, None] + np.diff(breaks)[:, None] * NODES_WITH_START
    phase = places.ravel() / gait.request.step_time
    q, p = _motion(gait.request, gait.walker, phase)
    impulses = np.zeros((intervals, 4))
    impulses[0] = [-3.0, 9.0, 0.0, 0.0]
    trajectory = RefinedTrajectory(
        breaks=breaks,
        states=np.vstack([q, p]).T.reshape(intervals, 4, 12),
        torques=2 * _torques(phase).T.reshape(intervals, 4, 3)[:, 1:],
        forces=np.tile([5.0, gait.walker.weight, 0.0, 0.0], (intervals, 3, 1)),
        impulses=impulses,
    )
    certificate = Certificate((CertificateEntry("collocation", 1e-9 if certified else 0.5, "N", 1e-6),))
    spring = KneeSpring(gait.spring.stiffness, gait.spring.equilibrium)
    return replace(gait, refined=RefinedGait(trajectory, spring, gait.step_length, certificate))


def _trajectory(request: GaitRequest, walker: WalkerParameters, torque: float) -> Trajectory:
    """Return the made-up motion on the grid of a request."""
    phase = np.arange(1, request.points + 1) / request.points
    q, p = _motion(request, walker, phase)
    wave = np.sin(2 * np.pi * phase)
    weight, zero = np.full(request.points, walker.weight), np.zeros(request.points)
    return Trajectory(
        time=request.interval * np.arange(1, request.points + 1),
        q=q,
        p=p,
        u=torque * _torques(phase),
        reaction=np.array([np.maximum(wave, 0) * 20, np.maximum(-wave, 0) * 20, weight, zero, zero, zero]),
        slip_speed=np.array([zero, np.abs(np.sin(np.pi * phase))]),
    )


def _torques(phase: FloatArray) -> FloatArray:
    """Return torques at phases of the step, (3, N)."""
    wave = np.sin(2 * np.pi * phase)
    return np.array([2 * wave, 0.5 * wave, -wave])


def _motion(
    request: GaitRequest, walker: WalkerParameters, phase: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return q and p of a stiff stance leg that turns over its foot, and of a swing leg that bends.

    On slopes and stairs all that is turned, so that foot 2 lands on the ground.
    """
    length = walker.leg_length
    rise = float(walker.terrain.height(request.step_length, request.step_length))
    reach = np.arcsin(np.hypot(request.step_length, rise) / 2 / length)
    tilt = np.arctan2(rise, request.step_length)
    stance = reach * (1 - 2 * phase)
    bend = 0.6 * np.sin(np.pi * phase) ** 2
    swing = reach * (2 * phase - 1) + bend / 2
    straight = np.full(phase.size, np.pi)
    hip = [-length * np.sin(tilt + stance), length * np.cos(tilt + stance)]
    q = np.array([*hip, tilt + stance, straight, tilt + swing, np.pi - bend])
    wave = np.sin(2 * np.pi * phase)
    return q, np.vstack([np.full(phase.size, 75.0 * request.speed), *[0.1 * wave] * 5])
