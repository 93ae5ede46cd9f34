"""The standing pose: at rest on both feet, one ahead of the other, with the least torques that hold it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import read_only
from walk_optimizer.model.dynamics import INPUT_MAP
from walk_optimizer.model.mechanics import foot_2_ahead, mechanics_at
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters

FloatArray = NDArray[np.float64]
# Least inner knee angle that is looked at in [rad]; far more bent than any stand of least torque.
_MOST_BENT = np.pi / 2


@dataclass(frozen=True, eq=False)
class Standing:
    """The walker at rest on both feet, as the step that follows sees it; arrays are read-only.

    Foot 1, the stance foot of the next step, is ahead and at the origin; foot 2 is behind. A stand is no
    step: the legs keep their names until the next step ends.

    Attributes:
        walker: The walker.
        spring: K and q_eq of both knees.
        q: Coordinates in [m] and [rad], (6,).
        torques: u that holds the pose in [N m], (3,).
        forces: Ground reactions x, y of foot 1, then of foot 2, in [N], (4,).
    """

    walker: WalkerParameters
    spring: KneeSpring
    q: FloatArray
    torques: FloatArray
    forces: FloatArray

    def __post_init__(self) -> None:
        """Make every array read-only."""
        for name in ("q", "torques", "forces"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def state(self) -> FloatArray:
        """The state (12,): q, and p = 0."""
        return np.concatenate([self.q, np.zeros(6)])

    @property
    def feet_distance(self) -> float:
        """How far foot 2 is behind foot 1, in [m]."""
        return -foot_2_ahead(self.walker, self.state)

    def on(self, spring: KneeSpring) -> "Standing":
        """Return the same pose held with another knee spring."""
        torques, forces = _holding(self.walker, spring, self.q)
        return Standing(self.walker, spring, self.q, torques, forces)


def standing_pose(walker: WalkerParameters, feet_distance: float, knee_bend: float) -> Standing:
    """Return the stand of least torque without springs; `Standing.on` holds it with a spring.

    Both legs are bent alike. Of the forces that the feet may press against each other along the ground,
    those of least torque are taken.

    Args:
        walker: The walker.
        feet_distance: Between the feet in [m].
        knee_bend: Knees are bent by at least so much, in [rad]. With two stretched knees the hip is at
            the edge of what the legs reach, where no motion can come to rest.

    Raises:
        InvalidRequestError: the legs don't reach so far apart, or the walker's terrain is not level.
    """
    if not walker.terrain.is_flat:
        raise InvalidRequestError(
            "stands and transitions are for level ground, the walker's terrain is not level"
        )
    if not 0 < feet_distance < walker.longest_step:
        raise InvalidRequestError(
            f"feet are {feet_distance:g} m apart, allowed is above 0 and below {walker.longest_step:g} m"
        )

    spring = KneeSpring()

    def load(knee: float) -> float:
        torques, _ = _holding(walker, spring, _pose(walker, knee, feet_distance))
        return float(torques @ torques)

    # A bounded search comes close to its bounds only.
    stretched = np.pi - knee_bend
    found = minimize_scalar(load, bounds=(_MOST_BENT, stretched), method="bounded", options={"xatol": 1e-10})
    knee = min((float(found.x), stretched), key=load)
    q = _pose(walker, knee, feet_distance)
    return Standing(walker, spring, q, *_holding(walker, spring, q))


def _pose(walker: WalkerParameters, knee: float, feet_distance: float) -> FloatArray:
    """Return the coordinates (6,) with both knees at an angle in [rad] and the hip between the feet."""
    along = walker.upper_leg_length - walker.lower_leg_length * np.cos(knee)
    across = -walker.lower_leg_length * np.sin(knee)
    # The foot is at this angle from the upper leg, seen from the hip.
    bend = np.arctan2(across, along)
    height = np.sqrt(along**2 + across**2 - feet_distance**2 / 4)
    spread = np.arctan2(feet_distance / 2, height)
    return np.array([-feet_distance / 2, height, spread - bend, knee, -spread - bend, knee])


def _holding(walker: WalkerParameters, spring: KneeSpring, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the torques u (3,) and ground reactions (4,) of least |u| that hold a pose.

    B u + J' f = dV/dq are six equations for seven numbers: u = u_0 + t u_1 and f = f_0 + t f_1, where
    (u_1, f_1) is in the null space; |u| is least at t = -u_0 u_1 / |u_1|^2.
    """
    mechanics = mechanics_at(walker, spring, q[:, None], np.zeros((6, 1)))
    columns = [*INPUT_MAP.T, *(row for foot in mechanics.feet for row in foot.jacobian[0])]
    matrix = np.array(columns).T
    particular = np.linalg.lstsq(matrix, -mechanics.force[:, 0], rcond=None)[0]
    free = np.linalg.svd(matrix)[2][-1]
    held: FloatArray = particular - free * (particular[:3] @ free[:3]) / (free[:3] @ free[:3])
    return held[:3], held[3:]
