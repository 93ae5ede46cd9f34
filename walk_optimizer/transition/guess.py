"""First guesses of transitions: each step fades from one pace into the next."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Gait
from walk_optimizer.model.kinematics import HIP_X
from walk_optimizer.model.parameters import KneeSpring
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints
from walk_optimizer.transcription.phases import phase_shares
from walk_optimizer.transition.paces import EXCHANGED, Pace, border_state, former_step_sees, refined_of
from walk_optimizer.transition.plan import ContactPlan
from walk_optimizer.transition.standing import Standing

FloatArray = NDArray[np.float64]

# A step that begins or ends on both feet takes about so much longer than one of its gait.
_STANDING_SHARE = 1.5
# Torques and ground reactions with the names of the legs exchanged, behind a state of 12.
_ALL_EXCHANGED = np.concatenate([EXCHANGED, 12 + np.array([0, 2, 1]), 15 + np.array([2, 3, 0, 1])])
_ALL_SIGNS = np.where(np.arange(19) == 12, -1.0, 1.0)
_STATE, _TORQUE, _FORCE = slice(0, 12), slice(12, 15), slice(15, 19)


def faded_points(
    plan: ContactPlan, mesh: Mesh, source: Pace, target: Pace, spring: KneeSpring
) -> RefinedPoints:
    """Return a first guess on a mesh.

    Args:
        plan: The contacts.
        mesh: All phases with their intervals.
        source: What the first step begins in.
        target: What the last step ends in.
        spring: K and q_eq of both knees.
    """
    steps, time = len(plan.steps), _step_time(source, target)
    durations = np.concatenate([phase_shares(phases) * time for phases in plan.steps])
    nodes = mesh.node_times(durations) / time
    step = np.minimum(nodes[:, 0].astype(int), steps - 1)
    values = np.array(
        [_faded(source, target, k, steps, places - k) for k, places in zip(step, nodes, strict=True)]
    )
    origin = 0.0
    for k in range(1, steps):
        origin += _mean_length(source, target)
        values[step == k] = (
            values[step == k][..., _ALL_EXCHANGED] * _ALL_SIGNS if k % 2 else values[step == k]
        )
        values[step == k, :, HIP_X] += origin
    impulses = np.zeros((len(mesh.phases), 4))
    if not isinstance(source, Standing):
        impulses[0] = refined_of(source).trajectory.impulses[0]
    return RefinedPoints(
        states=values[..., _STATE],
        torques=values[:, 1:, _TORQUE],
        forces=values[:, 1:, _FORCE],
        durations=durations,
        impulses=impulses,
        spring=spring,
    )


def _step_time(source: Pace, target: Pace) -> float:
    """Return a likely duration of a step in [s]."""
    times = [
        refined_of(pace).trajectory.step_time for pace in (source, target) if not isinstance(pace, Standing)
    ]
    return float(np.mean(times)) * (_STANDING_SHARE if len(times) == 1 else 1.0)


def _mean_length(source: Pace, target: Pace) -> float:
    """Return a likely length of a step in [m]."""
    lengths = [refined_of(pace).step_length for pace in (source, target) if not isinstance(pace, Standing)]
    return float(np.mean(lengths))


def _faded(source: Pace, target: Pace, step: int, steps: int, places: FloatArray) -> FloatArray:
    """Return state, torques and forces (K, 19) at places in [0, 1] of a step."""
    along = (step + places) / steps
    if isinstance(source, Standing):
        along = np.where(step == 0, places, 1.0)
    elif isinstance(target, Standing):
        along = np.where(step == steps - 1, places, 0.0)
    weight = (along**2 * (3 - 2 * along))[:, None]
    values: FloatArray = (1 - weight) * _begun(source, places) + weight * _ended(target, places)
    return values


def _begun(pace: Pace, places: FloatArray) -> FloatArray:
    """Return values of a pace (K, 19) as the step that leaves it sees them."""
    if not isinstance(pace, Standing):
        return _walked(pace, places)
    return np.tile(np.concatenate([border_state(pace), pace.torques, pace.forces]), (places.size, 1))


def _ended(pace: Pace, places: FloatArray) -> FloatArray:
    """Return values of a pace (K, 19) as the step that leads to it sees them."""
    if not isinstance(pace, Standing):
        return _walked(pace, places)
    held = np.concatenate([border_state(pace), pace.torques, pace.forces])[_ALL_EXCHANGED] * _ALL_SIGNS
    held[_STATE] = former_step_sees(pace.walker, border_state(pace))
    return np.tile(held, (places.size, 1))


def _walked(pace: Gait, places: FloatArray) -> FloatArray:
    """Return values of a gait (K, 19)."""
    trajectory = refined_of(pace).trajectory
    found = [trajectory.locate(place * trajectory.step_time) for place in places.tolist()]
    return np.array(
        [
            np.concatenate([trajectory.state(*one), trajectory.torque(*one), trajectory.force(*one)])
            for one in found
        ]
    )
