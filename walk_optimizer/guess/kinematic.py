"""First guesses from nothing but the parameters: imposed foot and hip paths and inverse kinematics.

The report builds its initial gaits the same way (report section 5).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.functions import mass_matrices
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import layout

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class GuessShape:
    """The choices in a kinematic guess.

    Attributes:
        clearance: Largest height of the swing foot as a fraction of the leg [-].
        flexion: How much shorter than stretched the stance leg is, as a fraction of the leg [-].
    """

    clearance: float = 0.05
    flexion: float = 0.002


def kinematic_guess(walker: WalkerParameters, request: GaitRequest, shape: GuessShape) -> FloatArray:
    """Return a guess of all points, (23, N) in SI units, for a walk on stiff legs.

    The hip moves at constant speed on a circle about the stance foot, which stands at the origin;
    the swing foot moves from one step length behind to one ahead on a cycloid. On a slope or stairs the
    whole walk is turned about the stance foot, so that the swing foot lands at the height of the
    ground. Momenta are those of the implicit Euler grid, the stance foot carries the weight, and
    torques are zero.
    """
    phase = np.arange(request.points + 1) / request.points
    leg = walker.leg_length * (1 - shape.flexion)
    rise = float(walker.terrain.height(request.step_length, request.step_length))
    stride = np.hypot(request.step_length, rise)
    turned = np.array([[request.step_length, -rise], [rise, request.step_length]]) / stride
    hip_x = stride * (phase - 0.5)
    # Steps up to two stretched legs are possible: where the bent leg is too short, the hip is on the ground.
    hip = np.array([hip_x, np.sqrt(np.maximum(leg**2 - hip_x**2, 0.0))])
    cycloid = phase - np.sin(2 * np.pi * phase) / (2 * np.pi)
    swing_x = stride * (2 * cycloid - 1)
    swing = np.array([swing_x, shape.clearance * walker.leg_length * np.sin(np.pi * phase) ** 2])
    hip, swing = turned @ hip, turned @ swing
    q = np.vstack([hip, leg_angles(walker, -hip), leg_angles(walker, swing - hip)])
    return _with_momenta(walker, request, q)


def leg_angles(walker: WalkerParameters, foot: FloatArray) -> FloatArray:
    """Return upper-leg and knee angle, (2, M), that place the foot at (2, M) relative to the hip.

    The cosine rule gives the inner knee angle k; the knee points forward. Seen from the hip, the foot
    is upper - lower cos k along the upper leg and lower sin k behind it. Feet out of reach are brought
    to the stretched leg.
    """
    upper, lower = walker.upper_leg_length, walker.lower_leg_length
    reach = np.minimum(np.hypot(*foot), (upper + lower) * (1 - 1e-6))
    knee = np.arccos(np.clip((upper**2 + lower**2 - reach**2) / (2 * upper * lower), -1, 1))
    lead = np.arctan2(lower * np.sin(knee), upper - lower * np.cos(knee))
    return np.array([np.arctan2(foot[0], -foot[1]) + lead, knee])


def _with_momenta(walker: WalkerParameters, request: GaitRequest, q: FloatArray) -> FloatArray:
    """Return the points (23, N) for coordinates (6, N + 1) that begin with the state before point 1."""
    qdot = np.diff(q, axis=1) / request.interval
    points = np.zeros((layout.POINT_WIDTH, request.points))
    points[layout.Q] = q[:, 1:]
    points[layout.P] = np.einsum("nij,jn->in", mass_matrices(walker, q[:, 1:]), qdot)
    points[layout.REACTION][2] = walker.weight
    return points


def resampled(points: FloatArray, count: int) -> FloatArray:
    """Return points (23, N) interpolated linearly onto `count` grid points of the same step.

    The reactions of the first point are the impulse of the landing spread over one interval: they grow
    as the intervals shrink, and the points after it have no part in them.
    """
    old = np.arange(1, points.shape[1] + 1) / points.shape[1]
    new = np.arange(1, count + 1) / count
    finer = np.array([np.interp(new, old, row) for row in points])
    forces = points[layout.REACTION]
    finer[layout.REACTION] = np.array([np.interp(new, old[1:], row[1:]) for row in forces])
    finer[layout.REACTION, 0] = forces[:, 0] * count / points.shape[1]
    return finer


@dataclass(frozen=True)
class Start:
    """A first guess with its name.

    Attributes:
        name: For reports.
        shape: Choices of the kinematic guess.
        spring: First guess of K and q_eq.
    """

    name: str
    shape: GuessShape
    spring: KneeSpring
