"""Gaits between two speeds, blended from the refined gaits of both, and judged like any other.

With s from 0 to 1 between the steps of two gaits A and B, the motion is (1 - s) A + s B at the same
fraction of the step, and so are step length and time, springs and impulses: speed and joint limits hold
exactly. The standing foot, which is off by the square of the distance of A and B, is put in its place.
Torques and ground reactions are those that this motion takes. What is left over is measured by the
certificate of refined gaits, with the tolerances of config/interpolation.yaml in place of a solver's.

Collocation polynomials stay such: on the union of both meshes, by fraction of the step, the blend of
two cubics is a cubic.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.errors import GaitNotFoundError
from walk_optimizer.gait import Certificate, Gait, RefinedGait, Trajectory
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.library.interpolation_bounds import InterpolationBounds, interpolation_bounds
from walk_optimizer.model.functions import evaluate, mass_matrices
from walk_optimizer.model.mechanics import along_and_normal, mechanics_at
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import SolveReport, Status
from walk_optimizer.transcription.tableau import DIFFERENTIATION, NODES_WITH_START

FloatArray = NDArray[np.float64]

# Breaks of two meshes that are closer than this fraction of the step are one.
_SAME_BREAK = 1e-9


def interpolated(
    lower: Gait, upper: Gait, request: GaitRequest, bounds: InterpolationBounds | None = None
) -> Gait:
    """Return the gait for a request between the steps of two gaits of the same walker and mode.

    Args:
        lower: With a refinement and a shorter step.
        upper: With a refinement and a longer step.
        request: Its step is on the line between those of both.
        bounds: What the blend has to keep; the packaged ones by default.

    Returns:
        A gait whose certificates hold the bounds, and whose grid holds samples of its refinement.

    Raises:
        GaitNotFoundError: a gait has no refinement, or the blend does not keep the bounds; the message
            names the family, the residual and the bound.
    """
    between = f"between {lower.speed:.4f} and {upper.speed:.4f} m/s"
    if lower.refined is None or upper.refined is None:
        raise GaitNotFoundError(f"not interpolated {between}: a neighbour has no refinement")
    share = (request.step_length - lower.step_length) / (upper.step_length - lower.step_length)
    blend = _standing(lower.walker, _blend(lower.refined, upper.refined, share, request.step_time))
    refined = _driven(lower.walker, blend)
    certificate = _judged(lower.walker, request, refined, bounds or interpolation_bounds())
    if not certificate.certified:
        raise GaitNotFoundError(f"not interpolated {between}: {certificate.worst}")
    refined = replace(refined, certificate=certificate)
    message = f"interpolated {between}, not solved; {certificate.worst}"
    return Gait(
        walker=lower.walker,
        request=request,
        spring=refined.spring,
        trajectory=_samples(lower.walker, refined, request),
        report=SolveReport(Status.ACCEPTABLE_ONLY, message, back_end=""),
        certificate=certificate,
        step_length=refined.step_length,
        refined=refined,
    )


def _judged(
    walker: WalkerParameters, request: GaitRequest, refined: RefinedGait, bounds: InterpolationBounds
) -> Certificate:
    """Return the residuals of a blend, judged by the bounds."""
    tolerances = bounds.by_family(walker)
    entries = certify_refined(walker, request, refined).entries
    return Certificate(
        tuple(replace(one, tolerance=tolerances.get(one.family, one.tolerance)) for one in entries)
    )


def _blend(lower: RefinedGait, upper: RefinedGait, share: float, step_time: float) -> RefinedGait:
    """Return (1 - share) of one gait and `share` of the other, yet without a certificate."""
    weights = np.array([1 - share, share])
    breaks = _common_breaks(lower.trajectory, upper.trajectory)
    pair = [_on_breaks(gait.trajectory, breaks) for gait in (lower, upper)]
    arrays = {name: np.tensordot(weights, [one[name] for one in pair], 1) for name in pair[0]}
    springs = [(gait.spring.stiffness, gait.spring.equilibrium) for gait in (lower, upper)]
    stiffness, equilibrium = weights @ springs
    return RefinedGait(
        trajectory=RefinedTrajectory(breaks=breaks * step_time, **arrays),
        # Rounding must not lift q_eq above pi.
        spring=KneeSpring(float(stiffness), min(float(equilibrium), float(np.pi))),
        step_length=float(weights @ [lower.step_length, upper.step_length]),
        certificate=Certificate(()),
    )


def _standing(walker: WalkerParameters, blend: RefinedGait) -> RefinedGait:
    """Return the blend moved as a whole, in place and velocity, so that foot 1 stands while it carries load.

    Moving the hip by r and its velocity by w moves both feet by r and w, and the momenta by M w with
    the two columns of M that belong to the hip. In a step without double support nothing slips then.
    """
    trajectory = blend.trajectory
    flat = trajectory.states.reshape(-1, 12)
    q, p = flat[:, :6].T, flat[:, 6:].T
    place, velocity = (evaluate(name, walker, q, p)[:, :, 0] for name in ("feet", "foot_velocities"))
    moved = flat.copy()
    moved[:, :2] -= place
    moved[:, 6:] -= np.einsum("nij,nj->ni", mass_matrices(walker, q)[:, :, :2], velocity)
    loaded = np.abs(trajectory.forces[:, :, :2]).max(axis=(1, 2)) > 0
    states = np.where(loaded[:, None, None], moved.reshape(-1, 4, 12), trajectory.states)
    return replace(blend, trajectory=replace(trajectory, states=states))


def _driven(walker: WalkerParameters, blend: RefinedGait) -> RefinedGait:
    """Return the blend with the torques and the force on foot 1 that its motion takes.

    Of the six equations of motion the force on foot 1 meets those of the hip, as J_1' has an identity
    there, the knee torques those of the knees. The hip torque acts on both upper legs, with opposite
    signs, so it meets the difference of theirs. What is left is half of their sum, the moment about the
    point foot, which nothing can give.
    """
    trajectory = blend.trajectory
    nodes = trajectory.states[:, 1:].reshape(-1, 12).T
    mechanics = mechanics_at(walker, blend.spring, nodes[:6], nodes[6:])
    rates = np.einsum("ij,njs->nis", DIFFERENTIATION, trajectory.states[:, :, 6:])
    rates /= trajectory.lengths[:, None, None]
    torques, forces = trajectory.torques.reshape(-1, 3).T.copy(), trajectory.forces.reshape(-1, 4).T.copy()
    missing = rates.reshape(-1, 6).T - mechanics.momentum_rate(torques, forces)
    on_foot = np.zeros_like(forces)
    on_foot[:2] = missing[:2]
    left = missing - mechanics.generalized(on_foot)
    torques += np.array([(left[2] - left[4]) / 2, left[3], left[5]])
    return replace(
        blend,
        trajectory=replace(
            trajectory,
            torques=torques.T.reshape(-1, 3, 3),
            forces=(forces + on_foot).T.reshape(-1, 3, 4),
        ),
    )


def _common_breaks(one: RefinedTrajectory, other: RefinedTrajectory) -> FloatArray:
    """Return the breaks of both meshes as fractions of the step, (n + 1,)."""
    both = np.sort(np.concatenate([one.breaks / one.step_time, other.breaks / other.step_time]))
    return both[np.diff(both, prepend=-1.0) > _SAME_BREAK]


def _on_breaks(trajectory: RefinedTrajectory, breaks: FloatArray) -> dict[str, FloatArray]:
    """Return states, torques, forces and impulses of a trajectory on a finer mesh of fractions."""
    times = breaks * trajectory.step_time
    states, torques, forces = [], [], []
    impulses = np.zeros((breaks.size - 1, 4))
    for row, (begin, end) in enumerate(pairwise(times)):
        index, _ = trajectory.locate((begin + end) / 2)
        length = trajectory.lengths[index]
        places = (begin - trajectory.breaks[index] + (end - begin) * NODES_WITH_START) / length
        states.append([trajectory.state(index, place) for place in places])
        torques.append([trajectory.torque(index, place) for place in places[1:]])
        forces.append([trajectory.force(index, place) for place in places[1:]])
        if places[0] < _SAME_BREAK:
            impulses[row] = trajectory.impulses[index]
    return {
        "states": np.array(states),
        "torques": np.array(torques),
        "forces": np.array(forces),
        "impulses": impulses,
    }


def _samples(walker: WalkerParameters, refined: RefinedGait, request: GaitRequest) -> Trajectory:
    """Return a refined step at the points of a request's grid."""
    trajectory = refined.trajectory
    time: FloatArray = request.interval * np.arange(1.0, request.points + 1)
    located = [trajectory.locate(min(one, trajectory.step_time)) for one in time]
    states = np.array([trajectory.state(*place) for place in located]).T
    along = along_and_normal(walker, np.array([trajectory.force(*place) for place in located]).T)
    mechanics = mechanics_at(walker, refined.spring, states[:6], states[6:])
    velocities = np.concatenate([mechanics.foot_velocity(leg) for leg in range(2)])
    return Trajectory(
        time=time,
        q=states[:6],
        p=states[6:],
        u=np.array([trajectory.torque(*place) for place in located]).T,
        reaction=np.concatenate([_three_components(along[:2]), _three_components(along[2:])]),
        slip_speed=np.abs(along_and_normal(walker, velocities)[[0, 2]]),
    )


def _three_components(force: FloatArray) -> FloatArray:
    """Return lambda x+, x-, y, (3, N), of a force along and normal to the ground, (2, N)."""
    along, normal = force
    return np.array([np.maximum(along, 0.0), np.maximum(-along, 0.0), normal])
