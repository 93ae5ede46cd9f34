"""Residuals of a gait in plain NumPy, apart from the solver and from its symbolic model."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Certificate, CertificateEntry, Trajectory
from walk_optimizer.model.kinematics import RELABELLED
from walk_optimizer.model.mechanics import Mechanics, foot_2_ahead, horizontal_and_vertical, mechanics_at
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription.phases import INSTANT_POINTS

FloatArray = NDArray[np.float64]

# Tolerances are this fraction of body weight (times 1 m or 1 m/s for products), or of 1 m.
RELATIVE_TOLERANCE = 1e-6
_PENETRATION_TOLERANCE = 1e-6
_KINEMATIC_TOLERANCE = 1e-6
_BOUND_TOLERANCE = 1e-6


def _relabelled(trajectory: Trajectory, step: FloatArray) -> FloatArray:
    """Return the state (12,) before point 1 of a periodic walk: point N with the legs exchanged.

    Args:
        trajectory: One step.
        step: Length and rise of the step in [m], (2,).
    """
    q, p = trajectory.q[list(RELABELLED), -1], trajectory.p[list(RELABELLED), -1]
    return np.concatenate([q[:2] - step, q[2:], p])


def landing_distance(walker: WalkerParameters, trajectory: Trajectory) -> float:
    """Return the step length in [m]: where foot 2 lands, foot 1 having stood at the origin."""
    return foot_2_ahead(walker, trajectory.q[:, -1])


def _dynamics_defects(
    walker: WalkerParameters,
    mechanics: Mechanics,
    trajectory: Trajectory,
    interval: float,
    before: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the defects of implicit Euler per unit of time: velocities (6, N) and forces (6, N).

    Args:
        walker: The walker.
        mechanics: Its mechanics at the points.
        trajectory: The motion.
        interval: Time step h in [s].
        before: The state before point 1, (12,).
    """
    states = np.vstack([trajectory.q, trajectory.p])
    rates = np.diff(states, axis=1, prepend=before[:, None]) / interval
    reaction = horizontal_and_vertical(walker, trajectory.net_reaction())
    return rates[:6] - mechanics.qdot, rates[6:] - mechanics.momentum_rate(trajectory.u, reaction)


def _contact_entries(
    walker: WalkerParameters, mechanics: Mechanics, trajectory: Trajectory, tread: float
) -> list[CertificateEntry]:
    """Return penetration, friction cone and the complementarity products of eqs. (5a) to (5d)."""
    products: dict[str, list[FloatArray]] = {}
    depths, excesses, slacks = [], [], []
    for leg, arm in enumerate(mechanics.feet):
        forward, backward, normal = trajectory.reaction[3 * leg : 3 * leg + 3]
        gamma = trajectory.slip_speed[leg]
        gap = walker.terrain.gap(arm.position, tread)
        slip = walker.terrain.along_and_normal(mechanics.foot_velocity(leg))[0]
        cone = walker.friction_coefficient * normal - forward - backward
        for name, product in {
            "normal_complementarity": gap * normal,
            "friction_complementarity": cone * gamma,
            "forward_slip_complementarity": (gamma + slip) * forward,
            "backward_slip_complementarity": (gamma - slip) * backward,
        }.items():
            products.setdefault(name, []).append(np.abs(product))
        depths.append(-gap)
        excesses.append(-cone)
        slacks.append(np.abs(slip) - gamma)
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    units = dict.fromkeys(products, "W")
    units["normal_complementarity"] = "N m"
    return [
        CertificateEntry("penetration", _excess(*depths), "m", _PENETRATION_TOLERANCE),
        CertificateEntry("friction_cone", _excess(*excesses), "N", force_tolerance),
        CertificateEntry("slip_slack", _excess(*slacks), "m/s", _KINEMATIC_TOLERANCE),
        *(
            CertificateEntry(name, _excess(*values), units[name], force_tolerance)
            for name, values in products.items()
        ),
    ]


def _bound_entries(walker: WalkerParameters, trajectory: Trajectory) -> list[CertificateEntry]:
    """Return the violations of the bounds on angles, forces, slip speeds and forward momentum."""
    hips, knees = trajectory.q[[2, 4]], trajectory.q[[3, 5]]
    angle = _excess(np.abs(hips) - walker.hip_angle_limit, -knees, knees - np.pi)
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    momentum_tolerance = RELATIVE_TOLERANCE * walker.total_mass
    return [
        CertificateEntry("joint_limits", angle, "rad", _BOUND_TOLERANCE),
        CertificateEntry("unilateral_force", _excess(-trajectory.reaction), "N", force_tolerance),
        CertificateEntry("slip_speed_sign", _excess(-trajectory.slip_speed), "m/s", _BOUND_TOLERANCE),
        CertificateEntry("forward_momentum", _excess(-trajectory.p[0]), "kg m/s", momentum_tolerance),
    ]


def spring_entries(walker: WalkerParameters, mode: SpringMode, spring: KneeSpring) -> list[CertificateEntry]:
    """Return how far K and q_eq are from what their spring mode allows."""
    largest = 0.0 if mode is SpringMode.NONE else walker.stiffness_limit
    smallest_angle = 0.0 if mode is SpringMode.STIFFNESS_AND_EQUILIBRIUM else np.pi
    stiffness = np.max([0.0, -spring.stiffness, spring.stiffness - largest])
    equilibrium = np.max([0.0, smallest_angle - spring.equilibrium, spring.equilibrium - np.pi])
    return [
        CertificateEntry(
            "stiffness_limits", float(stiffness), "N m/rad", _BOUND_TOLERANCE * walker.stiffness_limit
        ),
        CertificateEntry("equilibrium_limits", float(equilibrium), "rad", _BOUND_TOLERANCE),
    ]


