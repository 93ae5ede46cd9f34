"""What a description of the walker needs beside its parameters."""

from dataclasses import dataclass

from walk_optimizer.resources import config_file, require_positive, settings_from_yaml


@dataclass(frozen=True)
class DescriptionSettings:
    """Numbers of `config/description.yaml`; none of them matters to a gait.

    Attributes:
        leg_spacing: Left and right hip apart in [m].
        drawn_density: A point mass is drawn as a ball of this density in [kg/m^3].
        segment_radius: A leg segment is drawn as a rod of this radius in [m].
        foot_radius: A point foot is drawn as a ball of this radius in [m].
        inertia_radius: The inertia of a point mass is that of a solid ball of this radius in [m].
        effort_limit: Of every joint in [N m].
        velocity_limit: Of every joint in [rad/s].
    """

    leg_spacing: float
    drawn_density: float
    segment_radius: float
    foot_radius: float
    inertia_radius: float
    effort_limit: float
    velocity_limit: float

    def __post_init__(self) -> None:
        """Refuse what can't be drawn or simulated."""
        require_positive(self, "description: ")


def description_settings() -> DescriptionSettings:
    """Return the packaged settings."""
    return settings_from_yaml(DescriptionSettings, config_file("description.yaml"))
