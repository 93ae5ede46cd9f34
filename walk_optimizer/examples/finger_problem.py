"""The finger's program: implicit Euler and complementarity, from rest to a place of the disc."""

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.complementarity import PAIRS_PER_POINT, ContactPoint, pairs_of
from walk_optimizer.examples.finger_model import (
    CONTACTS,
    COORDINATES,
    DISC_X,
    DISC_Y,
    ELBOW,
    SHOULDER,
    TORQUES,
    Finger,
    SymbolicFinger,
)
from walk_optimizer.examples.free_end import free_end_functions
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.euler_stage import euler_rows
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.stage import Ends, Stage, StageKind
from walk_optimizer.transcription.stage_functions import stage_functions

FloatArray = NDArray[np.float64]

# Rows of one grid point's column of variables.
Q = slice(0, COORDINATES)
P = slice(COORDINATES, 2 * COORDINATES)
STATE = slice(0, 2 * COORDINATES)
U = slice(STATE.stop, STATE.stop + TORQUES)
FORCES = slice(U.stop, U.stop + 3 * CONTACTS)
SLIP = slice(FORCES.stop, FORCES.stop + CONTACTS)
WIDTH = SLIP.stop
PAIRS = PAIRS_PER_POINT * CONTACTS
ROWS = STATE.stop + 2 * PAIRS


class Sized(Protocol):
    """What the units are made from; a finger of numbers and one of symbols both offer it."""

    @property
    def disc_mass(self) -> ca.SX:
        """Mass of the disc in [kg]."""

    @property
    def disc_radius(self) -> ca.SX:
        """Radius of the disc in [m]."""

    @property
    def gravity(self) -> ca.SX:
        """Gravitational acceleration in [m/s^2]."""


def point_units(finger: Sized) -> list[ca.SX]:
    """Return the unit of each row of a grid point's column: all are of order one in them."""
    weight, size = finger.disc_mass * finger.gravity, 2 * finger.disc_radius
    turning = finger.disc_mass * finger.disc_radius
    coordinates, momenta = [1.0, 1.0, size, size, 1.0], [turning] * 2 + [finger.disc_mass] * 2 + [turning]
    torques = [weight * finger.disc_radius] * TORQUES
    return coordinates + momenta + torques + [weight] * 3 * CONTACTS + [1.0] * CONTACTS


def _row_units(finger: Sized) -> list[ca.SX]:
    weight, size = finger.disc_mass * finger.gravity, 2 * finger.disc_radius
    sides, products = [size, weight, 1.0, 1.0], [size * weight, weight, weight, weight]
    return point_units(finger)[STATE] + sides * CONTACTS + products * CONTACTS


def _motion(finger: SymbolicFinger) -> ca.Function:
    """Return (q, qdot, u, forces, slip, finger) -> M(q), pdot, sides a, sides b."""
    q, qdot, u = ca.SX.sym("q", COORDINATES), ca.SX.sym("qdot", COORDINATES), ca.SX.sym("u", TORQUES)
    forces, slip = ca.SX.sym("forces", 3 * CONTACTS), ca.SX.sym("slip", CONTACTS)
    contacts = finger.contacts(q, qdot, forces, slip)
    co_energy = finger.co_energy(q, qdot)
    rate = ca.gradient(co_energy - finger.potential(q), q) + _generalized(contacts, q, qdot)
    rate[[SHOULDER, ELBOW]] += u
    mass_matrix = ca.hessian(co_energy, qdot)[0]
    inputs = [q, qdot, u, forces, slip, finger.symbols]
    return ca.Function("motion", inputs, [mass_matrix, rate, *pairs_of(contacts)])


def _generalized(contacts: list[ContactPoint], q: ca.SX, qdot: ca.SX) -> ca.SX:
    return sum(contact.generalized_force(q, qdot) for contact in contacts)


def point_functions() -> list[ca.Function]:
    """Return the functions of one grid point, in scaled variables; its own number is h in [s]."""
    finger, interval = SymbolicFinger(), ca.SX.sym("h")
    w, s = ca.SX.sym("w", WIDTH), ca.SX.sym("s", 0)
    column = w * ca.vertcat(*point_units(finger))
    motion = _motion(finger)
    others = (column[U], column[FORCES], column[SLIP], finger.symbols)
    mass_matrix = motion(column[Q], ca.SX.zeros(COORDINATES), *others)[0]
    qdot = ca.solve(mass_matrix, column[P])
    _, pdot, a, b = motion(column[Q], qdot, *others)
    nothing = ca.SX.zeros(STATE.stop)
    rows = euler_rows(column[STATE], nothing, ca.vertcat(qdot, pdot), interval, (a, b))
    cost = interval * ca.sumsqr(w[U]) / 2
    par = ca.vertcat(finger.symbols, interval)
    return stage_functions("finger", w, s, par, rows / ca.vertcat(*_row_units(finger)), cost)


