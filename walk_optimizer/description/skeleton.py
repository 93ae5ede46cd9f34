"""Links and joints of the walker: what its URDF and its transforms are both made from."""

import math
from dataclasses import dataclass

from walk_optimizer.description.settings import DescriptionSettings
from walk_optimizer.model.parameters import WalkerParameters

BASE = "base_link"
PELVIS = "pelvis"
SIDES = ("left", "right")
FEET = tuple(f"{side}_foot" for side in SIDES)


@dataclass(frozen=True)
class Link:
    """A rigid body; its frame is where it hangs from, and it hangs along -z.

    Attributes:
        name: Of the link and of its frame.
        mass: In [kg]; 0 for a mere frame.
        mass_depth: How far below the frame the point mass is, in [m].
        length: Of the segment in [m]; 0 for a point.
    """

    name: str
    mass: float = 0.0
    mass_depth: float = 0.0
    length: float = 0.0


@dataclass(frozen=True)
class Joint:
    """Where a link hangs; a revolute joint turns forward, about -y.

    Attributes:
        name: Of the joint.
        parent: Link that it hangs from.
        child: Link that hangs.
        origin: In the frame of the parent in [m].
        zero: Angle about -y of the child in the frame of the parent at position 0, in [rad].
        limits: Smallest and largest position in [rad]; None for a fixed joint.
    """

    name: str
    parent: str
    child: str
    origin: tuple[float, float, float]
    zero: float = 0.0
    limits: tuple[float, float] | None = None


@dataclass(frozen=True)
class Skeleton:
    """The walker as links and joints, parents first.

    Attributes:
        links: All bodies; the first is the base, which has no mass.
        joints: All joints; the revolute ones are those of `references.JOINTS`, in that order.
    """

    links: tuple[Link, ...]
    joints: tuple[Joint, ...]


def skeleton_of(walker: WalkerParameters, settings: DescriptionSettings) -> Skeleton:
    """Return the links and joints of a walker.

    The base carries no mass, because KDL, and so robot_state_publisher, ignores that of a root link:
    the hip mass is that of a link fixed to it.
    """
    links = [Link(BASE), Link(PELVIS, walker.hip_mass)]
    joints = [Joint("base_to_pelvis", BASE, PELVIS, (0.0, 0.0, 0.0))]
    for side, sign in zip(SIDES, (1, -1), strict=True):
        links += _leg_links(walker, side)
        joints += _leg_joints(walker, side, sign * settings.leg_spacing / 2)
    return Skeleton(tuple(links), tuple(joints))


def _leg_links(walker: WalkerParameters, side: str) -> list[Link]:
    upper, lower = walker.upper_leg_length, walker.lower_leg_length
    return [
        Link(f"{side}_upper_leg", walker.upper_leg_mass, upper / 2, upper),
        Link(f"{side}_lower_leg", walker.lower_leg_mass, lower / 2, lower),
        Link(f"{side}_foot"),
    ]


def _leg_joints(walker: WalkerParameters, side: str, y: float) -> list[Joint]:
    """Return the joints of a leg; its hip is at y in [m].

    The lower leg is at q_hip + q_knee - pi from the vertical, so the knee's position 0 lies at -pi.
    """
    hip_limit = walker.hip_angle_limit
    below_knee, below_ankle = (0.0, 0.0, -walker.upper_leg_length), (0.0, 0.0, -walker.lower_leg_length)
    upper, lower, foot = (f"{side}_{part}" for part in ("upper_leg", "lower_leg", "foot"))
    return [
        Joint(f"{side}_hip", PELVIS, upper, (0.0, y, 0.0), 0.0, (-hip_limit, hip_limit)),
        Joint(f"{side}_knee", upper, lower, below_knee, -math.pi, (0.0, math.pi)),
        Joint(f"{side}_ankle", lower, foot, below_ankle),
    ]
