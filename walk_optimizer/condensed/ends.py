"""The ends of a condensed step: impact, landing and springs, joined into one small linear system."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.condensed.functions import ANGLES, END_ROWS, end_functions
from walk_optimizer.condensed.step import CondensedStep
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.problems import spring_bounds
from walk_optimizer.transcription.scaling import spring_units

FloatArray = NDArray[np.float64]

EXCHANGED = [2, 3, 0, 1]  # angles of the legs after the step
_STATE = 2 * ANGLES
_IMPACT_AND_LANDING, _STEP_LENGTH, _CONE, _LANDING_SPEED = range(5), 5, (6, 7), 8
# Of the small system: state at the end, omega after the impact, K and q_eq, multipliers of that state.
_OMEGA = slice(_STATE, _STATE + ANGLES)
_PARAMETERS = slice(_STATE + ANGLES, _STATE + ANGLES + 10)
_SPRINGS = [_PARAMETERS.start, _PARAMETERS.start + 1]
_MULTIPLIERS = slice(_PARAMETERS.start + 2, _PARAMETERS.stop)


def _reach() -> FloatArray:
    """Return how start (8) and parameters (10) depend on the unknowns of the small system, (18, 22)."""
    reach = np.zeros((_STATE + 10, _PARAMETERS.stop))
    reach[range(ANGLES), EXCHANGED] = 1.0
    reach[range(ANGLES, _STATE), range(_OMEGA.start, _OMEGA.stop)] = 1.0
    reach[range(_STATE, _STATE + 10), range(_PARAMETERS.start, _PARAMETERS.stop)] = 1.0
    return reach


_REACH = _reach()


class Ends:
    """What joins the end of a step to its start, with the bounds of the springs.

    Attributes:
        equations: Which of the functions' rows are equations.
        inequalities: Which are inequalities.
        free_springs: Which of K and q_eq may be chosen, (2,).
        used: Which of the inequalities and bounds there are: those of fixed springs take no part.
        point: theta and omega at the end, omega after the impact of the iterate, (12,).
        rows: Values of the equations there.
        limits: Values of the inequalities, then distances of the springs from their bounds.
    """

    def __init__(self, request: GaitRequest, walker: WalkerParameters) -> None:
        """Set what is asked for."""
        self._functions = compiled(end_functions)
        self._vector = np.array(walker.vector(request.step_length), dtype=np.float64)
        # On stairs a step is as long as a tread, elsewhere it may be longer.
        on_stairs = [_STEP_LENGTH] if walker.terrain.step_up else []
        self.equations = [*_IMPACT_AND_LANDING, *on_stairs]
        others = [_STEP_LENGTH, *_CONE, *([_LANDING_SPEED] if walker.landing_speed else [])]
        self.inequalities = [row for row in others if row not in on_stairs]
        self._least = np.zeros(END_ROWS)
        self._least[[_STEP_LENGTH, _LANDING_SPEED]] = (
            request.step_length / walker.leg_length,
            walker.landing_speed,
        )
        units = np.array(spring_units(walker), dtype=float)
        bounds = spring_bounds(request.spring_mode, walker)
        self._lower, self._upper = (np.array([one.stiffness, one.equilibrium]) / units for one in bounds)
        self.free_springs = self._upper > self._lower
        rows = np.ones(len(self.inequalities), dtype=bool)
        self.used = np.concatenate([rows, self.free_springs, self.free_springs])
        self.point, self.rows = np.zeros(3 * ANGLES), np.zeros(len(self.equations))
        self.limits, self._jacobian = np.zeros(self.used.size), np.zeros((END_ROWS, 3 * ANGLES))
        self._hessian = np.zeros((3 * ANGLES, 3 * ANGLES))

    def bounded(self, springs: FloatArray) -> FloatArray:
        """Return K and q_eq, scaled, within their bounds."""
        return np.clip(springs, self._lower, self._upper)

    @property
    def size(self) -> int:
        """Number of inequalities and bounds."""
        return self.used.size

    def evaluate(self, step: CondensedStep) -> None:
        """Evaluate the ends of an iterate."""
        start, springs = (step.unknowns.of(step.iterate, name) for name in ("start", "springs"))
        self.point = np.concatenate([step.y[-1, :_STATE], start[ANGLES:]])
        rows, jacobian = self._functions["condensed_ends"](self.point, self._vector)
        values, self._jacobian = np.asarray(rows).ravel() - self._least, np.asarray(jacobian)
        self.rows = values[self.equations]
        of_springs = (springs - self._lower, self._upper - springs)
        self.limits = np.concatenate([values[self.inequalities], *of_springs])

    def impulse(self) -> FloatArray:
        """Return the impulse of the impact at the point last evaluated in [N s], (2,)."""
        value: FloatArray = np.asarray(self._functions["condensed_impulse"](self.point, self._vector)).ravel()
        return value

    def evaluate_curvature(self, joints: FloatArray, multipliers: FloatArray) -> None:
        """Evaluate the Hessian of the Lagrangian, for multipliers of equations and inequalities."""
        lam = np.zeros(END_ROWS)
        lam[self.equations] = joints
        lam[self.inequalities] = -multipliers[: len(self.inequalities)]
        function = self._functions["condensed_ends_curvature"]
        self._hessian = np.asarray(function(self.point, lam, self._vector))

    def joined(
        self, hessian: FloatArray, step: CondensedStep, weights: FloatArray, curvature: float
    ) -> "JoinedEnds | None":
        """Return the small system of the ends; None where the step is not convex.

        Args:
            hessian: Of the whole step in its ends, (18, 18).
            step: The step.
            weights: Multipliers over slacks of the inequalities and bounds.
            curvature: Share of the Lagrangian's Hessian that is taken.
        """
        count, place = len(self.equations), _PARAMETERS.stop
        system = np.zeros((place + count, place + count))
        whole = hessian.copy()
        whole[:_STATE, :_STATE] += curvature * step.start_hessian
        system[:place, :place] = _REACH.T @ whole @ _REACH
        bent, rows = slice(0, _OMEGA.stop), self._jacobian[self.inequalities]
        own = weights[: len(self.inequalities)]
        system[bent, bent] += curvature * self._hessian + rows.T @ (own[:, None] * rows)
        system[_SPRINGS, _SPRINGS] += weights[-4:-2] + weights[-2:]
        step.release_end(system, slice(0, _STATE), _MULTIPLIERS)
        system[place:, bent] = self._jacobian[self.equations]
        system[bent, place:] = self._jacobian[self.equations].T
        fixed = np.array(_SPRINGS)[~self.free_springs]
        system[fixed], system[:, fixed] = 0.0, 0.0
        system[fixed, fixed] = 1.0
        # Each multiplier makes one eigenvalue negative, where the step is convex no other is.
        sign, _ = np.linalg.slogdet(system)
        if sign != (-1) ** (_STATE + count):
            return None
        inverse = np.asarray(np.linalg.inv(system), dtype=np.float64)
        return JoinedEnds(inverse, rows, self.rows, fixed)


class JoinedEnds:
    """The inverse of the small system of the ends."""

    def __init__(
        self,
        inverse: FloatArray,
        limit_rows: FloatArray,
        rows: FloatArray,
        fixed: NDArray[np.int64],
    ) -> None:
        self._inverse, self._limit_rows, self._rows, self._fixed = inverse, limit_rows, rows, fixed

    def solved(self, gradient: FloatArray, held: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the change of the ends of the step (18,), the new multipliers and the change of all limits.

        Args:
            gradient: Of the whole step in its ends, (18,).
            held: Multipliers of inequalities and bounds after a full step that does not change them.
        """
        place = _PARAMETERS.stop
        right = np.zeros(self._inverse.shape[0])
        right[:place] = _REACH.T @ gradient
        right[: _OMEGA.stop] -= self._limit_rows.T @ held[:-4]
        right[_SPRINGS] += held[-2:] - held[-4:-2]
        right[place:] = self._rows
        right[self._fixed] = 0.0
        found = -(self._inverse @ right)
        springs = found[_SPRINGS]
        change = np.concatenate([self._limit_rows @ found[: _OMEGA.stop], springs, -springs])
        return _REACH @ found[:place], found[place:], change
