"""What a planar walker can follow of a `geometry_msgs/Twist`: its speed along x."""

import math

from geometry_msgs.msg import Twist

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.nodes.log_text import value_text

FORWARD = "linear.x"
# Between two warnings of what is ignored, in [s].
_WARNING_PERIOD = 1.0


def forward_speed(message: Twist) -> float:
    """Return the speed that a twist asks for in [m/s].

    Raises:
        InvalidRequestError: a part is not finite; then the others are not to be believed either.
    """
    parts = _parts(message)
    wrong = _listed({name: value for name, value in parts.items() if not math.isfinite(value)})
    if wrong:
        raise InvalidRequestError(f"a velocity has {wrong}, allowed are finite numbers in all its parts")
    return parts[FORWARD]


class IgnoredParts:
    """Notices which parts of a stream of twists can't be followed: the walker neither turns nor sidesteps."""

    def __init__(self) -> None:
        """Begin with nothing ignored."""
        self._told: set[str] = set()
        self._last_warning = -math.inf

    def warning(self, message: Twist, now: float) -> str | None:
        """Return what to say of a twist that came at a time in [s]: when other parts are ignored than before.

        A stream that changes quickly is warned of once in a while.
        """
        ignored = {name: value for name, value in _parts(message).items() if value != 0 and name != FORWARD}
        if not ignored:
            self._told = set()
        if self._told == ignored.keys() or now - self._last_warning < _WARNING_PERIOD:
            return None
        self._told, self._last_warning = set(ignored), now
        return f"{_listed(ignored)} ignored: the walker is planar, it can only follow {FORWARD}"


def _parts(message: Twist) -> dict[str, float]:
    """Return the six velocities of a twist by name, in [m/s] and [rad/s]."""
    vectors = {"linear": message.linear, "angular": message.angular}
    return {f"{name}.{axis}": getattr(vector, axis) for name, vector in vectors.items() for axis in "xyz"}


def _listed(parts: dict[str, float]) -> str:
    return ", ".join(f"{name}={value_text(value)}" for name, value in parts.items())
