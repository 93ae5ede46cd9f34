"""Residuals of a transition in plain NumPy and by an integrator, apart from the solver."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.grid import landing_speed_entries, stance_load_entries
from walk_optimizer.certificate.refined import (
    bound_entries,
    collocation_entries,
    contact_entries,
    jump_entries,
    largest,
)
from walk_optimizer.certificate.replay import interval_errors
from walk_optimizer.gait import Certificate, CertificateEntry, RefinedGait
from walk_optimizer.gait.refined_peaks import torque_peaks
from walk_optimizer.model.kinematics import HIP_X, HIP_Y
from walk_optimizer.model.mechanics import along_and_normal, foot_2_ahead, mechanics_at
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.transition.paces import (
    Pace,
    border_state,
    end_state,
    next_step_sees,
    refined_of,
    velocity,
)
from walk_optimizer.transition.standing import Standing
from walk_optimizer.transition.torque_limit import TorqueLimit, each_torque

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-6
# Joints meet this closely, in [rad], from the end of the source through all steps to the end of the target's.
JOINT_TOLERANCE = 1e-8
# Torques may be beyond their limit by this part of the walker's weight, times 1 m.
_TORQUE_TOLERANCE = 1e-6


def certify_steps(
    walker: WalkerParameters,
    source: Pace,
    target: Pace,
    steps: Sequence[RefinedGait],
    torque_limit: TorqueLimit,
    *,
    replay: bool = True,
) -> tuple[tuple[RefinedGait, ...], Certificate]:
    """Return the steps with their certificates, and that of the whole transition.

    Args:
        walker: The walker.
        source: What the first step begins in.
        target: What the last step ends in.
        steps: The steps; their own certificates are not looked at.
        torque_limit: Largest magnitude of each torque in [N m], or that of the hips and that of the knees.
        replay: Whether to replay each interval; of steps that were not solved that may take very long,
            and without it there is no certificate to speak of.
    """
    if not all(step.trajectory.is_finite for step in steps):
        # An integrator would not come to an end.
        return tuple(steps), Certificate((CertificateEntry("finite", np.inf, "-", 0.0),))
    before, certified = border_state(source), []
    for step in steps:
        entries = _step_entries(walker, step, before, torque_limit, is_last=step is steps[-1])
        if replay:
            entries.append(_replay_entry(walker, step))
        certified.append(replace(step, certificate=Certificate(tuple(entries))))
        before = next_step_sees(walker, step.trajectory.states[-1, -1])
    begin = steps[0].trajectory.states[0, 0, :6] - end_state(source)[:6]
    joins = [
        CertificateEntry("departure", largest(begin), "m, rad", _join_tolerance(source)),
        *_arrival_entries(walker, before, target),
    ]
    every = (entry for step in certified for entry in step.certificate.entries)
    return tuple(certified), Certificate((*_largest_of_each(every), *joins))


def _step_entries(
    walker: WalkerParameters,
    step: RefinedGait,
    before: FloatArray,
    torque_limit: TorqueLimit,
    *,
    is_last: bool,
) -> list[CertificateEntry]:
    """Return the residuals of a step that begins in a state (12,); the last one ends as its target does."""
    trajectory = step.trajectory
    nodes = trajectory.states[:, 1:].reshape(-1, 12).T
    mechanics = mechanics_at(walker, step.spring, nodes[:6], nodes[6:])
    forces = trajectory.forces.reshape(-1, 4).T
    landing = foot_2_ahead(walker, trajectory.states[-1, -1]) - step.step_length
    torque = max(0.0, float((torque_peaks(trajectory) - each_torque(torque_limit)).max()))
    return [
        *collocation_entries(walker, trajectory, mechanics),
        *jump_entries(walker, step, before),
        CertificateEntry("landing", abs(landing), "m", _TOLERANCE),
        *([] if is_last else landing_speed_entries(walker, mechanics)),
        *stance_load_entries(walker, along_and_normal(walker, forces)[1::2]),
        *contact_entries(walker, step.step_length, mechanics, forces),
        *bound_entries(walker, step.step_length, trajectory),
        CertificateEntry("torque_limit", torque, "N m", _TORQUE_TOLERANCE * walker.weight),
    ]


def _replay_entry(walker: WalkerParameters, step: RefinedGait) -> CertificateEntry:
    """Return how far the intervals of a step are from their replay."""
    error = largest(interval_errors(walker, step.spring, step.trajectory))
    return CertificateEntry("interval_replay", error, "m, rad", _TOLERANCE)


def _arrival_entries(walker: WalkerParameters, reached: FloatArray, target: Pace) -> list[CertificateEntry]:
    """Return how far the state (12,) that the last step ends in is from the target's."""
    wanted, tolerance = end_state(target), _join_tolerance(target)
    apart = reached[:6] - wanted[:6]
    speeds = velocity(walker, reached) - velocity(walker, wanted)
    return [
        CertificateEntry("arrival_joints", largest(apart[2:]), "rad", tolerance),
        CertificateEntry("arrival_hip", largest(apart[[HIP_X, HIP_Y]]), "m", max(tolerance, _TOLERANCE)),
        CertificateEntry("arrival_velocity", largest(speeds), "m/s, rad/s", _stated(target, "kinematics")),
    ]


def _join_tolerance(pace: Pace) -> float:
    """Return how closely steps have to join a pace, in [m] and [rad].

    A gait that is blended from others is no closer to one of the walker than its own certificate says.
    """
    stated = _stated(pace, "landing")
    return JOINT_TOLERANCE if stated <= _TOLERANCE else stated


def _stated(pace: Pace, family: str) -> float:
    """Return the tolerance of a family in a pace's own certificate, at least that of solved gaits."""
    if isinstance(pace, Standing):
        return _TOLERANCE
    entries = refined_of(pace).certificate.entries
    return max([_TOLERANCE, *(entry.tolerance for entry in entries if entry.family == family)])


def _largest_of_each(entries: Iterable[CertificateEntry]) -> tuple[CertificateEntry, ...]:
    """Return the worst entry of each family."""
    worst: dict[str, CertificateEntry] = {}
    for entry in entries:
        known = worst.get(entry.family)
        if known is None or not entry.relative <= known.relative:
            worst[entry.family] = entry
    return tuple(worst.values())
