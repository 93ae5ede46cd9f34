"""Parameters of the walker and of its knee springs, validated once, here."""

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from typing import Any

from walk_optimizer.errors import ConfigurationError, InvalidRequestError, quoted
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.resources import as_float, config_file, read_yaml, settings_from_entries, text_hint


class SpringMode(StrEnum):
    """What the optimiser may choose about the knee springs (report section IV)."""

    NONE = "none"
    STIFFNESS = "stiffness"
    STIFFNESS_AND_EQUILIBRIUM = "stiffness_and_equilibrium"

    @classmethod
    def parse(cls, name: str) -> "SpringMode":
        """Return the mode of that name.

        Raises:
            InvalidRequestError: no such mode; the message lists them.
        """
        try:
            return cls(name)
        except ValueError:
            allowed = ", ".join(mode.value for mode in cls)
            raise InvalidRequestError(f"unknown spring mode {quoted(name)}; allowed are {allowed}") from None


@dataclass(frozen=True)
class KneeSpring:
    """Torsion spring, the same on both knees.

    Attributes:
        stiffness: K in [N m/rad].
        equilibrium: q_eq in [rad]; pi is a stretched knee.
    """

    stiffness: float = 0.0
    equilibrium: float = math.pi


# What the equations of motion and contact depend on; the rest are bounds of the optimisation.
DYNAMIC_PARAMETERS = (
    "hip_mass",
    "upper_leg_mass",
    "lower_leg_mass",
    "upper_leg_length",
    "lower_leg_length",
    "gravity",
    "friction_coefficient",
)
# What contact depends on besides: the terrain, and the length of its treads, which is that of the step.
GROUND_PARAMETERS = ("slope", "step_up", "tread")
# Margins that a gait keeps where they are above 0.
MARGINS = ("landing_speed", "stance_load")


