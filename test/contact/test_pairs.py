"""The pairs of report eq. (5) at states made by hand, for every behaviour of a foot."""

import casadi as ca
import numpy as np
import pytest

from walk_optimizer.contact.feet import contact_pairs, net_force, reaction_cones
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker

WALKER = WalkerParameters(friction_coefficient=0.5)
# Foot 1 right below the hip on stretched legs, foot 2 with its lower leg held level behind the knee.
STANDING = np.array([0.0, 1.0, 0.0, np.pi, 0.0, np.pi / 2])
GAP, CONE, FORWARD_SLIP, BACKWARD_SLIP = range(4)


def pairs_function():
    walker = SymbolicWalker()
    q, qdot = ca.SX.sym("q", 6), ca.SX.sym("qdot", 6)
    reaction, slip = ca.SX.sym("reaction", 6), ca.SX.sym("slip", 2)
    sides = contact_pairs(walker, q, qdot, reaction, slip)
    return ca.Function("pairs", [q, qdot, reaction, slip, walker.symbols], list(sides))


PAIRS = pairs_function()


def pairs(hip_velocity, reaction, slip, q=STANDING):
    """Both sides, (2, 4) each: one row a foot, for a walker that moves along without turning."""
    qdot = np.array([hip_velocity, 0.0, 0.0, 0.0, 0.0, 0.0])
    sides = PAIRS(q, qdot, reaction, slip, WALKER.vector())
    return [np.asarray(side).reshape(2, 4) for side in sides]


def assert_met(a, b):
    assert (a >= -1e-12).all()
    assert (b >= 0).all()
    np.testing.assert_allclose(a * b, 0, atol=1e-12)


def test_a_free_foot_has_a_gap_no_force_and_may_move_either_way():
    for speed in (0.7, -0.7):
        a, b = pairs(speed, [0, 0, 0, 0, 0, 0], [0.7, 0.7])
        assert_met(a, b)
        assert a[1, GAP] == pytest.approx(0.5)
        np.testing.assert_allclose(a[1, [FORWARD_SLIP, BACKWARD_SLIP]], [0.7 + speed, 0.7 - speed])
        np.testing.assert_array_equal(b[1], [0, 0.7, 0, 0])


@pytest.mark.parametrize(("forward", "backward"), [(100, 0), (0, 100), (400, 0), (0, 400), (60, 50)])
def test_a_sticking_foot_bears_any_force_inside_the_friction_cone(forward, backward):
    a, b = pairs(0.0, [forward, backward, 800, 0, 0, 0], [0, 0])
    assert_met(a, b)
    np.testing.assert_allclose(a[0], [0, 0.5 * 800 - forward - backward, 0, 0], atol=1e-12)
    np.testing.assert_array_equal(b[0], [800, 0, forward, backward])


def test_a_foot_that_slips_forward_is_pushed_backward_by_all_of_its_friction():
    a, b = pairs(0.3, [0, 400, 800, 0, 0, 0], [0.3, 0.3])
    assert_met(a, b)
    np.testing.assert_allclose(a[0], [0, 0, 0.6, 0], atol=1e-12)
    np.testing.assert_array_equal(b[0], [800, 0.3, 0, 400])


def test_a_foot_that_slips_backward_is_pushed_forward_by_all_of_its_friction():
    a, b = pairs(-0.3, [400, 0, 800, 0, 0, 0], [0.3, 0.3])
    assert_met(a, b)
    np.testing.assert_allclose(a[0], [0, 0, 0, 0.6], atol=1e-12)
    np.testing.assert_array_equal(b[0], [800, 0.3, 400, 0])


@pytest.mark.parametrize(
    ("what", "hip_velocity", "reaction", "slip", "pair"),
    [
        ("force on a foot in the air", 0.0, [0, 0, 0, 0, 0, 10], [0, 0], (1, GAP)),
        ("slip inside the friction cone", 0.3, [0, 100, 800, 0, 0, 0], [0.3, 0.3], (0, CONE)),
        ("friction that drives the slip", 0.3, [400, 0, 800, 0, 0, 0], [0.3, 0.3], (0, FORWARD_SLIP)),
        ("friction that drives backward slip", -0.3, [0, 400, 800, 0, 0, 0], [0.3, 0.3], (0, BACKWARD_SLIP)),
    ],
)
def test_what_a_foot_cannot_do_makes_the_product_of_its_pair_positive(
    what, hip_velocity, reaction, slip, pair
):
    a, b = pairs(hip_velocity, reaction, slip)
    assert [tuple(place) for place in np.argwhere(a * b > 1e-9)] == [pair], what


@pytest.mark.parametrize(
    ("what", "hip_velocity", "reaction", "slip", "q", "pair"),
    [
        ("a foot below the ground", 0.0, [0] * 6, [0, 0], STANDING - [0, 0.1, 0, 0, 0, 0], (0, GAP)),
        ("more friction than the cone allows", 0.0, [300, 150, 800, 0, 0, 0], [0, 0], STANDING, (0, CONE)),
        ("friction without load", 0.0, [0, 0, 800, 0, 1, 0], [0, 0], STANDING, (1, CONE)),
        ("slack below forward slip", 0.3, [0, 400, 800, 0, 0, 0], [0.2, 0.3], STANDING, (0, BACKWARD_SLIP)),
        ("slack below backward slip", -0.3, [400, 0, 800, 0, 0, 0], [0.2, 0.3], STANDING, (0, FORWARD_SLIP)),
    ],
)
def test_what_a_foot_cannot_do_makes_a_side_negative(what, hip_velocity, reaction, slip, q, pair):
    a, _ = pairs(hip_velocity, reaction, slip, q)
    assert [tuple(place) for place in np.argwhere(a < -1e-9)] == [pair], what


def test_net_force_is_forward_less_backward_and_normal_of_each_foot():
    walker = SymbolicWalker()
    force = ca.substitute(
        net_force(walker, ca.SX([5, 2, 10, 1, 4, 20])), walker.symbols, ca.DM(WALKER.vector())
    )
    force = np.asarray(ca.evalf(force))
    np.testing.assert_array_equal(force, [[3, -3], [10, 20]])


def test_friction_cones_have_two_sides_for_each_net_force():
    walker, reaction = SymbolicWalker(), ca.SX.sym("reaction", 6)
    cones = ca.Function("cones", [reaction, walker.symbols], [reaction_cones(walker, reaction)])
    sides = cones([30, 80, 100, 20, 0, 800], WALKER.vector())
    np.testing.assert_array_equal(np.ravel(sides), [50 + 50, 50 - 50, 400 - 20, 400 + 20])
