"""The ground as CasADi expressions; `Terrain` says what it looks like."""

import casadi as ca

from walk_optimizer.model.symbolic import SymbolicWalker


def ground_height(walker: SymbolicWalker, x: ca.SX) -> ca.SX:
    """Return the height of the ground in [m] at a place x in [m]; the stance foot stands at the origin."""
    part = x / walker.tread
    stairs = walker.step_up * (part - ca.sin(2 * ca.pi * part) / (2 * ca.pi))
    return ca.tan(walker.slope) * x + stairs


def gap(walker: SymbolicWalker, position: ca.SX) -> ca.SX:
    """Return the distance of a point (2,) from the ground in [m], across the slope."""
    return ca.cos(walker.slope) * (position[1] - ground_height(walker, position[0]))


def along_and_normal(walker: SymbolicWalker, vector: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the components of a vector (2,) along the surface, uphill positive, and normal to it."""
    cosine, sine = ca.cos(walker.slope), ca.sin(walker.slope)
    return cosine * vector[0] + sine * vector[1], cosine * vector[1] - sine * vector[0]


def horizontal_and_vertical(walker: SymbolicWalker, along: ca.SX, normal: ca.SX) -> ca.SX:
    """Return the vector (2,) of components along the surface and normal to it."""
    cosine, sine = ca.cos(walker.slope), ca.sin(walker.slope)
    return ca.vertcat(cosine * along - sine * normal, sine * along + cosine * normal)
