"""The two problems on the report's grid: contacts given by a schedule, or found by complementarity."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import FootMode, Schedule
from walk_optimizer.model.kinematics import KNEE_1, KNEE_2, UPPER_1, UPPER_2
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.boundary import periodic_bounds, periodic_ends
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.euler_stage import euler_kind
from walk_optimizer.transcription.phases import INSTANT_POINTS
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.scaling import point_units, spring_units
from walk_optimizer.transcription.stage import Stage

FloatArray = NDArray[np.float64]

# Rows of a foot's pairs in the layout: gap (5a), friction cone (5b), slip forward (5c) and backward (5d).
_GAP, _CONE, _SLIP_PLUS, _SLIP_MINUS = range(4)
_FORWARD, _BACKWARD, _NORMAL = range(3)


def to_scaled(walker: WalkerParameters, points: FloatArray, spring: KneeSpring) -> FloatArray:
    """Return the scaled vector of all variables, (23 N + 2,), from points (23, N) in SI units."""
    units, spring_unit = np.array(point_units(walker)), np.array(spring_units(walker))
    scaled_spring = np.array([spring.stiffness, spring.equilibrium]) / spring_unit
    return layout.pack(points / units[:, None], scaled_spring)


def from_scaled(walker: WalkerParameters, x: FloatArray) -> tuple[FloatArray, KneeSpring]:
    """Return points (23, N) in SI units and the spring from the scaled vector of all variables."""
    points, spring = layout.unpack(x)
    stiffness, equilibrium = spring * np.array(spring_units(walker))
    return points * np.array(point_units(walker))[:, None], KneeSpring(float(stiffness), float(equilibrium))


@lru_cache(maxsize=16)
def _assembled(rows: bytes, points: int, landing: bool) -> Nlp:
    kept = np.frombuffer(rows, dtype=bool).reshape(layout.ROW_WIDTH, points)
    stages = [Stage(euler_kind(), (0, 1), kept[:, point]) for point in range(points)]
    ends = periodic_ends(landing=landing)
    return assemble(stages, ends, layout.SPRING_WIDTH, np.zeros((0, layout.SPRING_WIDTH)))


def state_bounds(walker: WalkerParameters) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of a state, (12,) each, in SI units (report section IV)."""
    lower = np.full(layout.STATE.stop, -np.inf)
    upper = -lower
    for row in (UPPER_1, UPPER_2):
        lower[row], upper[row] = -walker.hip_angle_limit, walker.hip_angle_limit
    for row in (KNEE_1, KNEE_2):
        lower[row], upper[row] = 0.0, np.pi
    lower[layout.P.start] = 0.0
    return lower, upper


