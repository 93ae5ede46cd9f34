"""The transition: steps from one pace to another, frozen, with their certificate."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Certificate, RefinedGait
from walk_optimizer.gait.refined_peaks import torque_peaks
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.solve.status import SolveReport
from walk_optimizer.transition.paces import Pace
from walk_optimizer.transition.torque_limit import TorqueLimit

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Transition:
    """Steps from a gait or a stand to another.

    A step is laid out as that of a gait: leg 1 stands at the origin, foot 2 ends one step length ahead,
    and then the legs exchange names. So a step is sampled as a gait's: `RefinedProfile.of(step)`. The
    first step begins where a step of the source would begin; after the last one the target goes on.
    Positions are continuous. Velocities are too, but for the impacts, in which a walker's velocities
    jump.

    All steps have one knee spring: the target's, from the border between source and transition on; on
    the way to a stand, which is held with any spring, the source's. Torques u are those beside it.

    Attributes:
        walker: The walker.
        source: What is left.
        target: What is reached.
        steps: The steps, each with a certificate of its own.
        torque_limit: Largest magnitude of each torque that was allowed, in [N m], or that of the hips and
            that of the knees; may be infinite.
        certificate: The largest residuals of all steps, and how far apart source, steps and target are.
    """

    walker: WalkerParameters
    source: Pace
    target: Pace
    steps: tuple[RefinedGait, ...]
    torque_limit: TorqueLimit
    certificate: Certificate

    @property
    def spring(self) -> KneeSpring:
        """K and q_eq of both knees in all steps."""
        return self.steps[0].spring

    @property
    def step_times(self) -> tuple[float, ...]:
        """Duration of each step in [s]."""
        return tuple(step.trajectory.step_time for step in self.steps)

    @property
    def step_lengths(self) -> tuple[float, ...]:
        """Length of each step in [m]."""
        return tuple(step.step_length for step in self.steps)

    @property
    def torque_effort(self) -> float:
        """Integral over all steps of 1/2 |u|^2 dt in [(N m)^2 s]."""
        return sum(step.trajectory.torque_effort for step in self.steps)

    @property
    def peak_torques(self) -> FloatArray:
        """Largest magnitudes of the torques of the hips and of the knees in [N m], (2,)."""
        peaks = np.max([torque_peaks(step.trajectory) for step in self.steps], axis=0)
        return np.array([peaks[0], peaks[1:].max()])


@dataclass(frozen=True)
class TransitionOutcome:
    """What a request for a transition led to.

    Attributes:
        transition: The steps; None unless they were solved and certified.
        report: How the solve went; its objective is the effort in [(N m)^2 s].
    """

    transition: Transition | None
    report: SolveReport
