"""Gaits that look like gaits but were never solved: for what only stores, shows or passes them on."""

from dataclasses import replace

import numpy as np

from walk_optimizer.gait import Certificate, CertificateEntry, Gait, Trajectory
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import FamilyViolation, SolveReport, Status


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


def _trajectory(request: GaitRequest, walker: WalkerParameters, torque: float) -> Trajectory:
    """Return a stiff stance leg that turns over its foot, and a swing leg that bends its knee."""
    points, length = request.points, walker.leg_length
    phase = np.arange(1, points + 1) / points
    reach = np.arcsin(request.step_length / 2 / length)
    stance = reach * (1 - 2 * phase)
    bend = 0.6 * np.sin(np.pi * phase) ** 2
    swing = reach * (2 * phase - 1) + bend / 2
    straight = np.full(points, np.pi)
    q = np.array(
        [
            -length * np.sin(stance),
            length * np.cos(stance),
            stance,
            straight,
            swing,
            np.pi - bend,
        ]
    )
    wave = np.sin(2 * np.pi * phase)
    weight = np.full(points, walker.weight)
    zero = np.zeros(points)
    return Trajectory(
        time=request.interval * np.arange(1, points + 1),
        q=q,
        p=np.vstack([np.full(points, 75.0 * request.speed), *[0.1 * wave] * 5]),
        u=torque * np.array([2 * wave, 0.5 * wave, -wave]),
        reaction=np.array([np.maximum(wave, 0) * 20, np.maximum(-wave, 0) * 20, weight, zero, zero, zero]),
        slip_speed=np.array([zero, np.abs(np.sin(np.pi * phase))]),
    )
