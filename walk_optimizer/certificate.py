"""Residuals of a gait in plain NumPy, apart from the solver and from its symbolic model.

The mechanics are written here once more on purpose, from the sums over point masses instead of
from generated code: what checks the optimiser must not share its mistakes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Certificate, CertificateEntry, Trajectory
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest

FloatArray = NDArray[np.float64]

# Tolerances are this fraction of body weight (times 1 m or 1 m/s for products), or of 1 m.
RELATIVE_TOLERANCE = 1e-6
_PENETRATION_TOLERANCE = 1e-6
_KINEMATIC_TOLERANCE = 1e-6
_BOUND_TOLERANCE = 1e-6
_RELABELLED = (0, 1, 4, 5, 2, 3)


@dataclass(frozen=True, eq=False)
class _Arm:
    """A chain of straight pieces from the hip to a point: its position and derivatives.

    A piece of length l in the direction of angle a, a linear in q with slope s (6,), ends at
    l (sin a, -cos a): first derivative l (cos a, sin a) s, second l (-sin a, cos a) s s'.

    Attributes:
        position: (2, N).
        jacobian: (N, 2, 6).
        hessian: (N, 2, 6, 6).
    """

    position: FloatArray
    jacobian: FloatArray
    hessian: FloatArray


def _arm(q: FloatArray, pieces: list[tuple[float, FloatArray, FloatArray]]) -> _Arm:
    """Return the chain of (length, angle (N,), slope (6,)) from the hip, q being (6, N)."""
    count = q.shape[1]
    position = q[:2].copy()
    jacobian, hessian = np.zeros((count, 2, 6)), np.zeros((count, 2, 6, 6))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
    for length, angle, slope in pieces:
        along, across = np.array([np.sin(angle), -np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])
        position += length * along
        jacobian += length * across.T[:, :, None] * slope
        hessian += -length * along.T[:, :, None, None] * np.outer(slope, slope)
    return _Arm(position, jacobian, hessian)


def _leg(walker: WalkerParameters, q: FloatArray, leg: int) -> tuple[_Arm, _Arm, _Arm]:
    """Return upper-leg mass, lower-leg mass and foot of a leg."""
    upper_row, knee_row = 2 + 2 * leg, 3 + 2 * leg
    upper_slope, lower_slope = np.zeros(6), np.zeros(6)
    upper_slope[upper_row] = lower_slope[upper_row] = lower_slope[knee_row] = 1.0
    upper, lower = q[upper_row], q[upper_row] + q[knee_row] - np.pi
    thigh, shank = walker.upper_leg_length, walker.lower_leg_length
    return (
        _arm(q, [(thigh / 2, upper, upper_slope)]),
        _arm(q, [(thigh, upper, upper_slope), (shank / 2, lower, lower_slope)]),
        _arm(q, [(thigh, upper, upper_slope), (shank, lower, lower_slope)]),
    )


@dataclass(frozen=True, eq=False)
class _Mechanics:
    """Velocities, forces and feet at N states, from the sums over the point masses."""

    qdot: FloatArray
    force: FloatArray
    feet: tuple[_Arm, _Arm]


def _mechanics(walker: WalkerParameters, spring: KneeSpring, q: FloatArray, p: FloatArray) -> _Mechanics:
    """Evaluate qdot = M^-1 p and -dH/dq, both (6, N)."""
    legs = [_leg(walker, q, leg) for leg in range(2)]
    masses = [(walker.hip_mass, _arm(q, []))]
    for upper, lower, _ in legs:
        masses += [(walker.upper_leg_mass, upper), (walker.lower_leg_mass, lower)]
    matrix = sum(mass * np.einsum("nai,naj->nij", arm.jacobian, arm.jacobian) for mass, arm in masses)
    qdot = np.linalg.solve(matrix, p.T[:, :, None])[:, :, 0]
    force = np.zeros_like(qdot)
    for mass, arm in masses:
        point_velocity = np.einsum("nai,ni->na", arm.jacobian, qdot)
        force += mass * np.einsum("na,naij,nj->ni", point_velocity, arm.hessian, qdot)
        force -= mass * walker.gravity * arm.jacobian[:, 1]
    for knee in (3, 5):
        force[:, knee] -= spring.stiffness * (q[knee] - spring.equilibrium)
    return _Mechanics(qdot.T, force.T, (legs[0][2], legs[1][2]))


def _state_before(q: FloatArray, p: FloatArray, step_length: float) -> tuple[FloatArray, FloatArray]:
    """Return coordinates and momenta at the points before each, the first relabelled from the last."""
    first_q, first_p = q[list(_RELABELLED), -1], p[list(_RELABELLED), -1]
    first_q[0] -= step_length
    return np.column_stack([first_q, q[:, :-1]]), np.column_stack([first_p, p[:, :-1]])


def landing_distance(walker: WalkerParameters, trajectory: Trajectory) -> float:
    """Return the step length in [m]: where foot 2 lands, foot 1 having stood at the origin."""
    return float(_leg(walker, trajectory.q[:, -1:], 1)[2].position[0, 0])


def _dynamics_defects(
    mechanics: _Mechanics, trajectory: Trajectory, interval: float, step_length: float
) -> tuple[FloatArray, FloatArray]:
    """Return the defects of implicit Euler per unit of time: velocities (6, N) and forces (6, N)."""
    q_before, p_before = _state_before(trajectory.q, trajectory.p, step_length)
    rate = mechanics.force.copy()
    u, reaction = trajectory.u, trajectory.reaction
    rate[2] += u[0]
    rate[4] -= u[0]
    rate[3] += u[1]
    rate[5] += u[2]
    for leg, foot in enumerate(mechanics.feet):
        force = np.array([reaction[3 * leg] - reaction[3 * leg + 1], reaction[3 * leg + 2]])
        rate += np.einsum("nai,an->in", foot.jacobian, force)
    return (trajectory.q - q_before) / interval - mechanics.qdot, (trajectory.p - p_before) / interval - rate


def _contact_entries(
    walker: WalkerParameters, mechanics: _Mechanics, trajectory: Trajectory
) -> list[CertificateEntry]:
    """Return penetration, friction cone and the complementarity products of eqs. (5a) to (5d)."""
    products: dict[str, float] = {}
    penetration, cone_excess, slack = 0.0, 0.0, 0.0
    for leg, foot in enumerate(mechanics.feet):
        forward, backward, normal = trajectory.reaction[3 * leg : 3 * leg + 3]
        gamma = trajectory.slip_speed[leg]
        gap = foot.position[1]
        slip = np.einsum("ni,in->n", foot.jacobian[:, 0], mechanics.qdot)
        cone = walker.friction_coefficient * normal - forward - backward
        for name, product in {
            "normal_complementarity": gap * normal,
            "friction_complementarity": cone * gamma,
            "forward_slip_complementarity": (gamma + slip) * forward,
            "backward_slip_complementarity": (gamma - slip) * backward,
        }.items():
            products[name] = max(products.get(name, 0.0), float(np.abs(product).max()))
        penetration = max(penetration, float(-gap.min()))
        cone_excess = max(cone_excess, float(-cone.min()))
        slack = max(slack, float(np.max(np.abs(slip) - gamma)))
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    units = dict.fromkeys(products, "W")
    units["normal_complementarity"] = "N m"
    units["friction_complementarity"] = "W"
    return [
        CertificateEntry("penetration", penetration, "m", _PENETRATION_TOLERANCE),
        CertificateEntry("friction_cone", cone_excess, "N", force_tolerance),
        CertificateEntry("slip_slack", slack, "m/s", _KINEMATIC_TOLERANCE),
        *(CertificateEntry(name, value, units[name], force_tolerance) for name, value in products.items()),
    ]


def _bound_entries(walker: WalkerParameters, trajectory: Trajectory) -> list[CertificateEntry]:
    """Return the violations of the bounds on angles, forces, slip speeds and forward momentum."""
    hips, knees = trajectory.q[[2, 4]], trajectory.q[[3, 5]]
    angle = max(
        0.0,
        float(np.abs(hips).max() - walker.hip_angle_limit),
        float(-knees.min()),
        float(knees.max() - np.pi),
    )
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    momentum_tolerance = RELATIVE_TOLERANCE * walker.total_mass
    return [
        CertificateEntry("joint_limits", angle, "rad", _BOUND_TOLERANCE),
        CertificateEntry(
            "unilateral_force", max(0.0, float(-trajectory.reaction.min())), "N", force_tolerance
        ),
        CertificateEntry(
            "slip_speed_sign", max(0.0, float(-trajectory.slip_speed.min())), "m/s", _BOUND_TOLERANCE
        ),
        CertificateEntry(
            "forward_momentum", max(0.0, float(-trajectory.p[0].min())), "kg m/s", momentum_tolerance
        ),
    ]


def _spring_entry(walker: WalkerParameters, spring: KneeSpring) -> CertificateEntry:
    """Return the violation of the bounds on K, relative to its limit, and on q_eq in [rad]."""
    stiffness = max(-spring.stiffness, spring.stiffness - walker.stiffness_limit) / walker.stiffness_limit
    equilibrium = max(-spring.equilibrium, spring.equilibrium - np.pi)
    return CertificateEntry("spring_limits", max(0.0, stiffness, equilibrium), "-", _BOUND_TOLERANCE)


def certify(
    walker: WalkerParameters, request: GaitRequest, spring: KneeSpring, trajectory: Trajectory
) -> Certificate:
    """Return the residuals of a gait on the implicit Euler grid.

    Periodicity is part of the dynamics: the state before point 1 is the relabelled point N, so its
    defect is that of the first interval, and is given as a family of its own.

    Args:
        walker: The walker.
        request: Speed, step and grid that the gait has to meet.
        spring: Its knee springs.
        trajectory: One step.
    """
    mechanics = _mechanics(walker, spring, trajectory.q, trajectory.p)
    step_length = landing_distance(walker, trajectory)
    velocities, forces = _dynamics_defects(mechanics, trajectory, request.interval, step_length)
    force_tolerance = RELATIVE_TOLERANCE * walker.weight
    shortfall = request.speed - step_length / request.step_time
    entries = [
        CertificateEntry("kinematics", _largest(velocities[:, 1:]), "m/s", _KINEMATIC_TOLERANCE),
        CertificateEntry("dynamics", _largest(forces[:, 1:]), "N", force_tolerance),
        CertificateEntry("periodicity_velocity", _largest(velocities[:, :1]), "m/s", _KINEMATIC_TOLERANCE),
        CertificateEntry("periodicity_force", _largest(forces[:, :1]), "N", force_tolerance),
        CertificateEntry("speed", max(0.0, shortfall), "m/s", _KINEMATIC_TOLERANCE),
        *_contact_entries(walker, mechanics, trajectory),
        *_bound_entries(walker, trajectory),
        _spring_entry(walker, spring),
    ]
    return Certificate(tuple(entries))


def _largest(values: FloatArray) -> float:
    """Return the largest magnitude; not a number if any value is not."""
    return float(np.abs(values).max())
