"""Settings of the simulated walk (config/simulation.yaml)."""

from dataclasses import dataclass
from functools import cache

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.resources import config_file, require_positive, settings_from_yaml


@dataclass(frozen=True)
class KneeStop:
    """What keeps a knee from bending backward: a stiff contact with damping [Hunt1975].

    Attributes:
        stiffness: k in [N m/rad].
        damping: c in [s/rad]: the torque at depth d is k d (1 + c dd).
    """

    stiffness: float
    damping: float


@dataclass(frozen=True)
class RegulatorWeights:
    """What the regulator weighs: deviations of these sizes count alike.

    Attributes:
        angle: In [rad].
        speed: In [rad/s].
        torque: In [N m].
    """

    angle: float
    speed: float
    torque: float


@dataclass(frozen=True)
class SimulationSettings:
    """The simulated walker beside the optimised one, and when its walk ends.

    Attributes:
        steps: Of a walk, unless told otherwise.
        torque_limit: Of each motor in [N m].
        lowest_hip: A hip below this part of the leg length has fallen.
        latest_touch_down: A step that lasts longer than this many times its gait's has failed.
        landing_zone: A foot lands where it is ahead by more than this part of the step length. Before, it
            may only brush the ground.
        deepest_brush: A swing foot deeper in the ground before its landing zone has stumbled, in [m].
        push_duration: In [s].
        push_phase: Where in a step a push begins, as a part of the step time.
        disturbed_step: The step that is disturbed, counted from 1.
        knee_stop: What keeps knees from bending backward.
        weights: Of the regulator.
    """

    steps: int
    torque_limit: float
    lowest_hip: float
    latest_touch_down: float
    landing_zone: float
    deepest_brush: float
    push_duration: float
    push_phase: float
    disturbed_step: int
    knee_stop: KneeStop
    weights: RegulatorWeights

    def __post_init__(self) -> None:
        """Refuse impossible numbers.

        Raises:
            ConfigurationError: names the first of them.
        """
        for part in (self, self.knee_stop, self.weights):
            require_positive(part, "simulation setting ")
        for name in ("lowest_hip", "landing_zone", "push_phase"):
            if getattr(self, name) >= 1:
                raise ConfigurationError(
                    f"simulation setting {name} is {getattr(self, name)}, allowed is above 0 and below 1"
                )


@cache
def simulation_settings() -> SimulationSettings:
    """Return the packaged settings, read once.

    Raises:
        ConfigurationError: an entry is missing, unknown or impossible.
    """
    return settings_from_yaml(SimulationSettings, config_file("simulation.yaml"))
