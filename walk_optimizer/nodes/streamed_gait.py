"""Gaits and stands as the stream needs them."""

from dataclasses import dataclass
from typing import TypeAlias

from walk_optimizer_interfaces.msg import Gait as GaitMessage
from walk_optimizer_interfaces.msg import SolverReport

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.nodes.conversions import gait_from_message, request_of_message
from walk_optimizer.references.profile import RefinedProfile, StepProfile, profile_of
from walk_optimizer.solve.status import Status
from walk_optimizer.transition.paces import Pace
from walk_optimizer.walk.joint_limits import JointPeaks
from walk_optimizer.walk.stand import StandProfile
from walk_optimizer.walk.walk import StepPlan


@dataclass(frozen=True, eq=False)
class ReceivedGait:
    """A gait that came as a message.

    Attributes:
        message: As it is announced.
        profile: As it is walked.
        gait: As it was solved.
    """

    message: GaitMessage
    profile: StepProfile
    gait: Gait

    @classmethod
    def from_message(cls, message: GaitMessage, walker: WalkerParameters) -> "ReceivedGait":
        """Return the gait of a message; its refined part is walked if that is certified.

        Args:
            message: The gait.
            walker: That it was solved for.

        Raises:
            GaitFileError: it is for another walker, or what it holds is not the whole of a gait.
            InvalidRequestError: its spring mode is unknown.
            SolveFailedError: it is not certified.
        """
        report = SolverReport(status=Status.SOLVED.value)
        gait = gait_from_message(message, report, walker, request_of_message(message))
        if not gait.certificate.certified:
            failures = "; ".join(map(str, gait.certificate.failures())) or "its certificate has no entries"
            raise SolveFailedError(f"only certified gaits are streamed; this one is not: {failures}")
        return cls(message, profile_of(gait), gait)

    @property
    def spring(self) -> KneeSpring:
        """Knee spring of what is walked."""
        refined = self.gait.refined
        if refined is None or not isinstance(self.profile, RefinedProfile):
            return self.gait.spring
        return refined.spring

    @property
    def speed(self) -> float:
        """Speed that is walked in [m/s]."""
        return self.profile.step_length / self.profile.step_time

    def __str__(self) -> str:
        """Return the speed that is walked, and by the solution of which method."""
        return f"{self.speed:.4f} m/s ({self.profile.method})"


# What a walk is to lead to.
Goal: TypeAlias = ReceivedGait | StandProfile


@dataclass(frozen=True, eq=False)
class Way:
    """Steps from one pace to another.

    Attributes:
        plan: The steps.
        leads_to: The pace that follows them.
        peaks: The most that the steps need of the joints.
    """

    plan: StepPlan
    leads_to: Goal
    peaks: JointPeaks


@dataclass(frozen=True, eq=False)
class StreamedGait(ReceivedGait):
    """A gait that may be walked, for it is known how it is stopped.

    Attributes:
        stop: The way to a stand: planned before the gait is begun and kept with it, a stop waits for nothing.
    """

    stop: Way

    @classmethod
    def of(cls, gait: ReceivedGait, stop: Way) -> "StreamedGait":
        """Return a gait with its stop."""
        return cls(gait.message, gait.profile, gait.gait, stop)


def profile_of_goal(goal: Goal) -> StepProfile:
    """Return how a goal is walked."""
    return goal if isinstance(goal, StandProfile) else goal.profile


def pace_of_goal(goal: Goal) -> Pace:
    """Return what transitions lead from and to."""
    return goal.standing if isinstance(goal, StandProfile) else goal.gait
