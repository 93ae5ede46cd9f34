"""The gait: one step of a periodic walk, frozen, with what it was solved for and its certificate."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import FamilyViolation, SolveReport

FloatArray = NDArray[np.float64]


def read_only(values: FloatArray) -> FloatArray:
    """Return a contiguous copy that can't be written to."""
    copy = np.array(values, dtype=np.float64)
    copy.setflags(write=False)
    return copy


@dataclass(frozen=True)
class CertificateEntry(FamilyViolation):
    """Residual of one constraint family with the largest that is allowed, in the same unit."""

    tolerance: float

    def __str__(self) -> str:
        """Return the entry as part of a sentence."""
        return f"{self.family} is off by {self.amount}, allowed is {self.tolerance:.3g}"

    @property
    def met(self) -> bool:
        """Whether the violation is within its tolerance; one that is not a number is not."""
        return self.violation <= self.tolerance

    @property
    def relative(self) -> float:
        """Violation in units of its tolerance; infinite if it is not a number."""
        return self.violation / self.tolerance if self.violation < math.inf else math.inf


@dataclass(frozen=True)
class Certificate:
    """Residuals of a gait, computed apart from the solver.

    Attributes:
        entries: One entry per constraint family.
    """

    entries: tuple[CertificateEntry, ...]

    @property
    def certified(self) -> bool:
        """Whether every family is within its tolerance."""
        return bool(self.entries) and all(entry.met for entry in self.entries)

    @property
    def worst(self) -> CertificateEntry:
        """The family closest to, or farthest beyond, its tolerance."""
        return max(self.entries, key=lambda entry: entry.relative)

    def failures(self) -> tuple[CertificateEntry, ...]:
        """Return the families out of tolerance."""
        return tuple(entry for entry in self.entries if not entry.met)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States, torques and contact on the N grid points of a step; arrays are read-only.

    Attributes:
        time: End of each interval from the start of the step in [s], (N,).
        q: Coordinates in [m] and [rad], (6, N).
        p: Conjugate momenta in [kg m/s] and [kg m^2/s], (6, N).
        u: Hip torque and knee torques of leg 1 and leg 2 in [N m], (3, N).
        reaction: lambda of foot 1 (x+, x-, y), then of foot 2, in [N], (6, N).
        slip_speed: gamma of both feet in [m/s], (2, N).
    """

    time: FloatArray
    q: FloatArray
    p: FloatArray
    u: FloatArray
    reaction: FloatArray
    slip_speed: FloatArray

    def __post_init__(self) -> None:
        """Make every array read-only."""
        for name in ("time", "q", "p", "u", "reaction", "slip_speed"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @classmethod
    def from_stacked(cls, points: FloatArray, step_time: float) -> "Trajectory":
        """Return the trajectory of all quantities stacked, (23, N), of a step of `step_time` in [s]."""
        time = step_time * np.arange(1, points.shape[1] + 1) / points.shape[1]
        return cls(time, points[0:6], points[6:12], points[12:15], points[15:21], points[21:23])

    def stacked(self) -> FloatArray:
        """Return q, p, u, lambda and gamma as one array, (23, N)."""
        return np.vstack([self.q, self.p, self.u, self.reaction, self.slip_speed])

    def net_reaction(self) -> FloatArray:
        """Return the ground reactions along and normal to the ground, foot 1, then 2, in [N], (4, N)."""
        forward, backward, normal = self.reaction[[0, 3]], self.reaction[[1, 4]], self.reaction[[2, 5]]
        tangential = forward - backward
        return np.stack([tangential, normal], axis=1).reshape(4, -1)

    @property
    def points(self) -> int:
        """Number N of grid points."""
        return self.time.size

    @property
    def torque_cost(self) -> float:
        """F, the sum over the points of 1/2 |u|^2, in [(N m)^2] (report section III-A)."""
        return float(np.sum(self.u**2) / 2)


@dataclass(frozen=True, eq=False)
class RefinedGait:
    """The accurate solution with the contact phases of a gait: what a controller is fed.

    Attributes:
        trajectory: One step on collocation intervals.
        spring: K and q_eq of both knees.
        step_length: Length of the step in [m].
        certificate: Its residuals, computed apart from the solver.
    """

    trajectory: RefinedTrajectory
    spring: KneeSpring
    step_length: float
    certificate: Certificate


@dataclass(frozen=True, eq=False)
class Gait:
    """A solved gait on the report's grid, with its refinement where there is one.

    Attributes:
        walker: The walker that it was solved for.
        request: What was asked for.
        spring: K and q_eq of both knees.
        trajectory: States, torques and contact of one step.
        report: How it was solved.
        certificate: Its residuals, computed apart from the solver.
        step_length: Length of the step in [m]; at least the requested one.
        refined: The accurate solution; None where the refinement did not converge.
    """

    walker: WalkerParameters
    request: GaitRequest
    spring: KneeSpring
    trajectory: Trajectory
    report: SolveReport
    certificate: Certificate
    step_length: float
    refined: RefinedGait | None = None

    @property
    def speed(self) -> float:
        """Speed that the gait walks at in [m/s]."""
        return self.step_length / self.request.step_time

    @property
    def objective(self) -> float:
        """F in [(N m)^2]."""
        return self.trajectory.torque_cost

    @property
    def torque_effort(self) -> float:
        """Integral over the step of 1/2 |u|^2 dt in [(N m)^2 s]."""
        return self.objective * self.request.interval