def start_functions() -> list[ca.Function]:
    """Return the functions of the chain's ends."""
    return free_end_functions("finger_start", SymbolicFinger().symbols, STATE.stop)


@cache
def _point_kind() -> StageKind:
    previous = np.vstack([-np.eye(STATE.stop), np.zeros((2 * PAIRS, STATE.stop))])
    return StageKind("finger", compiled(point_functions), WIDTH, ROWS, STATE, 0, previous)


@lru_cache(maxsize=4)
def _assembled(points: int) -> Nlp:
    stages = [Stage(_point_kind(), (), np.ones(ROWS, dtype=bool))] * points
    return assemble(stages, Ends("finger_start", compiled(start_functions)), 0, np.zeros((0, 0)))


@dataclass(frozen=True)
class FingerTask:
    """What the finger is asked to do from rest.

    Attributes:
        distance: Where the disc is at the end, ahead of where it lay, in [m].
        duration: In [s].
        points: Number N of grid points.
        lowest_joint: Smallest angle of either joint in [rad].
        highest_joint: Largest angle of either joint in [rad].
    """

    distance: float = 0.3
    duration: float = 1.0
    points: int = 40
    lowest_joint: float = -1.6
    highest_joint: float = 2.5

    @property
    def interval(self) -> float:
        """Time step h in [s]."""
        return self.duration / self.points


def rest(finger: Finger) -> FloatArray:
    """Return the state (10,) in which the finger hangs still and the disc lies still at 0."""
    state = np.zeros(STATE.stop)
    state[DISC_Y] = finger.disc_radius
    return state


def finger_problem(finger: Finger, task: FingerTask, relaxation: float) -> Problem:
    """Return the program with each complementarity product bounded.

    Args:
        finger: Finger and disc.
        task: What is asked for.
        relaxation: Bound on each product, in units of the disc's weight times its diameter or 1 m/s.
    """
    units = _numbers(finger)
    lower, upper = _variable_bounds(task)
    free, zero = np.full(PAIRS, np.inf), np.zeros(PAIRS)
    lower_rows = np.concatenate([np.zeros(STATE.stop), zero, -free])
    upper_rows = np.concatenate([np.zeros(STATE.stop), free, np.full(PAIRS, relaxation)])
    intervals, start = np.full(task.points, task.interval), rest(finger) / units[STATE]
    return Problem(
        nlp=_assembled(task.points),
        parameters=np.concatenate([finger.vector(), intervals, start]),
        lower_x=(lower / units[:, None]).ravel(order="F"),
        upper_x=(upper / units[:, None]).ravel(order="F"),
        lower_g=np.tile(lower_rows, task.points),
        upper_g=np.tile(upper_rows, task.points),
    )


def _variable_bounds(task: FingerTask) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of all points, (20, N) each, in SI units."""
    lower = np.full((WIDTH, task.points), -np.inf)
    upper = -lower
    lower[FORCES], lower[SLIP] = 0.0, 0.0
    for joint in (SHOULDER, ELBOW):
        lower[joint], upper[joint] = task.lowest_joint, task.highest_joint
    lower[DISC_X, -1] = upper[DISC_X, -1] = task.distance
    return lower, upper


def still_guess(finger: Finger, task: FingerTask) -> FloatArray:
    """Return the scaled first guess: nothing moves, and the table carries the disc."""
    column = np.zeros(WIDTH)
    column[STATE] = rest(finger)
    column[FORCES.stop - 1] = finger.disc_mass * finger.gravity
    return np.tile(column / _numbers(finger), task.points)


def points_of(finger: Finger, x: FloatArray) -> FloatArray:
    """Return all points in SI units, (20, N), from the scaled vector of all variables."""
    return x.reshape(WIDTH, -1, order="F") * _numbers(finger)[:, None]


def _numbers(finger: Finger) -> FloatArray:
    units: FloatArray = np.array(point_units(finger), dtype=np.float64)
    return units