def _variable_bounds(request: GaitRequest, walker: WalkerParameters) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of all points, (23, N) each, in SI units."""
    lower = np.full((layout.POINT_WIDTH, request.points), -np.inf)
    upper = -lower
    for bounds, of_state in zip((lower, upper), state_bounds(walker), strict=True):
        bounds[layout.STATE] = of_state[:, None]
    lower[layout.REACTION] = 0.0
    lower[layout.SLIP] = 0.0
    # Who stands alone is not known here: foot 1 stands all through the step, but for its first impact.
    lower[layout.REACTION.start + _NORMAL, INSTANT_POINTS:] = walker.stance_load * walker.weight
    return lower, upper


def spring_bounds(mode: SpringMode, walker: WalkerParameters) -> tuple[KneeSpring, KneeSpring]:
    """Return the least and largest K and q_eq of a spring mode."""
    if mode is SpringMode.NONE:
        return KneeSpring(), KneeSpring()
    if mode is SpringMode.STIFFNESS:
        return KneeSpring(), KneeSpring(stiffness=walker.stiffness_limit)
    return KneeSpring(equilibrium=0.0), KneeSpring(stiffness=walker.stiffness_limit)


class _Bounds:
    """Bounds under construction: points (23, N) and rows (32, N); a row without bounds is left out."""

    def __init__(self, request: GaitRequest, walker: WalkerParameters) -> None:
        self.request, self.walker = request, walker
        self.lower, self.upper = _variable_bounds(request, walker)
        self.lower_rows = np.full((layout.ROW_WIDTH, request.points), -np.inf)
        self.upper_rows = -self.lower_rows
        self.lower_rows[layout.DYNAMICS] = self.upper_rows[layout.DYNAMICS] = 0.0

    def problem(self) -> Problem:
        """Return the problem of the rows that have a bound."""
        rows = np.isfinite(self.lower_rows) | np.isfinite(self.upper_rows)
        low, high = spring_bounds(self.request.spring_mode, self.walker)
        kept = rows.ravel(order="F")
        intervals = np.full(self.request.points, self.request.interval)
        end_low, end_high = periodic_bounds(self.request, self.walker)
        return Problem(
            nlp=_assembled(rows.tobytes(), self.request.points, self.walker.landing_speed > 0),
            parameters=np.concatenate([self.walker.vector(self.request.step_length), intervals]),
            lower_x=to_scaled(self.walker, self.lower, low),
            upper_x=to_scaled(self.walker, self.upper, high),
            lower_g=np.append(self.lower_rows.ravel(order="F")[kept], end_low),
            upper_g=np.append(self.upper_rows.ravel(order="F")[kept], end_high),
        )


def fixed_schedule_problem(request: GaitRequest, walker: WalkerParameters, schedule: Schedule) -> Problem:
    """Return the smooth problem in which every foot does at each point what the schedule says.

    A foot that sticks is pinned by its height and its tangential velocity, as eqs. (5a), (5c) and
    (5d) have it: a foot pinned by position slips on the implicit Euler grid. Its lambda_x+ is the net
    tangential force, of either sign, and its lambda_x- zero: any pair with the same difference does the
    same, and without a choice between them solvers take twice as many iterations.

    Args:
        request: Speed, step, spring mode and grid.
        walker: The walker.
        schedule: A `FootMode` for each foot and point, (2, N).
    """
    bounds = _Bounds(request, walker)
    for foot in range(2):
        for mode in FootMode:
            _apply_mode(bounds, foot, mode, schedule[foot] == mode)
    return bounds.problem()


def _apply_mode(bounds: _Bounds, foot: int, mode: FootMode, where: NDArray[np.bool_]) -> None:
    """Set the bounds of one foot at the points (N,) where it is in a mode."""
    first_row, first_force = layout.PAIR_SIDES.start + 4 * foot, layout.REACTION.start + 3 * foot
    first_side, slip = layout.CONE_SIDES.start + 2 * foot, layout.SLIP.start + foot

    def row(which: int, low: float, high: float) -> None:
        bounds.lower_rows[first_row + which, where] = low
        bounds.upper_rows[first_row + which, where] = high

    def zero(variable: int) -> None:
        bounds.lower[variable, where] = bounds.upper[variable, where] = 0.0

    row(_GAP, 0.0, np.inf if mode is FootMode.FREE else 0.0)
    if mode is FootMode.FREE:
        for force in (_FORWARD, _BACKWARD, _NORMAL):
            zero(first_force + force)
        zero(slip)
    elif mode is FootMode.STICK:
        bounds.lower_rows[first_side : first_side + 2, where] = 0.0
        bounds.lower[first_force + _FORWARD, where] = -np.inf
        zero(first_force + _BACKWARD)
        row(_SLIP_PLUS, 0.0, 0.0)
        zero(slip)
    else:
        forward = mode is FootMode.SLIP_FORWARD
        row(_CONE, 0.0, 0.0)
        row(_SLIP_MINUS if forward else _SLIP_PLUS, 0.0, 0.0)
        zero(first_force + (_FORWARD if forward else _BACKWARD))


def complementarity_problem(request: GaitRequest, walker: WalkerParameters, relaxation: float) -> Problem:
    """Return the report's problem with each complementarity product bounded, [Scholtes2001] eq. (3).

    Args:
        request: Speed, step, spring mode and grid.
        walker: The walker.
        relaxation: Bound on each product a b, in units of weight times 1 m, or weight times 1 m/s.
    """
    bounds = _Bounds(request, walker)
    bounds.lower_rows[layout.PAIR_SIDES] = 0.0
    bounds.upper_rows[layout.PRODUCTS] = relaxation
    return bounds.problem()
