"""The gait: one step of a periodic walk, frozen, on the report's grid and refined; not how it was found."""

from walk_optimizer.gait.gait import (
    Certificate,
    CertificateEntry,
    FloatArray,
    Gait,
    RefinedGait,
    Trajectory,
    read_only,
)

__all__ = [
    "Certificate",
    "CertificateEntry",
    "FloatArray",
    "Gait",
    "RefinedGait",
    "Trajectory",
    "read_only",
]
