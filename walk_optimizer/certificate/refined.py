"""Residuals of a refined gait in plain NumPy and by an integrator, apart from the solver."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.grid import (
    RELATIVE_TOLERANCE,
    landing_speed_entries,
    spring_entries,
    stance_load_entries,
    tread_entries,
)
from walk_optimizer.certificate.replay import HELD_SPEED, interval_errors
from walk_optimizer.gait import Certificate, CertificateEntry, RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.kinematics import RELABELLED
from walk_optimizer.model.mechanics import Mechanics, along_and_normal, foot_arm, mechanics_at
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription.tableau import DIFFERENTIATION, STAGES

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-6
# Between the nodes nothing is constrained: there the foot may dip, and the knee bend, by so much.
BETWEEN_TOLERANCE = 1e-4
_PLACES_BETWEEN = np.linspace(0.0, 1.0, 9)


def certify_refined(walker: WalkerParameters, request: GaitRequest, gait: RefinedGait) -> Certificate:
    """Return the residuals of a refined gait; its own certificate is not looked at.

    The collocation equations are evaluated at the nodes, and each interval is replayed from its start
    by a tight integrator. Rows in [m] and [rad], in [N] and [N m] are judged together.

    Args:
        walker: The walker.
        request: Speed and step that the gait has to meet.
        gait: The refined gait.
    """
    trajectory = gait.trajectory
    if not trajectory.is_finite:
        # An integrator would not come to an end.
        return Certificate((CertificateEntry("finite", np.inf, "-", 0.0),))
    nodes = trajectory.states[:, 1:].reshape(-1, 12).T
    mechanics = mechanics_at(walker, gait.spring, nodes[:6], nodes[6:])
    forces = trajectory.forces.reshape(-1, 4).T
    error = largest(interval_errors(walker, gait.spring, trajectory))
    shortfall = request.speed - gait.step_length / trajectory.step_time
    entries = [
        *collocation_entries(walker, trajectory, mechanics),
        CertificateEntry("interval_replay", error, "m, rad", _TOLERANCE),
        *jump_entries(walker, gait, _state_before(walker, request, gait)),
        CertificateEntry("speed", largest(np.maximum(shortfall, 0.0)), "m/s", _TOLERANCE),
        CertificateEntry("landing", _landing_error(walker, request, gait), "m", _TOLERANCE),
        *tread_entries(walker, request, gait.step_length),
        *landing_speed_entries(walker, mechanics),
        *stance_load_entries(walker, along_and_normal(walker, forces)[1::2]),
        *contact_entries(walker, request.step_length, mechanics, forces),
        *bound_entries(walker, request.step_length, trajectory),
        *spring_entries(walker, request.spring_mode, gait.spring),
    ]
    return Certificate(tuple(entries))


def largest(values: FloatArray) -> float:
    """Return the largest magnitude; not a number if any value is not."""
    return float(np.abs(values).max())


def collocation_entries(
    walker: WalkerParameters, trajectory: RefinedTrajectory, mechanics: Mechanics
) -> list[CertificateEntry]:
    """Return the defects of states and momenta at the nodes, per unit of time."""
    rates = np.einsum("ij,njs->nis", DIFFERENTIATION, trajectory.states) / trajectory.lengths[:, None, None]
    flat = rates.reshape(-1, 12).T
    torques, forces = trajectory.torques.reshape(-1, 3).T, trajectory.forces.reshape(-1, 4).T
    velocity_defect = flat[:6] - mechanics.qdot
    force_defect = flat[6:] - mechanics.momentum_rate(torques, forces)
    return [
        CertificateEntry("kinematics", largest(velocity_defect), "m/s, rad/s", _TOLERANCE),
        CertificateEntry("dynamics", largest(force_defect), "N, N m", RELATIVE_TOLERANCE * walker.weight),
    ]


def _state_before(walker: WalkerParameters, request: GaitRequest, gait: RefinedGait) -> FloatArray:
    """Return the last state (12,) as the next step sees it: legs relabelled, foot 2 at the origin."""
    before: FloatArray = gait.trajectory.states[-1, -1][[*RELABELLED, *(6 + row for row in RELABELLED)]]
    before[0] -= gait.step_length
    before[1] -= walker.terrain.height(gait.step_length, request.step_length)
    return before


def jump_entries(walker: WalkerParameters, gait: RefinedGait, before: FloatArray) -> list[CertificateEntry]:
    """Return what the impacts leave over between the intervals, `before` being the state before the step."""
    trajectory = gait.trajectory
    ends = np.concatenate([before[None], trajectory.states[:-1, -1]]).T
    starts = trajectory.states[:, 0].T
    mechanics = mechanics_at(walker, gait.spring, starts[:6], starts[6:])
    impulse = mechanics.generalized(trajectory.impulses.T)
    tolerance = RELATIVE_TOLERANCE * walker.total_mass
    return [
        CertificateEntry("continuity", largest(starts[:6] - ends[:6]), "m, rad", _TOLERANCE),
        CertificateEntry("impact", largest(starts[6:] - ends[6:] - impulse), "N s, N m s", tolerance),
        CertificateEntry("impact_cone", _cone_excess(walker, trajectory.impulses.T), "N s", tolerance),
    ]


def _cone_excess(walker: WalkerParameters, forces: FloatArray) -> float:
    """Return how far forces or impulses (4, N) reach beyond their friction cones or pull."""
    components = along_and_normal(walker, forces)
    tangential, normal = components[[0, 2]], components[[1, 3]]
    excess = np.abs(tangential) - walker.friction_coefficient * normal
    return float(np.maximum(0.0, np.maximum(excess, -normal)).max())


def _landing_error(walker: WalkerParameters, request: GaitRequest, gait: RefinedGait) -> float:
    """Return how far foot 2 lands from one step length ahead, or from the ground."""
    end = gait.trajectory.states[-1, -1][:6, None]
    ground = walker.terrain.height(gait.step_length, request.step_length)
    return largest(foot_arm(walker, end, 1).position[:, 0] - np.array([gait.step_length, ground]))


def contact_entries(
    walker: WalkerParameters, tread: float, mechanics: Mechanics, forces: FloatArray
) -> list[CertificateEntry]:
    """Return what the feet do at the nodes: those under load stand or slip, none is below the ground."""
    gaps = np.array([walker.terrain.gap(foot.position, tread) for foot in mechanics.feet])
    loaded = np.array([forces[:2].any(axis=0), forces[2:].any(axis=0)])
    velocities = (walker.terrain.along_and_normal(mechanics.foot_velocity(leg)) for leg in range(2))
    along, normal = np.abs(np.array(list(velocities))).transpose(1, 0, 2)
    slips = loaded & _slipping(along)
    speeds = np.where(slips, normal, np.maximum(along, normal))
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    return [
        *_slip_entries(walker, mechanics, forces, slips),
        CertificateEntry("stance_velocity", largest(np.where(loaded, speeds, 0.0)), "m/s", _TOLERANCE),
        CertificateEntry("stance_height", largest(np.where(loaded, gaps, 0.0)), "m", _TOLERANCE),
        CertificateEntry("penetration", largest(np.minimum(gaps, 0.0)), "m", _TOLERANCE),
        CertificateEntry("friction_cone", _cone_excess(walker, forces), "N", force_tolerance),
    ]


def _slipping(speeds: FloatArray) -> NDArray[np.bool_]:
    """Return at which nodes a foot that carries load slips: those of intervals in which it ever moves.

    Args:
        speeds: Magnitudes of the tangential velocities of both feet in [m/s], (2, 3 n).
    """
    fastest = speeds.reshape(2, -1, STAGES).max(axis=2)
    return np.repeat(fastest > HELD_SPEED, STAGES, axis=1)


def _slip_entries(
    walker: WalkerParameters, mechanics: Mechanics, forces: FloatArray, slips: NDArray[np.bool_]
) -> list[CertificateEntry]:
    """Return how far friction is from all that the cone allows, against the slip; nothing without slip."""
    if not slips.any():
        return []
    components = along_and_normal(walker, forces)
    velocities = (walker.terrain.along_and_normal(mechanics.foot_velocity(leg)) for leg in range(2))
    along = np.array([velocity[0] for velocity in velocities])
    friction = -np.sign(along) * walker.friction_coefficient * components[[1, 3]]
    defect = np.where(slips, (components[[0, 2]] - friction) * along, 0.0)
    return [CertificateEntry("slip_friction", largest(defect), "W", RELATIVE_TOLERANCE * walker.weight)]


def bound_entries(
    walker: WalkerParameters, tread: float, trajectory: RefinedTrajectory
) -> list[CertificateEntry]:
    """Return violations of joint limits and forward momentum at the nodes, and of what may lie between."""
    nodes = trajectory.states[:, 1:].reshape(-1, 12).T
    angle = largest(_angle_excess(walker, nodes))
    angles_between, dips_between = excess_between(walker, tread, trajectory)
    tolerance = RELATIVE_TOLERANCE * walker.total_mass
    return [
        CertificateEntry("joint_limits", angle, "rad", _TOLERANCE),
        CertificateEntry("joint_limits_between", largest(angles_between), "rad", BETWEEN_TOLERANCE),
        CertificateEntry("penetration_between", largest(dips_between), "m", BETWEEN_TOLERANCE),
        CertificateEntry("forward_momentum", largest(np.minimum(nodes[6], 0.0)), "kg m/s", tolerance),
    ]


def excess_between(
    walker: WalkerParameters, step_length: float, trajectory: RefinedTrajectory
) -> tuple[FloatArray, FloatArray]:
    """Return how far each interval's polynomials leave the joint limits [rad] and the air [m], (n,) each.

    Args:
        walker: The walker.
        step_length: Of the request, in [m].
        trajectory: The refined step.
    """
    between = trajectory.states_at(_PLACES_BETWEEN).reshape(-1, 12).T
    feet = (foot_arm(walker, between[:6], leg).position for leg in range(2))
    dips = np.array([-walker.terrain.gap(foot, step_length) for foot in feet]).max(axis=0)
    shape = (trajectory.intervals, _PLACES_BETWEEN.size)
    angles = _angle_excess(walker, between).reshape(shape).max(axis=1)
    return angles, np.maximum(0.0, dips).reshape(shape).max(axis=1)


def _angle_excess(walker: WalkerParameters, states: FloatArray) -> FloatArray:
    """Return how far hips and knees are beyond their limits in [rad], (N,), states being (12, N)."""
    hips, knees = states[[2, 4]], states[[3, 5]]
    excess = np.concatenate([np.abs(hips) - walker.hip_angle_limit, -knees, knees - np.pi])
    largest: FloatArray = np.maximum(0.0, excess.max(axis=0))
    return largest
