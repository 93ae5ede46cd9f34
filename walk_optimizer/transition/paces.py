"""What a transition leads from and to: a gait or a stand, as states at the border between two steps."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import Gait, RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.functions import mass_matrices
from walk_optimizer.model.kinematics import HIP_X, RELABELLED, UPPER_2
from walk_optimizer.model.mechanics import foot_2_ahead, foot_arm, mechanics_at
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transition.standing import Standing

FloatArray = NDArray[np.float64]

# Solved gaits are closer to the ground than this, in [m].
_OFF_THE_GROUND = 1e-6
_NEWTON_STEPS = 5
# The first coordinates are the place of the hip.
_HIP = 2
# A pace goes on without end: a gait repeats its step, a stand stays.
Pace: TypeAlias = Gait | Standing
# Rows of a state with the names of the legs exchanged.
EXCHANGED = np.array([*RELABELLED, *(6 + row for row in RELABELLED)])


def refined_of(gait: Gait) -> RefinedGait:
    """Return the accurate solution of a gait.

    Raises:
        InvalidRequestError: it has none that is certified, so no step can be joined to it exactly.
    """
    if gait.refined is None or not gait.refined.certificate.certified:
        raise InvalidRequestError(
            f"the gait of {gait.request.speed:.4f} m/s has no certified refined part; "
            "transitions begin and end at refined gaits: solve it with refinement"
        )
    return gait.refined


def pace_name(pace: Pace) -> str:
    """Return the name of a pace in files: the same request has the same name."""
    if isinstance(pace, Standing):
        return "stand"
    request = pace.request
    return f"{request.spring_mode.value}_{request.step_length:.4f}m_{request.step_time:.4f}s"


def spring_of(pace: Pace) -> KneeSpring:
    """Return the knee spring of a pace."""
    return pace.spring if isinstance(pace, Standing) else refined_of(pace).spring


def end_state(pace: Pace) -> FloatArray:
    """Return the state (12,) in which a pace is left and reached, as the step that follows sees it."""
    if isinstance(pace, Standing):
        return pace.state
    return next_step_sees(pace.walker, refined_of(pace).trajectory.states[-1, -1])


def border_state(pace: Pace) -> FloatArray:
    """Return the state (12,) that steps begin and end in: that of the pace, put on the ground.

    They differ for gaits that are blended from others, whose feet stand and land in about the right
    place.
    """
    if isinstance(pace, Standing):
        return pace.state
    state = refined_of(pace).trajectory.states[-1, -1]
    feet = [foot_arm(pace.walker, state[:6, None], leg).position[:, 0] for leg in range(2)]
    if max(abs(feet[0]).max(), abs(feet[1][1])) > _OFF_THE_GROUND:
        state = _on_the_ground(pace.walker, state)
    return next_step_sees(pace.walker, state)


def _on_the_ground(walker: WalkerParameters, state: FloatArray) -> FloatArray:
    """Return a state (12,) at the end of a step with foot 1 standing at the origin, and foot 2 landing.

    The angles and velocities of the joints are kept, but for the angle of hip 2.
    """
    q = state[:6].copy()
    for _ in range(_NEWTON_STEPS):
        q[:_HIP] -= foot_arm(walker, q[:, None], 0).position[:, 0]
        landing = foot_arm(walker, q[:, None], 1)
        q[UPPER_2] -= landing.position[1, 0] / landing.jacobian[0, 1, UPPER_2]
    qdot = velocity(walker, state)
    standing = foot_arm(walker, q[:, None], 0).jacobian[0]
    qdot[:_HIP] = -standing[:, _HIP:] @ qdot[_HIP:]
    return np.concatenate([q, mass_matrices(walker, q[:, None])[0] @ qdot])


def next_step_sees(walker: WalkerParameters, state: FloatArray) -> FloatArray:
    """Return the state (12,) at the end of a step in the next step's words.

    The legs exchange names, and the origin is where foot 2 stands.
    """
    seen: FloatArray = state[EXCHANGED]
    seen[HIP_X] -= foot_2_ahead(walker, state)
    return seen


def former_step_sees(walker: WalkerParameters, state: FloatArray) -> FloatArray:
    """Return the state (12,) before a step as the step before it sees it: undoes `next_step_sees`.

    Foot 2, which is behind now, stands where the origin was then.
    """
    return next_step_sees(walker, state)


def velocity(walker: WalkerParameters, state: FloatArray) -> FloatArray:
    """Return qdot (6,) in a state (12,)."""
    return mechanics_at(walker, KneeSpring(), state[:6, None], state[6:, None]).qdot[:, 0]


def with_legs_exchanged(trajectory: RefinedTrajectory) -> RefinedTrajectory:
    """Return a trajectory with the names of the legs exchanged."""
    return RefinedTrajectory(
        trajectory.breaks,
        trajectory.states[:, :, EXCHANGED],
        trajectory.torques[:, :, [0, 2, 1]] * np.array([-1.0, 1.0, 1.0]),
        trajectory.forces[:, :, [2, 3, 0, 1]],
        trajectory.impulses[:, [2, 3, 0, 1]],
    )
