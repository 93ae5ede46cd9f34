"""The walker's mechanics in plain NumPy, for what checks the optimiser.

They are written here once more on purpose, from the sums over point masses instead of from generated
code: a check must not share the mistakes of what it checks.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import KneeSpring, WalkerParameters

FloatArray = NDArray[np.float64]


# Length, angle (N,) and slope (6,) of a straight piece.
Piece = tuple[float, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Arm:
    """A chain of straight pieces from the hip to a point: its position and derivatives.

    A piece of length l in the direction of angle a, a linear in q with slope s (6,), ends at
    l (sin a, -cos a): first derivative l (cos a, sin a) s, second l (-sin a, cos a) s s'.

    Attributes:
        hip: Where it begins, (2, N).
        pieces: The chain.
    """

    hip: FloatArray
    pieces: tuple[Piece, ...]

    @cached_property
    def position(self) -> FloatArray:
        """Where it ends, (2, N)."""
        return self.hip + sum((length * _along(angle) for length, angle, _ in self.pieces), np.zeros((2, 1)))

    @cached_property
    def jacobian(self) -> FloatArray:
        """Derivative of the position by q, (N, 2, 6)."""
        jacobian = np.zeros((self.hip.shape[1], 2, 6))
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
        for length, angle, slope in self.pieces:
            across = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            jacobian += length * across[:, :, None] * slope
        return jacobian

    @cached_property
    def hessian(self) -> FloatArray:
        """Second derivative of the position by q, (N, 2, 6, 6)."""
        hessian = np.zeros((self.hip.shape[1], 2, 6, 6))
        for length, angle, slope in self.pieces:
            hessian -= length * _along(angle).T[:, :, None, None] * np.outer(slope, slope)
        return hessian


def _along(angle: FloatArray) -> FloatArray:
    """Return the unit vectors (2, N) at angles from the downward vertical."""
    return np.array([np.sin(angle), -np.cos(angle)])


def _leg(walker: WalkerParameters, q: FloatArray, leg: int) -> tuple[Arm, Arm, Arm]:
    """Return upper-leg mass, lower-leg mass and foot of a leg."""
    upper_row, knee_row = 2 + 2 * leg, 3 + 2 * leg
    upper_slope, lower_slope = np.zeros(6), np.zeros(6)
    upper_slope[upper_row] = lower_slope[upper_row] = lower_slope[knee_row] = 1.0
    upper, lower = q[upper_row], q[upper_row] + q[knee_row] - np.pi
    thigh, shank = walker.upper_leg_length, walker.lower_leg_length
    whole, hip = (thigh, upper, upper_slope), q[:2]
    return (
        Arm(hip, ((thigh / 2, upper, upper_slope),)),
        Arm(hip, (whole, (shank / 2, lower, lower_slope))),
        Arm(hip, (whole, (shank, lower, lower_slope))),
    )


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The walker at N states, from the sums over its point masses.

    Attributes:
        qdot: Velocities M^-1 p, (6, N).
        force: -dH/dq, (6, N).
        feet: Both feet.
    """

    qdot: FloatArray
    force: FloatArray
    feet: tuple[Arm, Arm]

    def momentum_rate(self, u: FloatArray, reaction: FloatArray) -> FloatArray:
        """Return pdot of report eq. (4), (6, N).

        Args:
            u: Torques in [N m], (3, N).
            reaction: Ground reactions x, y of foot 1, then of foot 2, in [N], (4, N).
        """
        rate = self.force.copy()
        rate[2] += u[0]
        rate[4] -= u[0]
        rate[3] += u[1]
        rate[5] += u[2]
        return rate + self.generalized(reaction)

    def generalized(self, reaction: FloatArray) -> FloatArray:
        """Return J' times forces or impulses (4, N) on the feet, (6, N)."""
        pairs = zip(self.feet, (reaction[:2], reaction[2:]), strict=True)
        return sum((np.einsum("nai,an->in", foot.jacobian, one) for foot, one in pairs), np.zeros((6, 1)))

    def foot_velocity(self, leg: int) -> FloatArray:
        """Return the velocity of a foot in [m/s], (2, N)."""
        velocity: FloatArray = np.einsum("nai,in->an", self.feet[leg].jacobian, self.qdot)
        return velocity


def mechanics_at(walker: WalkerParameters, spring: KneeSpring, q: FloatArray, p: FloatArray) -> Mechanics:
    """Evaluate qdot = M^-1 p and -dH/dq, both (6, N)."""
    legs = [_leg(walker, q, leg) for leg in range(2)]
    masses = [(walker.hip_mass, Arm(q[:2], ()))]
    for upper, lower, _ in legs:
        masses += [(walker.upper_leg_mass, upper), (walker.lower_leg_mass, lower)]
    matrix = sum(mass * np.einsum("nai,naj->nij", arm.jacobian, arm.jacobian) for mass, arm in masses)
    qdot = np.linalg.solve(matrix, p.T[:, :, None])[:, :, 0]
    force = np.zeros_like(qdot)
    for mass, arm in masses:
        point_velocity = np.einsum("nai,ni->na", arm.jacobian, qdot)
        force += mass * np.einsum("na,naij,nj->ni", point_velocity, arm.hessian, qdot)
        force -= mass * walker.gravity * arm.jacobian[:, 1]
    for knee in (3, 5):
        force[:, knee] -= spring.stiffness * (q[knee] - spring.equilibrium)
    return Mechanics(qdot.T, force.T, (legs[0][2], legs[1][2]))


def foot_arm(walker: WalkerParameters, q: FloatArray, leg: int) -> Arm:
    """Return the foot of leg `leg` + 1 at coordinates (6, N)."""
    return _leg(walker, q, leg)[2]


def foot_2_ahead(walker: WalkerParameters, state: FloatArray) -> float:
    """Return how far foot 2 is ahead of the origin in [m]: as a step ends, its length.

    Args:
        walker: The walker.
        state: Coordinates and momenta (12,), or coordinates alone (6,).
    """
    return float(foot_arm(walker, state[:6, None], 1).position[0, 0])


def horizontal_and_vertical(walker: WalkerParameters, components: FloatArray) -> FloatArray:
    """Return x, y of foot 1, then of foot 2, (4, N), of what is given along and normal to the ground."""
    pairs = (walker.terrain.horizontal_and_vertical(components[rows]) for rows in ([0, 1], [2, 3]))
    return np.concatenate(list(pairs))


def along_and_normal(walker: WalkerParameters, vectors: FloatArray) -> FloatArray:
    """Return components along and normal to the ground, (4, N), of x, y of foot 1, then of foot 2."""
    pairs = (walker.terrain.along_and_normal(vectors[rows]) for rows in ([0, 1], [2, 3]))
    return np.concatenate(list(pairs))