@dataclass(frozen=True)
class WalkerParameters:
    """The walker of report section II: five point masses, two segments a leg, point feet.

    Attributes:
        hip_mass: Mass at the hip in [kg].
        upper_leg_mass: Mass at the middle of each upper leg in [kg].
        lower_leg_mass: Mass at the middle of each lower leg in [kg].
        upper_leg_length: Hip to knee in [m].
        lower_leg_length: Knee to foot in [m].
        gravity: Gravitational acceleration in [m/s^2].
        friction_coefficient: Coulomb friction mu of foot and ground [-].
        hip_angle_limit: Upper legs stay within plus and minus this angle in [rad].
        stiffness_limit: Largest knee stiffness K in [N m/rad].
        landing_speed: Least speed towards the ground in [m/s] of the foot that lands as a step ends; 0 sets
            no bound. The last step to a stand, which sets its foot down softly, is not bound by it.
        stance_load: Least load on a foot that stands alone, as a part of the weight [-]; 0 sets no bound.
        terrain: The ground that it walks on.
    """

    hip_mass: float = 45.0
    upper_leg_mass: float = 11.25
    lower_leg_mass: float = 3.75
    upper_leg_length: float = 0.5
    lower_leg_length: float = 0.5
    gravity: float = 9.81
    friction_coefficient: float = 0.8
    hip_angle_limit: float = math.pi / 2
    stiffness_limit: float = 2000.0
    landing_speed: float = 0.0
    stance_load: float = 0.0
    terrain: Terrain = field(default_factory=Terrain)

    def __post_init__(self) -> None:
        """Refuse values that no walker can have."""
        for entry in fields(self):
            if entry.name != "terrain":
                value = _finite(entry.name, getattr(self, entry.name), zero=entry.name in MARGINS)
                object.__setattr__(self, entry.name, value)
        if not isinstance(self.terrain, Terrain):
            raise ConfigurationError(
                f"walker parameter terrain is {quoted(self.terrain)}, expected a Terrain"
            )
        if abs(self.terrain.step_up) >= self.leg_length:
            raise ConfigurationError(
                f"terrain step_up is {self.terrain.step_up} m, allowed is less than the leg's "
                f"{self.leg_length} m, up or down"
            )
        if self.stance_load >= 1:
            raise ConfigurationError(
                f"walker parameter stance_load is {self.stance_load}, allowed is 0 to below 1: "
                "on average the feet carry the weight"
            )
        if self.hip_angle_limit > math.pi:
            raise ConfigurationError(
                f"walker parameter hip_angle_limit is {self.hip_angle_limit} rad, allowed is up to pi"
            )

    @classmethod
    def from_yaml(cls, path: Path | str | None = None) -> "WalkerParameters":
        """Read the parameters from a YAML file, by default the packaged `config/walker.yaml`.

        Raises:
            ConfigurationError: the file can't be read, or an entry is unknown or impossible.
        """
        source = config_file("walker.yaml") if path is None else Path(path)
        entries = read_yaml(source)
        known = {entry.name for entry in fields(cls)}
        unknown = sorted(set(entries) - known)
        if unknown:
            raise ConfigurationError(
                f"{source}: unknown walker parameter {', '.join(unknown)}; "
                f"known are {', '.join(sorted(known))}"
            )
        return settings_from_entries(cls._from_entries, entries, source)

    @classmethod
    def _from_entries(cls, **entries: Any) -> "WalkerParameters":
        """Return the walker of the entries of a file."""
        if "terrain" in entries:
            entries["terrain"] = Terrain.from_entries(entries["terrain"])
        return cls(**entries)

    @property
    def leg_length(self) -> float:
        """Length of a stretched leg in [m]."""
        return self.upper_leg_length + self.lower_leg_length

    @property
    def longest_step(self) -> float:
        """Largest distance of two feet on the ground in [m]: legs stretched, hips at their limit."""
        return 2 * self.leg_length * math.sin(min(self.hip_angle_limit, math.pi / 2))

    @property
    def total_mass(self) -> float:
        """Mass of the whole walker in [kg]."""
        return self.hip_mass + 2 * (self.upper_leg_mass + self.lower_leg_mass)

    @property
    def weight(self) -> float:
        """Weight of the whole walker in [N]."""
        return self.total_mass * self.gravity

    def vector(self, tread: float | None = None) -> list[float]:
        """Return the values that dynamics and contact depend on, in the order of `SymbolicWalker.symbols`.

        Args:
            tread: Length of a step in [m], and so of a tread; without stairs it plays no part.

        Raises:
            ConfigurationError: there are stairs, and no length of their treads was given.
        """
        if tread is None and self.terrain.step_up:
            raise ConfigurationError("stairs need the length of a step: call vector() with it")
        dynamic = [getattr(self, name) for name in DYNAMIC_PARAMETERS]
        return [*dynamic, self.terrain.slope, self.terrain.step_up, tread or 1.0]

    def fingerprint(self) -> str:
        """Return a short hash of all parameters: equal walkers have equal fingerprints.

        What came to the parameters later is left out where it changes nothing: gaits keep their names.
        """
        entries = asdict(self)
        if self.terrain.is_flat:
            del entries["terrain"]
        for name in MARGINS:
            if not entries[name]:
                del entries[name]
        text = json.dumps(entries, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def _finite(name: str, value: Any, *, zero: bool) -> float:
    """Return the value as a float.

    Args:
        name: Of the parameter.
        value: What was given.
        zero: Whether it may be 0.

    Raises:
        ConfigurationError: it is no finite number above 0, or neither that nor 0.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigurationError(f"walker parameter {name} is {value!r}, expected a number{text_hint(value)}")
    number = as_float(value)
    if not (math.isfinite(number) and (number > 0 or (zero and number == 0))):
        allowed = "0 and finite numbers above" if zero else "finite numbers above 0"
        raise ConfigurationError(f"walker parameter {name} is {number}, allowed are {allowed}")
    # Adding 0.0 makes a zero of a negative zero.
    return number + 0.0
