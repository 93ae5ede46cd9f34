"""Reads off what the feet of a solution do."""

from walk_optimizer.contact.schedule import FloatArray, Schedule, observed_schedule
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.parameters import WalkerParameters


def slip_velocities(walker: WalkerParameters, q: FloatArray, p: FloatArray) -> FloatArray:
    """Return the tangential velocity of both feet in [m/s], (2, N), at states q, p, (6, N) each."""
    return evaluate("foot_velocities", walker, q, p)[:, 0, :].T


def schedule_of(walker: WalkerParameters, q: FloatArray, p: FloatArray, reaction: FloatArray) -> Schedule:
    """Return the contacts that a solution uses, (2, N).

    Args:
        walker: The walker.
        q: Coordinates, (6, N).
        p: Momenta, (6, N).
        reaction: lambda in [N], (6, N).
    """
    forces = reaction.reshape(2, 3, -1) / walker.weight
    normal = forces[:, 2]
    cone_slack = walker.friction_coefficient * normal - forces[:, 0] - forces[:, 1]
    heights = evaluate("feet", walker, q, p)[:, 1, :].T
    return observed_schedule(heights / walker.leg_length, normal, cone_slack, slip_velocities(walker, q, p))
