"""How far a gait that is blended from two others may be from one that was solved."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.resources import config_file, require_positive, settings_from_yaml


@dataclass(frozen=True)
class InterpolationBounds:
    """How far a blended gait may be from a solved one (config/interpolation.yaml).

    Attributes:
        position: Of feet and joints in [m] and [rad].
        stance_speed: Of a foot under load in [m/s]; times the walker's mass, of impacts in [N s], and times
            its weight, of power that friction could not take up in [W].
        joint_speed: Of velocities in [m/s] and [rad/s].
        replay: Within an interval, in [m] and [rad].
        force: In units of body weight [-] (times 1 m).
    """

    position: float
    stance_speed: float
    joint_speed: float
    replay: float
    force: float

    def __post_init__(self) -> None:
        """Refuse bounds that are not above 0.

        Raises:
            ConfigurationError: names the bound.
        """
        require_positive(self)

    @classmethod
    def from_yaml(cls, path: Path | None = None) -> "InterpolationBounds":
        """Read the bounds, by default the packaged ones.

        Raises:
            ConfigurationError: an entry is missing, unknown or impossible.
        """
        return settings_from_yaml(cls, path or config_file("interpolation.yaml"))

    def by_family(self, walker: WalkerParameters) -> dict[str, float]:
        """Return the tolerances of the families of a refined certificate that a blend may stretch."""
        places = ("continuity", "landing", "tread", "stance_height", "penetration", "penetration_between")
        limits = ("joint_limits", "joint_limits_between")
        return dict.fromkeys(places + limits, self.position) | {
            "stance_velocity": self.stance_speed,
            "slip_friction": self.stance_speed * walker.weight,
            "impact": self.stance_speed * walker.total_mass,
            "kinematics": self.joint_speed,
            "interval_replay": self.replay,
            "dynamics": self.force * walker.weight,
            "friction_cone": self.force * walker.weight,
        }


@cache
def interpolation_bounds() -> InterpolationBounds:
    """Return the packaged bounds, read once."""
    return InterpolationBounds.from_yaml()
