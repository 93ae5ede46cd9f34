"""What a walk needs of the joints from now on, when nobody asks for another gait: its pace, and its stop."""

from dataclasses import dataclass

from walk_optimizer.references.profile import StepProfile
from walk_optimizer.walk.joint_limits import JointLimits, JointNeed
from walk_optimizer.walk.walk import Walk


@dataclass(frozen=True)
class PaceNeeds:
    """What a pace needs of the joints.

    Attributes:
        staying: Once it is reached: to keep it, and to stop.
        leading: The steps that lead to it; None where it is begun with.
    """

    staying: tuple[JointNeed, ...]
    leading: JointNeed | None = None


class WalkNeeds:
    """Needs of the paces that a walk has or has been given as its goal."""

    def __init__(self, pace: StepProfile, needs: PaceNeeds) -> None:
        """Begin with the pace that a walk begins with."""
        self._of: dict[StepProfile, PaceNeeds] = {pace: needs}

    def add(self, walk: Walk, goal: StepProfile, needs: PaceNeeds) -> None:
        """Take note of a goal that the walk has just been given; former paces are forgotten."""
        kept = {pace: self._of[pace] for pace in (walk.pace, walk.goal) if pace is not goal}
        self._of = kept | {goal: needs}

    def require(self, limits: JointLimits, walk: Walk) -> None:
        """Refuse limits that the walk does not meet.

        Raises:
            JointLimitError: says what for, names the joint and both numbers.
        """
        for pace in dict.fromkeys((walk.pace, walk.goal)):
            needs = self._of[pace]
            is_led_to = walk.is_changing or pace is not walk.pace
            leading = (needs.leading,) if is_led_to and needs.leading is not None else ()
            for need in (*leading, *needs.staying):
                limits.require(need)
