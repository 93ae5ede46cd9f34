"""From a gait and the time to positions, velocities and torques of the joints. Knows no ROS."""

from walk_optimizer.references.joint_references import (
    EXCHANGED_JOINTS,
    JOINTS,
    Cycle,
    Reference,
    cycle_reference,
    make_reference,
    require_rate,
    sample_cycle,
)

__all__ = [
    "EXCHANGED_JOINTS",
    "JOINTS",
    "Cycle",
    "Reference",
    "cycle_reference",
    "make_reference",
    "require_rate",
    "sample_cycle",
]
