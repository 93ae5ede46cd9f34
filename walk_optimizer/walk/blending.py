"""Steps that blend one pace into another: smooth, but solved by nobody, and so without a certificate."""

from walk_optimizer.references.profile import StepProfile, StepSample
from walk_optimizer.walk.stand import ArrivalProfile, StandProfile
from walk_optimizer.walk.walk import StepPlan


class JoinedStep:
    """The first step of a new pace, begun at the coordinates and velocities where the former pace is.

    The difference at the start, in position and velocity, fades over the step with the cubic Hermite
    polynomials h00(s) = 1 - 3 s^2 + 2 s^3 and h10(s) = s - 2 s^2 + s^3, s from 0 to 1: neither jumps.
    The torques are those of the new pace.
    """

    def __init__(self, profile: StepProfile, begin: StepSample) -> None:
        """Join.

        Args:
            profile: The new pace, or a part of it that ends.
            begin: Where the step begins, as the new step sees it.
        """
        start = profile.sample(0.0)
        self._profile = profile
        self._q = begin.q - start.q
        self._qdot = begin.qdot - start.qdot

    @property
    def method(self) -> str:
        """Name of the method that the new pace was solved with."""
        return self._profile.method

    @property
    def step_time(self) -> float:
        """Duration of the step in [s]."""
        return self._profile.step_time

    @property
    def step_length(self) -> float:
        """Distance that the step covers along the way, in [m]."""
        return self._profile.step_length

    @property
    def rise(self) -> float:
        """How much higher the step ends in [m]."""
        return self._profile.rise

    def sample(self, time: float) -> StepSample:
        """Return the walker at a time in [s] from the start of the step, 0 <= time <= step_time."""
        target = self._profile.sample(time)
        duration = self.step_time
        s = time / duration
        q = (1 - s) ** 2 * ((1 + 2 * s) * self._q + s * duration * self._qdot)
        qdot = 6 * s * (s - 1) / duration * self._q + (1 - s) * (1 - 3 * s) * self._qdot
        return StepSample(target.q + q, target.qdot + qdot, target.u)


def blended(begins: StepProfile, leads_to: StepProfile) -> StepPlan:
    """Return one step that blends a pace into another.

    Args:
        begins: The pace that is left, at the start of a step of it.
        leads_to: The pace that follows; a stand is reached after the time of a step of the former pace.
    """
    target = leads_to
    if isinstance(leads_to, StandProfile):
        target = ArrivalProfile(leads_to.standing, begins.step_time)
    return StepPlan(begins, (JoinedStep(target, begins.sample(0.0)),), leads_to)
