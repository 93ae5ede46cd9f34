"""Residuals of a finger's motion in plain NumPy, from Newton's laws of its masses.

They are written here once more on purpose: a check must not share the mistakes of what it checks.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import Schedule, observed_schedule
from walk_optimizer.examples.finger_model import Finger
from walk_optimizer.examples.finger_problem import FORCES, SLIP, FingerTask, P, Q, U, rest
from walk_optimizer.gait import Certificate, CertificateEntry

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class _Contact:
    """A contact at N points: gap, tangential velocity and lambda (forward, backward, normal), gamma."""

    gap: FloatArray
    slip: FloatArray
    forces: FloatArray
    gamma: FloatArray

    @property
    def tangential(self) -> FloatArray:
        """Friction force in [N], (N,)."""
        tangential: FloatArray = self.forces[0] - self.forces[1]
        return tangential

    def cone(self, friction: float) -> FloatArray:
        """Return what is left of the friction cone in [N], (N,)."""
        slack: FloatArray = friction * self.forces[2] - self.forces[0] - self.forces[1]
        return slack


class _Motion:
    """A finger's motion at its points, from the places of its masses."""

    def __init__(self, finger: Finger, points: FloatArray) -> None:
        self.finger, self.q, self.p, self.u = finger, points[Q], points[P], points[U]
        shoulder, elbow = self.q[0], self.q[0] + self.q[1]
        link = finger.link
        self.upper = link * np.array([np.sin(shoulder), -np.cos(shoulder)])
        self.lower = link * np.array([np.sin(elbow), -np.cos(elbow)])
        self.tip = np.array([[finger.base_x], [finger.base_y]]) + self.upper + self.lower
        self.matrix = self._mass_matrix()
        self.qdot = np.linalg.solve(self.matrix, self.p.T[:, :, None])[:, :, 0].T
        self.contacts = self._contacts(points[FORCES], points[SLIP])

    def _mass_matrix(self) -> FloatArray:
        """Return M(q), (N, 5, 5): of the two point masses, then of the disc."""
        one, square, radius = self.finger, self.finger.link**2, self.finger.disc_radius
        cosine = np.cos(self.q[1])
        matrix = np.zeros((self.q.shape[1], 5, 5))
        matrix[:, 0, 0] = (one.elbow_mass + one.tip_mass * (2 + 2 * cosine)) * square
        matrix[:, 0, 1] = matrix[:, 1, 0] = one.tip_mass * (1 + cosine) * square
        matrix[:, 1, 1] = one.tip_mass * square
        matrix[:, 2, 2] = matrix[:, 3, 3] = one.disc_mass
        matrix[:, 4, 4] = one.disc_mass * radius**2 / 2
        return matrix

    def _contacts(self, forces: FloatArray, gamma: FloatArray) -> tuple[_Contact, _Contact]:
        """Return the tip on the disc and the disc on the table."""
        radius, around = self.finger.disc_radius, self.finger.disc_radius * self.qdot[4]
        offset = self.tip - self.q[2:4]
        self.distance = np.hypot(*offset)
        self.normal = offset / self.distance
        self.tangent = np.array([-self.normal[1], self.normal[0]])
        relative = self._tip_velocity() - self.qdot[2:4]
        passing = np.sum(self.tangent * relative, axis=0) - around
        return (
            _Contact(self.distance - radius, passing, forces[:3], gamma[0]),
            _Contact(self.q[3] - radius, self.qdot[2] + around, forces[3:], gamma[1]),
        )

    def _tip_velocity(self) -> FloatArray:
        whole, lower = _turned(self.upper + self.lower), _turned(self.lower)
        velocity: FloatArray = whole * self.qdot[0] + lower * self.qdot[1]
        return velocity

    def force(self) -> FloatArray:
        """Return pdot, (5, N): of gravity, motion, torques and contacts."""
        one = self.finger
        on_tip, on_disc = self.contacts
        push = self.tangent * on_tip.tangential + self.normal * on_tip.forces[2]
        weights = one.gravity * np.array([one.elbow_mass + one.tip_mass, one.tip_mass])
        whole, lower = _turned(self.upper + self.lower), _turned(self.lower)
        total = np.zeros_like(self.q)
        total[0] = -weights[0] * _turned(self.upper)[1] - weights[1] * lower[1] + np.sum(whole * push, axis=0)
        total[1] = -weights[1] * lower[1] + np.sum(lower * push, axis=0)
        # d/dq2 of the co-energy: the only coordinate that the mass matrix depends on.
        rates = self.qdot[0] * (self.qdot[0] + self.qdot[1])
        total[1] -= one.tip_mass * one.link**2 * np.sin(self.q[1]) * rates
        total[:2] += self.u
        total[2:4] = np.array([on_disc.tangential, on_disc.forces[2] - one.disc_mass * one.gravity]) - push
        total[4] = one.disc_radius * (on_disc.tangential - on_tip.tangential)
        return total


