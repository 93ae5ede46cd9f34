"""Reads off what the feet of a solution do."""

import numpy as np

from walk_optimizer.contact.schedule import FloatArray, Schedule, observed_schedule
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.parameters import WalkerParameters


def slip_velocities(walker: WalkerParameters, q: FloatArray, p: FloatArray) -> FloatArray:
    """Return the tangential velocity of both feet in [m/s], (2, N), at states q, p, (6, N) each."""
    velocities = evaluate("foot_velocities", walker, q, p)
    along: FloatArray = walker.terrain.along_and_normal(velocities.transpose(1, 2, 0))[0]
    return along


def schedule_of(
    walker: WalkerParameters, step_length: float, q: FloatArray, p: FloatArray, reaction: FloatArray
) -> Schedule:
    """Return the contacts that a solution uses, (2, N).

    Args:
        walker: The walker.
        step_length: Of the request, in [m].
        q: Coordinates, (6, N).
        p: Momenta, (6, N).
        reaction: lambda in [N], (6, N).
    """
    forces = reaction.reshape(2, 3, -1) / walker.weight
    normal = forces[:, 2]
    cone_slack = walker.friction_coefficient * normal - forces[:, 0] - forces[:, 1]
    feet = evaluate("feet", walker, q, np.zeros_like(q)).transpose(1, 2, 0)
    gaps = walker.terrain.gap(feet, step_length)
    return observed_schedule(gaps / walker.leg_length, normal, cone_slack, slip_velocities(walker, q, p))
