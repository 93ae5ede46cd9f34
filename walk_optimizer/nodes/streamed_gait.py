"""A gait as the stream needs it."""

from dataclasses import dataclass

from walk_optimizer_interfaces.msg import Gait as GaitMessage

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.model.parameters import KneeSpring
from walk_optimizer.nodes.conversions import refined_from_message, trajectory_from_message
from walk_optimizer.profile import EulerProfile, StepProfile, most_accurate


@dataclass(frozen=True, eq=False)
class StreamedGait:
    """A gait that came as a message.

    Attributes:
        message: As it is announced.
        profile: As it is walked.
        spring: Of both knees, for what is walked.
    """

    message: GaitMessage
    profile: StepProfile
    spring: KneeSpring

    @classmethod
    def from_message(cls, message: GaitMessage) -> "StreamedGait":
        """Return the gait of a message; its refined part is walked if that is certified.

        Raises:
            GaitFileError: its arrays don't fit.
            SolveFailedError: it is not certified.
        """
        if not message.certificate.certified:
            raise SolveFailedError("only certified gaits are streamed; this one is not")
        euler = EulerProfile(trajectory_from_message(message), message.step_length, message.step_time)
        refined = refined_from_message(message)
        profile = most_accurate(euler, refined)
        if refined is None or profile is euler:
            return cls(message, profile, KneeSpring(message.stiffness, message.equilibrium))
        return cls(message, profile, refined.spring)

    @property
    def speed(self) -> float:
        """Speed that is walked in [m/s]."""
        return self.profile.step_length / self.profile.step_time

    def __str__(self) -> str:
        """Return the speed that is walked, and by the solution of which method."""
        return f"{self.speed:.4f} m/s ({self.profile.method})"