def tread_entries(
    walker: WalkerParameters, request: GaitRequest, step_length: float
) -> list[CertificateEntry]:
    """Return how far from the middle of a tread the foot lands; nothing where there are no stairs."""
    if not walker.terrain.step_up:
        return []
    return [CertificateEntry("tread", abs(step_length - request.step_length), "m", _KINEMATIC_TOLERANCE)]


def landing_speed_entries(walker: WalkerParameters, mechanics: Mechanics) -> list[CertificateEntry]:
    """Return how much too slowly foot 2 comes down as the step ends; nothing where no speed is asked for.

    Args:
        walker: The walker.
        mechanics: Its mechanics at points of the step, the last one where the step ends.
    """
    if not walker.landing_speed:
        return []
    normal = walker.terrain.along_and_normal(mechanics.foot_velocity(1)[:, -1])[1]
    shortfall = _excess(walker.landing_speed + normal)
    return [CertificateEntry("landing_speed", shortfall, "m/s", _KINEMATIC_TOLERANCE)]


def stance_load_entries(walker: WalkerParameters, normal: FloatArray) -> list[CertificateEntry]:
    """Return by how much a foot that stands alone carries too little; nothing where no load is asked for.

    Args:
        walker: The walker.
        normal: Normal forces on both feet in [N], (2, N).
    """
    if not walker.stance_load:
        return []
    alone = (normal > 0).sum(axis=0) < 2
    shortfall = _excess(alone * (walker.stance_load * walker.weight - normal.max(axis=0)))
    return [CertificateEntry("stance_load", shortfall, "N", RELATIVE_TOLERANCE * walker.weight)]


def certify(
    walker: WalkerParameters, request: GaitRequest, spring: KneeSpring, trajectory: Trajectory
) -> Certificate:
    """Return the residuals of a gait on the implicit Euler grid.

    Periodicity is part of the dynamics: the state before point 1 is the relabelled point N, so its
    defect is that of the first interval, and is given as a family of its own. The duration of the
    step is the request's: the family `speed` is short exactly if the step is.

    Args:
        walker: The walker.
        request: Speed, step and grid that the gait has to meet.
        spring: Its knee springs.
        trajectory: One step.
    """
    mechanics = mechanics_at(walker, spring, trajectory.q, trajectory.p)
    step_length = landing_distance(walker, trajectory)
    step = np.array([step_length, walker.terrain.height(step_length, request.step_length)])
    before = _relabelled(trajectory, step)
    velocities, forces = _dynamics_defects(walker, mechanics, trajectory, request.interval, before)
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    shortfall = request.speed - step_length / request.step_time
    motion, load = "m/s, rad/s", "N, N m"
    entries = [
        CertificateEntry("kinematics", _excess(np.abs(velocities[:, 1:])), motion, _KINEMATIC_TOLERANCE),
        CertificateEntry("dynamics", _excess(np.abs(forces[:, 1:])), load, force_tolerance),
        CertificateEntry(
            "periodicity_velocity", _excess(np.abs(velocities[:, :1])), motion, _KINEMATIC_TOLERANCE
        ),
        CertificateEntry("periodicity_force", _excess(np.abs(forces[:, :1])), load, force_tolerance),
        CertificateEntry("speed", _excess(shortfall), "m/s", _KINEMATIC_TOLERANCE),
        *tread_entries(walker, request, step_length),
        *landing_speed_entries(walker, mechanics),
        # The first points hold the impact.
        *stance_load_entries(walker, trajectory.reaction[[2, 5], INSTANT_POINTS:]),
        *_contact_entries(walker, mechanics, trajectory, request.step_length),
        *_bound_entries(walker, trajectory),
        *spring_entries(walker, request.spring_mode, spring),
    ]
    return Certificate(tuple(entries))


def certify_from(walker: WalkerParameters, start: FloatArray, trajectory: Trajectory) -> Certificate:
    """Return the residuals of a motion on level ground, without springs, that begins in a given state.

    Args:
        walker: The walker.
        start: The state before point 1, (12,).
        trajectory: The motion on an even implicit Euler grid.
    """
    mechanics = mechanics_at(walker, KneeSpring(), trajectory.q, trajectory.p)
    interval = float(trajectory.time[0])
    velocities, forces = _dynamics_defects(walker, mechanics, trajectory, interval, start)
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    entries = [
        CertificateEntry("kinematics", _excess(np.abs(velocities)), "m/s, rad/s", _KINEMATIC_TOLERANCE),
        CertificateEntry("dynamics", _excess(np.abs(forces)), "N, N m", force_tolerance),
        *_contact_entries(walker, mechanics, trajectory, 1.0),
        *_bound_entries(walker, trajectory),
    ]
    return Certificate(tuple(entries))


def _excess(*values: FloatArray | float) -> float:
    """Return the largest of all values and 0; not a number if any value is not."""
    # Adding 0.0 keeps a negative zero from being printed as such.
    return float(np.max([0.0, *(np.max(value) for value in values)])) + 0.0
