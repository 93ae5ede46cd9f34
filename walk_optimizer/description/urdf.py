"""The walker as URDF, the XML that ROS tools, simulators and rigid-body libraries read."""

import math
from xml.etree import ElementTree as ET

from walk_optimizer.description.settings import DescriptionSettings
from walk_optimizer.description.skeleton import PELVIS, Joint, Link, Skeleton, skeleton_of
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters

ROBOT = "walker"
# Red, green, blue and opacity of the materials, 0 to 1.
_MATERIALS = {
    "body": (0.35, 0.38, 0.42, 1.0),
    "left": (0.12, 0.31, 0.55, 1.0),
    "right": (0.85, 0.45, 0.17, 1.0),
}
_FORWARD = "0 -1 0"


def walker_urdf(
    walker: WalkerParameters, settings: DescriptionSettings, spring: KneeSpring | None = None
) -> str:
    """Return the URDF of a walker.

    URDF knows no springs: the knee springs are told in the way that Gazebo reads (`springStiffness`,
    `springReference`), which other programs skip.

    Args:
        walker: The walker.
        settings: What is drawn, and limits.
        spring: Knee springs; none are written when they are missing or K = 0.
    """
    robot = ET.Element("robot", name=ROBOT)
    for name, colour in _MATERIALS.items():
        ET.SubElement(ET.SubElement(robot, "material", name=name), "color", rgba=_numbers(*colour))
    skeleton = skeleton_of(walker, settings)
    for link in skeleton.links:
        _add_link(robot, link, settings)
    for joint in skeleton.joints:
        _add_joint(robot, joint, settings)
    if spring is not None and spring.stiffness > 0:
        _add_springs(robot, skeleton, spring)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode", xml_declaration=True) + "\n"


def _add_link(robot: ET.Element, link: Link, settings: DescriptionSettings) -> None:
    element = ET.SubElement(robot, "link", name=link.name)
    material = "body" if link.name == PELVIS else link.name.split("_")[0]
    if link.mass > 0:
        _add_inertial(element, link, settings.inertia_radius)
        # A ball of density rho: m = 4/3 pi r^3 rho.
        radius = math.cbrt(3 * link.mass / (4 * math.pi * settings.drawn_density))
        _add_visual(element, -link.mass_depth, "sphere", material, radius=radius)
    if link.length > 0:
        rod = {"radius": settings.segment_radius, "length": link.length}
        _add_visual(element, -link.length / 2, "cylinder", material, **rod)
    if link.name.endswith("_foot"):
        _add_visual(element, 0.0, "sphere", material, radius=settings.foot_radius)


def _add_inertial(element: ET.Element, link: Link, radius: float) -> None:
    """Add the point mass; its own inertia is that of a small solid ball, 2/5 m r^2."""
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(0.0, 0.0, -link.mass_depth))
    ET.SubElement(inertial, "mass", value=_numbers(link.mass))
    moment = _numbers(2 / 5 * link.mass * radius**2)
    ET.SubElement(inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy="0", ixz="0", iyz="0")


def _add_visual(element: ET.Element, z: float, shape: str, material: str, **sizes: float) -> None:
    visual = ET.SubElement(element, "visual")
    ET.SubElement(visual, "origin", xyz=_numbers(0.0, 0.0, z))
    geometry = ET.SubElement(visual, "geometry")
    ET.SubElement(geometry, shape, {name: _numbers(size) for name, size in sizes.items()})
    ET.SubElement(visual, "material", name=material)


def _add_joint(robot: ET.Element, joint: Joint, settings: DescriptionSettings) -> None:
    kind = "fixed" if joint.limits is None else "revolute"
    element = ET.SubElement(robot, "joint", name=joint.name, type=kind)
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    # rpy turns about +y, a walker's joint about -y.
    ET.SubElement(element, "origin", xyz=_numbers(*joint.origin), rpy=_numbers(0.0, -joint.zero, 0.0))
    if joint.limits is None:
        return
    ET.SubElement(element, "axis", xyz=_FORWARD)
    limits = {"lower": joint.limits[0], "upper": joint.limits[1]}
    limits |= {"effort": settings.effort_limit, "velocity": settings.velocity_limit}
    ET.SubElement(element, "limit", {name: _numbers(value) for name, value in limits.items()})


def _add_springs(robot: ET.Element, skeleton: Skeleton, spring: KneeSpring) -> None:
    for joint in skeleton.joints:
        if joint.name.endswith("_knee"):
            gazebo = ET.SubElement(robot, "gazebo", reference=joint.name)
            ET.SubElement(gazebo, "springStiffness").text = _numbers(spring.stiffness)
            ET.SubElement(gazebo, "springReference").text = _numbers(spring.equilibrium)


def _numbers(*values: float) -> str:
    """Return numbers as URDF writes them; no digit is lost, and there is no negative zero."""
    return " ".join(repr(float(value) + 0.0) for value in values)
