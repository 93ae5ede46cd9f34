"""Settings of transitions (config/transitions.yaml)."""

import math
from dataclasses import dataclass
from functools import cache

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.resources import config_file, require_positive, settings_from_yaml


@dataclass(frozen=True)
class TransitionSettings:
    """How stands and the steps between paces are.

    Attributes:
        feet_distance: Between the feet of a stand in [m].
        knee_bend: Least bend of both knees of a stand in [rad].
        steps: Of a transition, unless told otherwise.
        most_steps: That may be asked for.
        shortest_step: In [s].
        longest_step: In [s].
    """

    feet_distance: float
    knee_bend: float
    steps: int
    most_steps: int
    shortest_step: float
    longest_step: float

    def __post_init__(self) -> None:
        """Refuse numbers that are impossible by themselves or beside each other.

        Raises:
            ConfigurationError: says which number, and what it may be.
        """
        require_positive(self, "transition setting ")
        for name, low, high in (
            ("knee_bend", 0.0, math.pi / 2),
            ("steps", 1, self.most_steps),
            ("shortest_step", 0.0, self.longest_step),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ConfigurationError(
                    f"transition setting {name} is {value}, allowed is {low} to {high:g}"
                )


@cache
def transition_settings() -> TransitionSettings:
    """Return the packaged settings, read once."""
    return settings_from_yaml(TransitionSettings, config_file("transitions.yaml"))
