"""Residuals of states that are no gait, against an independent rigid-body library; units and tolerances."""

import math

import numpy as np
import pytest
from model.pinocchio_walker import PinocchioWalker

from walk_optimizer.certificate.grid import certify, landing_distance
from walk_optimizer.gait import Certificate, CertificateEntry, Trajectory
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest

WALKER = WalkerParameters(upper_leg_length=0.45, lower_leg_length=0.4, lower_leg_mass=5.0)
SPRING = KneeSpring(60.0, 2.9)
REQUEST = GaitRequest(0.3, 0.75, SpringMode.STIFFNESS_AND_EQUILIBRIUM, 8)
RELABELLED = [0, 1, 4, 5, 2, 3]


def made_up(seed):
    """Points, (23, 8), that meet no constraint at all."""
    generator = np.random.default_rng(seed)
    unit = np.repeat([1.0, 30.0, 20.0, 400.0, 1.0], [6, 6, 3, 6, 2])
    return generator.normal(size=(23, 8)) * unit[:, None]


def residuals(points):
    trajectory = Trajectory.from_stacked(points, REQUEST.step_time)
    certificate = certify(WALKER, REQUEST, SPRING, trajectory)
    return {entry.family: entry.violation for entry in certificate.entries}


def defects(points):
    """Defects of implicit Euler by the library: velocities and forces, (N, 6) each."""
    other, interval = PinocchioWalker(WALKER, SPRING), REQUEST.interval
    last = points[:, -1]
    before_q, before_p = last[RELABELLED], last[6:12][RELABELLED]
    before_q = before_q - np.array([other.feet(last[:6])[0, 1], 0, 0, 0, 0, 0])
    velocities, forces = [], []
    for point in points.T:
        q, p, u, reaction = np.split(point, [6, 12, 15, 21])[:4]
        qdot = np.linalg.solve(other.mass_matrix(q), p)
        net = np.array([[foot[0] - foot[1], foot[2]] for foot in reaction.reshape(2, 3)])
        rate = other.force(q, qdot) + np.array([0, 0, u[0], u[1], -u[0], u[2]])
        rate += np.einsum("fai,fa->i", other.foot_jacobians(q), net)
        velocities.append((q - before_q) / interval - qdot)
        forces.append((p - before_p) / interval - rate)
        before_q, before_p = q, p
    return np.abs(velocities), np.abs(forces)


@pytest.mark.parametrize("seed", range(4))
def test_dynamics_are_those_of_the_library(seed):
    points = made_up(seed)
    found, (velocities, forces) = residuals(points), defects(points)
    assert found["kinematics"] == pytest.approx(velocities[1:].max(), rel=1e-10)
    assert found["dynamics"] == pytest.approx(forces[1:].max(), rel=1e-10)
    assert found["periodicity_velocity"] == pytest.approx(velocities[0].max(), rel=1e-10)
    assert found["periodicity_force"] == pytest.approx(forces[0].max(), rel=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_contact_is_that_of_the_library(seed):
    points, other = made_up(seed), PinocchioWalker(WALKER)
    expected = dict.fromkeys(("gap", "cone", "slack", "normal", "friction", "forward", "backward"), 0.0)
    for point in points.T:
        q, p, reaction, gammas = point[:6], point[6:12], point[15:21].reshape(2, 3), point[21:]
        slips = other.foot_jacobians(q)[:, 0] @ np.linalg.solve(other.mass_matrix(q), p)
        for foot in range(2):
            gap, (forward, backward, normal) = other.feet(q)[1, foot], reaction[foot]
            cone = WALKER.friction_coefficient * normal - forward - backward
            gamma, slip = gammas[foot], slips[foot]
            for name, value in {
                "gap": -gap,
                "cone": -cone,
                "slack": abs(slip) - gamma,
                "normal": abs(gap * normal),
                "friction": abs(cone * gamma),
                "forward": abs((gamma + slip) * forward),
                "backward": abs((gamma - slip) * backward),
            }.items():
                expected[name] = max(expected[name], value)
    found, names = residuals(points), ("normal", "friction", "forward_slip", "backward_slip")
    products = [found[f"{name}_complementarity"] for name in names]
    assert products == pytest.approx([expected[n] for n in ("normal", "friction", "forward", "backward")])
    sides = [found[name] for name in ("penetration", "friction_cone", "slip_slack")]
    assert sides == pytest.approx([expected[name] for name in ("gap", "cone", "slack")])


def test_the_step_is_as_long_as_where_foot_2_lands():
    points = made_up(9)
    trajectory = Trajectory.from_stacked(points, REQUEST.step_time)
    landing = PinocchioWalker(WALKER).feet(points[:6, -1])[0, 1]
    assert landing_distance(WALKER, trajectory) == pytest.approx(landing)
    speed = residuals(points)["speed"]
    assert speed == pytest.approx(max(0.0, REQUEST.speed - landing / REQUEST.step_time))


def test_bounds():
    points = np.tile(np.array([0, 1, 0, 3, 0, 3] + [0.0] * 17)[:, None], 8)
    assert all(
        residuals(points)[name] == 0 for name in ("joint_limits", "unilateral_force", "slip_speed_sign")
    )
    for family, row, value, expected in (
        ("joint_limits", 2, math.pi / 2 + 0.1, 0.1),
        ("joint_limits", 4, -math.pi / 2 - 0.1, 0.1),
        ("joint_limits", 3, math.pi + 0.1, 0.1),
        ("joint_limits", 5, -0.1, 0.1),
        ("forward_momentum", 6, -3.0, 3.0),
        ("unilateral_force", 15, -4.0, 4.0),
        ("unilateral_force", 20, -4.0, 4.0),
        ("slip_speed_sign", 22, -0.2, 0.2),
    ):
        broken = points.copy()
        broken[row, 5] = value
        assert residuals(broken)[family] == pytest.approx(expected), (family, row)


def test_units_and_tolerances_of_the_families():
    trajectory = Trajectory.from_stacked(made_up(0), REQUEST.step_time)
    entries = {entry.family: entry for entry in certify(WALKER, REQUEST, SPRING, trajectory).entries}
    weight = 1e-6 * WALKER.weight
    for family, unit, tolerance in (
        ("kinematics", "m/s, rad/s", 1e-6),
        ("dynamics", "N, N m", weight),
        ("periodicity_force", "N, N m", weight),
        ("speed", "m/s", 1e-6),
        ("stiffness_limits", "N m/rad", 1e-6 * WALKER.stiffness_limit),
        ("equilibrium_limits", "rad", 1e-6),
        ("friction_cone", "N", weight),
        ("penetration", "m", 1e-6),
        ("normal_complementarity", "N m", weight),
        ("friction_complementarity", "W", weight),
        ("forward_slip_complementarity", "W", weight),
        ("backward_slip_complementarity", "W", weight),
    ):
        assert entries[family].unit == unit
        assert entries[family].tolerance == pytest.approx(tolerance)


def test_an_empty_certificate_certifies_nothing_and_the_worst_is_named():
    assert not Certificate(()).certified
    good, bad = CertificateEntry("speed", 0.0, "m/s", 1e-6), CertificateEntry("dynamics", 2.5, "N", 7e-4)
    unknown = CertificateEntry("kinematics", math.nan, "m/s", 1e-6)
    assert Certificate((good,)).certified
    assert Certificate((good, bad)).worst is bad
    assert Certificate((good, bad, unknown)).worst is unknown
    assert Certificate((good, bad, unknown)).failures() == (bad, unknown)
    assert str(bad) == "dynamics is off by 2.5 N, allowed is 0.0007"