def _turned(vector: FloatArray) -> FloatArray:
    """Return vectors (2, N) turned by a right angle anticlockwise."""
    return np.array([-vector[1], vector[0]])


def contacts_of(finger: Finger, points: FloatArray) -> Schedule:
    """Return what tip and disc do at each of the points (20, N), (2, N)."""
    weight, size = finger.disc_mass * finger.gravity, 2 * finger.disc_radius
    contacts = _Motion(finger, points).contacts
    return observed_schedule(
        np.array([one.gap for one in contacts]) / size,
        np.array([one.forces[2] for one in contacts]) / weight,
        np.array([one.cone(finger.friction) for one in contacts]) / weight,
        np.array([one.slip for one in contacts]),
    )


def certify_finger(finger: Finger, task: FingerTask, points: FloatArray) -> Certificate:
    """Return the residuals of a motion, (20, N) in SI units, on the implicit Euler grid."""
    motion = _Motion(finger, points)
    states = np.vstack([motion.q, motion.p])
    rates = np.diff(states, axis=1, prepend=rest(finger)[:, None]) / task.interval
    weight = finger.disc_mass * finger.gravity
    miss = abs(motion.q[2, -1] - task.distance)
    families = {
        "kinematics": (rates[:5] - motion.qdot, "m/s, rad/s", _TOLERANCE),
        "dynamics": (rates[5:] - motion.force(), "N, N m", _TOLERANCE * weight),
        "distance": (miss, "m", _TOLERANCE),
        "signs": (np.minimum(points[FORCES.start :], 0.0), "N, m/s", _TOLERANCE),
    }
    entries = [
        CertificateEntry(name, float(np.abs(values).max()), unit, tolerance)
        for name, (values, unit, tolerance) in families.items()
    ]
    for name, contact in zip(("tip", "disc"), motion.contacts, strict=True):
        entries += _contact_entries(name, contact, finger.friction, weight)
    return Certificate(tuple(entries))


def _contact_entries(name: str, contact: _Contact, friction: float, weight: float) -> list[CertificateEntry]:
    """Return penetration, cone, slack and the largest product of one contact."""
    cone = contact.cone(friction)
    forward, backward, normal = contact.forces
    slack = contact.gamma - np.abs(contact.slip)
    products = [
        contact.gap * normal,
        cone * contact.gamma,
        (contact.gamma + contact.slip) * forward,
        (contact.gamma - contact.slip) * backward,
    ]
    families = {
        "penetration": (np.minimum(contact.gap, 0.0), "m", _TOLERANCE),
        "friction_cone": (np.minimum(cone, 0.0), "N", _TOLERANCE * weight),
        "slip_slack": (np.minimum(slack, 0.0), "m/s", _TOLERANCE),
        "complementarity": (np.array(products), "N m, W", _TOLERANCE * weight),
    }
    return [
        CertificateEntry(f"{name}_{family}", float(np.abs(values).max()), unit, tolerance)
        for family, (values, unit, tolerance) in families.items()
    ]
