"""Positions of the walker's masses and feet as CasADi expressions (report section II)."""

import casadi as ca

from walk_optimizer.model.symbolic import SymbolicWalker

# Row of q that holds each coordinate.
HIP_X, HIP_Y, UPPER_1, KNEE_1, UPPER_2, KNEE_2 = range(6)
LEGS = ((UPPER_1, KNEE_1), (UPPER_2, KNEE_2))
RELABELLED = (HIP_X, HIP_Y, UPPER_2, KNEE_2, UPPER_1, KNEE_1)


def _along(angle: ca.SX) -> ca.SX:
    """Return the unit vector at an angle from the downward vertical, forward positive."""
    return ca.vertcat(ca.sin(angle), -ca.cos(angle))


def _leg_angles(q: ca.SX, leg: int) -> tuple[ca.SX, ca.SX]:
    """Return the angles of upper and lower leg from the downward vertical in [rad]."""
    upper, knee = LEGS[leg]
    return q[upper], q[upper] + q[knee] - ca.pi


def foot_position(walker: SymbolicWalker, q: ca.SX, leg: int) -> ca.SX:
    """Return g_j(q), the foot of leg j = `leg` + 1 as (x, y) in [m]."""
    upper, lower = _leg_angles(q, leg)
    hip = q[[HIP_X, HIP_Y]]
    return hip + walker.upper_leg_length * _along(upper) + walker.lower_leg_length * _along(lower)


def mass_positions(walker: SymbolicWalker, q: ca.SX) -> list[tuple[ca.SX, ca.SX]]:
    """Return S(q): each point mass in [kg] with its position (x, y) in [m]."""
    hip = q[[HIP_X, HIP_Y]]
    masses = [(walker.hip_mass, hip)]
    for leg in range(2):
        upper, lower = _leg_angles(q, leg)
        knee = hip + walker.upper_leg_length * _along(upper)
        masses.append((walker.upper_leg_mass, hip + walker.upper_leg_length / 2 * _along(upper)))
        masses.append((walker.lower_leg_mass, knee + walker.lower_leg_length / 2 * _along(lower)))
    return masses
