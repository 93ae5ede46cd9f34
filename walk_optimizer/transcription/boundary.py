"""The ends of the chain of a step: periodic, or begun from a given state."""

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.dynamics import foot_jacobian, velocity
from walk_optimizer.model.ground import along_and_normal, ground_height
from walk_optimizer.model.kinematics import (
    HIP_X,
    HIP_Y,
    KNEE_1,
    KNEE_2,
    RELABELLED,
    UPPER_1,
    UPPER_2,
    foot_position,
)
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.scaling import point_units
from walk_optimizer.transcription.stage import Ends

FloatArray = NDArray[np.float64]

# Rows of q that hold joint angles.
JOINT_ROWS = (UPPER_1, KNEE_1, UPPER_2, KNEE_2)


def end_functions(name: str, z: ca.SX, par: ca.SX, rows: ca.SX) -> list[ca.Function]:
    """Return the functions that `Ends` describes.

    Args:
        name: Prefix of their names.
        z: The last stage's state, scaled.
        par: The model's vector and the ends' own numbers.
        rows: The state handed to the first stage, then further rows, scaled.
    """
    lam = ca.SX.sym("lam", rows.numel())
    jacobian = ca.jacobian(rows, z)
    hessian = ca.triu(ca.hessian(ca.dot(lam, rows), z)[0])
    inputs = [z, par]
    return [
        ca.Function(f"{name}_value", inputs, [rows]),
        ca.Function(f"{name}_jacobian", inputs, [rows, jacobian.nz[:]]),
        ca.Function(f"{name}_hessian", [*inputs, lam], [hessian.nz[:]]),
        ca.Function(f"{name}_jacobian_pattern", inputs, [ca.SX.ones(jacobian.sparsity())]),
        ca.Function(f"{name}_hessian_pattern", [*inputs, lam], [ca.SX.ones(hessian.sparsity())]),
    ]


def periodic_functions() -> list[ca.Function]:
    """Return the functions that join the last state of a step to its first.

    The legs change names and the hip moves back by the step length, the place where foot 2 lands, and
    by the height of the ground there, so that the stance foot of the next step stands at the origin.
    That pins the walker's place. The one further row is the step length.
    """
    walker, z = SymbolicWalker(), ca.SX.sym("z", layout.STATE_WIDTH)
    return end_functions("periodic", z, walker.symbols, _periodic_rows(walker, z))


def landing_functions() -> list[ca.Function]:
    """Return the periodic functions with one more row: the speed in [m/s] at which foot 2 comes down.

    It is the component of -J_2 qdot normal to the ground, just before the impact.
    """
    walker, z = SymbolicWalker(), ca.SX.sym("z", layout.STATE_WIDTH)
    q, p = ca.SX.sym("q", 6), ca.SX.sym("p", 6)
    foot_velocity = ca.mtimes(foot_jacobian(walker, q, 1), velocity(walker, q, p))
    towards_ground = -along_and_normal(walker, foot_velocity)[1]
    physical = z * ca.vertcat(*point_units(walker)[: layout.STATE_WIDTH])
    speed = ca.substitute(towards_ground, ca.vertcat(q, p), physical)
    rows = ca.vertcat(_periodic_rows(walker, z), speed)
    return end_functions("landing", z, walker.symbols, rows)


def _periodic_rows(walker: SymbolicWalker, z: ca.SX) -> ca.SX:
    """Return the state handed to the first stage and the step length, scaled, (13,)."""
    units = ca.vertcat(*point_units(walker)[: layout.STATE_WIDTH])
    physical = z * units
    q, p = physical[layout.Q], physical[layout.P]
    step_length = foot_position(walker, q, 1)[0]
    relabelled = q[list(RELABELLED)]
    relabelled[HIP_X] -= step_length
    relabelled[HIP_Y] -= ground_height(walker, step_length)
    state = ca.vertcat(relabelled, p[list(RELABELLED)]) / units
    return ca.vertcat(state, step_length / walker.leg_length)


def given_start_functions() -> list[ca.Function]:
    """Return the functions of steps that begin in a given state, the ends' own numbers, scaled.

    The further rows are the angles of hips and knees at the end, then their velocities, in [rad] and
    [rad/s]: with a foot on the ground they determine the whole state.
    """
    walker, z = SymbolicWalker(), ca.SX.sym("z", layout.STATE_WIDTH)
    start = ca.SX.sym("start", layout.STATE_WIDTH)
    q, p = ca.SX.sym("q", 6), ca.SX.sym("p", 6)
    joints = list(JOINT_ROWS)
    joint_state = ca.vertcat(q[joints], velocity(walker, q, p)[joints])
    physical = z * ca.vertcat(*point_units(walker)[: layout.STATE_WIDTH])
    end = ca.substitute(joint_state, ca.vertcat(q, p), physical)
    rows = ca.vertcat(start, end)
    return end_functions("given_start", z, ca.vertcat(walker.symbols, start), rows)


@cache
def periodic_ends(*, landing: bool = False) -> Ends:
    """Return the ends of a step that is repeated with the legs relabelled.

    Args:
        landing: Whether the speed at which foot 2 comes down is a row, behind the step length.
    """
    if landing:
        return Ends("landing", compiled(landing_functions))
    return Ends("periodic", compiled(periodic_functions))


def periodic_bounds(request: GaitRequest, walker: WalkerParameters) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the further rows of a step's periodic ends.

    The step length is in leg lengths; on stairs a step is as long as a tread. Landing speeds are a row
    of walkers that bound them.
    """
    shortest = request.step_length / walker.leg_length
    longest = shortest if walker.terrain.step_up else np.inf
    if not walker.landing_speed:
        return np.array([shortest]), np.array([longest])
    return np.array([shortest, walker.landing_speed]), np.array([longest, np.inf])


@cache
def given_start_ends() -> Ends:
    """Return the ends of steps that begin in a given state."""
    return Ends("given_start", compiled(given_start_functions))
