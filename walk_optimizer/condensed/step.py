"""A step in single support, condensed: its unknowns, their values at an iterate, and Newton directions.

The method is a lifted Newton method [Albersmeyer2010]: momenta and torques keep values of their own while
they are eliminated from the linear systems, so that these are small and the iterations as few as those of
the uncondensed problem.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.condensed.functions import ANGLES, MOMENTA
from walk_optimizer.condensed.kernel import ENDS, LIMITS, Kernel, Step, address
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.transcription.problems import state_bounds
from walk_optimizer.transcription.refined_variables import least_vertical_force
from walk_optimizer.transcription.tableau import BUTCHER, DIFFERENTIATION, QUADRATURE, STAGES

FloatArray = NDArray[np.float64]

# On the state at the end, in units of the objective per rad^2 and (rad/s)^2: below 10 some solves do not
# end, and from there on it makes no difference.
PENALTY = 100.0


class Unknowns:
    """Where the unknowns of a step stand in one vector, and views of such a vector by their names.

    The primal ones come first: omega (3 n, 4), momenta (1 + 3 n, 6), torques (3 n, 3), start (8,): theta
    and omega after the impact; springs (2,), and the slacks of all inequalities: of the nodes, then
    further ones. Then come the multipliers: of the passive rows (3 n,), of the equations that join the
    ends, and of the inequalities.
    """

    def __init__(self, intervals: int, joints: int, further: int) -> None:
        """Lay the unknowns out.

        Args:
            intervals: Number n of intervals.
            joints: Number of equations that join the ends.
            further: Number of inequalities besides those of the nodes.
        """
        nodes = STAGES * intervals
        self.inequalities = nodes * LIMITS + further
        shapes = {
            "omega": (nodes, ANGLES),
            "momenta": (1 + nodes, MOMENTA),
            "torques": (nodes, 3),
            "start": (2 * ANGLES,),
            "springs": (2,),
            "slacks": (self.inequalities,),
            "passive": (nodes,),
            "joints": (joints,),
            "multipliers": (self.inequalities,),
        }
        sizes = [int(np.prod(shape)) for shape in shapes.values()]
        ends = np.cumsum(sizes).tolist()
        self._places = {
            name: (slice(end - size, end), shape)
            for (name, shape), size, end in zip(shapes.items(), sizes, ends, strict=True)
        }
        self.size = ends[-1]
        self.primal = slice(0, self._places["passive"][0].start)
        self.dual = slice(self.primal.stop, self.size)

    def of(self, vector: FloatArray, name: str) -> FloatArray:
        """Return the view of one of the unknowns."""
        place, shape = self._places[name]
        return vector[place].reshape(shape)


class CondensedStep:
    """The nodes of a step: values, and the Riccati recursion over its intervals.

    Attributes:
        iterate: The unknowns, to be changed in place.
        direction: The last direction; of `passive` the new values.
        unknowns: Where the unknowns stand in both.
        walker_vector: The numbers of the walker that generated functions take.
        lengths: Of the intervals in [s], (n,).
    """

    def __init__(
        self,
        kernel: Kernel,
        walker: WalkerParameters,
        step_length: float,
        lengths: FloatArray,
        unknowns: Unknowns,
        threads: int,
    ) -> None:
        """Provide the memory.

        Args:
            kernel: The compiled code.
            walker: The walker.
            step_length: Of the request, in [m].
            lengths: Of the intervals in [s], (n,).
            unknowns: Where the unknowns stand.
            threads: How many to use, 1 or 2.
        """
        intervals, nodes = lengths.size, STAGES * lengths.size
        self._code, self._step, self.unknowns = kernel.code, Step(), unknowns
        self.iterate, self.direction = np.zeros(unknowns.size), np.zeros(unknowns.size)
        self.walker_vector = np.array(walker.vector(step_length), dtype=np.float64)
        self.lengths = np.ascontiguousarray(lengths)
        self._shares = (self.lengths[:, None] * QUADRATURE).ravel()
        shapes = {
            "y": (nodes, 16), "true_momenta": (1 + nodes, MOMENTA), "rows": (nodes, 5),
            "momentum_jacobian": (1 + nodes, MOMENTA, 8), "row_jacobian": (nodes, 5, 16),
            "limits": (nodes, LIMITS), "rate_defect": (nodes, MOMENTA),
            "momentum_multipliers": (1 + nodes, MOMENTA), "hessian": (nodes, 16, 16),
            "start_hessian": (8, 8), "condensed": (intervals, 22, 24), "passive_rows": (nodes, 24),
            "defect_gradient": (nodes, 16),
        }  # fmt: skip
        self._memory = {name: np.zeros(shape) for name, shape in shapes.items()}
        self._eliminations = np.zeros(intervals * kernel.elimination_numbers)
        for name, array in self._memory.items():
            setattr(self._step, name, address(array))
        self._step.eliminations = self._eliminations.ctypes.data
        self._step.walker, self._step.lengths = address(self.walker_vector), address(self.lengths)
        self._set_constants(walker, intervals, threads)
        self._set_unknowns()
        kernel.connect(self._step)

    def _set_constants(self, walker: WalkerParameters, intervals: int, threads: int) -> None:
        step = self._step
        step.intervals, step.threads, step.penalty = intervals, threads, PENALTY
        step.weight, step.mass = walker.weight, walker.total_mass
        step.differentiation[:] = DIFFERENTIATION.ravel().tolist()
        step.butcher[:] = BUTCHER.ravel().tolist()
        step.quadrature[:] = QUADRATURE.tolist()
        lower, upper = state_bounds(walker)
        step.lower[:], step.upper[:] = lower[2:6].tolist(), upper[2:6].tolist()
        cone, least = _load_limits(walker)
        step.cone[:], step.cone_least[:] = cone.ravel().tolist(), least.tolist()

    def _set_unknowns(self) -> None:
        for name in ("omega", "momenta", "torques", "start", "springs", "slacks", "passive", "multipliers"):
            setattr(self._step, name, address(self.unknowns.of(self.iterate, name)))
        for name in ("omega", "momenta", "torques", "slacks", "multipliers"):
            setattr(self._step, f"step_{name}", address(self.unknowns.of(self.direction, name)))
        self._step.new_passive = address(self.unknowns.of(self.direction, "passive"))

    @property
    def y(self) -> FloatArray:
        """Angles theta, their velocities omega, momentum rate, springs at the nodes, (3 n, 16)."""
        return self._memory["y"]

    @property
    def rows(self) -> FloatArray:
        """Torques u1, u2, u3, the passive row, the gap of foot 2 at the nodes, scaled, (3 n, 5)."""
        return self._memory["rows"]

    @property
    def limits(self) -> FloatArray:
        """The inequalities of the nodes, (3 n, 13), not negative where they hold."""
        return self._memory["limits"]

    @property
    def true_momenta(self) -> FloatArray:
        """P(theta, omega) at the start and the nodes, (1 + 3 n, 6), in SI units."""
        return self._memory["true_momenta"]

    @property
    def condensed(self) -> FloatArray:
        """Hessians of the intervals in omega (12), first state (8) and springs (2), (n, 22, 24)."""
        return self._memory["condensed"]

    @property
    def passive_rows(self) -> FloatArray:
        """The rows without a torque of all nodes, linear in the same variables, (3 n, 24)."""
        return self._memory["passive_rows"]

    @property
    def start_hessian(self) -> FloatArray:
        """Hessian of the Lagrangian in the state at the start, (8, 8)."""
        return self._memory["start_hessian"]

    def evaluate(self, *, settle: bool = False) -> None:
        """Evaluate the iterate.

        Args:
            settle: Whether momenta are first set to what angles and velocities say.
        """
        self._code.evaluate_states(ctypes.byref(self._step))
        if settle:
            self.unknowns.of(self.iterate, "momenta")[:] = self.true_momenta
        self._code.evaluate_points(ctypes.byref(self._step))

    def objective(self) -> float:
        """Return the integral of 1/2 |u|^2 of the torques that the motion needs, scaled."""
        return float(self._shares @ (self.rows[:, :3] ** 2).sum(axis=1)) / 2

    def infeasibility(self) -> float:
        """Return the largest violation of an equation of the nodes, in natural units."""
        torques = self.unknowns.of(self.iterate, "torques")
        violations = (self.rows[:, 3], self.rows[:, :3] - torques, self._memory["rate_defect"])
        units = (1.0, 1.0, float(self._step.weight))
        return float(np.max([np.abs(one).max() / unit for one, unit in zip(violations, units, strict=True)]))

    def evaluate_curvature(self) -> None:
        """Evaluate the Hessians of the Lagrangian at the iterate."""
        self._code.evaluate_curvature(ctypes.byref(self._step))

    def eliminated(self, curvature: float) -> FloatArray | None:
        """Return the Hessian of the whole step in its ends, (18, 18); None where it is not convex inside.

        Args:
            curvature: Share of the Lagrangian's Hessian that is taken, in [0, 1]; with 0 it is convex.
        """
        self._code.condense(ctypes.byref(self._step), curvature)
        hessian = np.empty((ENDS, ENDS))
        return hessian if self._code.eliminate(ctypes.byref(self._step), address(hessian)) else None

    def release_end(self, system: FloatArray, state: slice, multipliers: slice) -> None:
        """Join the state at the end to its multipliers in a system, and take the penalty on it off again."""
        diagonal = np.arange(state.start, state.stop)
        system[diagonal, diagonal] -= self._step.penalty
        system[state, multipliers] -= np.eye(diagonal.size)
        system[multipliers, state] -= np.eye(diagonal.size)

    def gathered(self, targets: FloatArray) -> FloatArray:
        """Return the gradient of the whole step in its ends, (18,).

        Args:
            targets: Wanted products of slacks and multipliers, at least of all nodes.
        """
        gradient = np.empty(ENDS)
        self._code.gather(ctypes.byref(self._step), address(targets), address(gradient))
        return gradient

    def spread(self, ends: FloatArray, targets: FloatArray) -> None:
        """Find the direction that belongs to a change of the ends, (18,), after `gathered`."""
        self._code.spread(ctypes.byref(self._step), address(ends), address(targets))


def _load_limits(walker: WalkerParameters) -> tuple[FloatArray, FloatArray]:
    """Return rows (3, 2) and least values (3,) of what the ground reaction keeps, in units of weight.

    Both sides of the friction cone, and the vertical force that loads the foot as it has to be loaded.
    """
    tangential, normal = walker.terrain.along_and_normal(np.eye(2))
    limit = walker.friction_coefficient * normal
    rows = np.array([limit - tangential, limit + tangential, [0.0, 1.0]]) / walker.weight
    return rows, np.array([0.0, 0.0, least_vertical_force(walker) / walker.weight])
