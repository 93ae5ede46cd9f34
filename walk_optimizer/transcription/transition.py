"""The problem of steps between two given states, on collocation intervals with free durations of phases."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.kinematics import KNEE_1, KNEE_2
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transcription.boundary import JOINT_ROWS, given_start_ends
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints
from walk_optimizer.transcription.phase_bounds import PhaseLayout
from walk_optimizer.transcription.phases import Landing
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.refined import chain_bounds, phase_stages
from walk_optimizer.transcription.refined_variables import SPRING_VARIABLES, RefinedVariables

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class End:
    """The state that the last step ends in, with the legs named as in the first step.

    Angles and velocities of all four joints are pinned; the place of the hip follows from the foot that
    stands. At rest on both feet the velocities of the hips follow from those of the knees: to pin them
    as well would ask twice for the same.

    Attributes:
        angles: Of hip 1, knee 1, hip 2, knee 2 in [rad], (4,).
        velocities: Of the same in [rad/s], (4,).
        landing: Which feet land there.
        at_rest: Whether both feet stand already.
    """

    angles: FloatArray
    velocities: FloatArray
    landing: Landing
    at_rest: bool

    @property
    def pinned(self) -> NDArray[np.bool_]:
        """Which of the eight angles and velocities are independent, (8,)."""
        velocities = [not self.at_rest or row in (KNEE_1, KNEE_2) for row in JOINT_ROWS]
        return np.array([True] * 4 + velocities)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of the eight rows."""
        values = np.concatenate([self.angles, self.velocities])
        return np.where(self.pinned, values, -np.inf), np.where(self.pinned, values, np.inf)


@dataclass(frozen=True)
class TransitionLimits:
    """What steps between gaits may do.

    Attributes:
        torque: Largest magnitudes of u1, u2 and u3 in [N m], (3,).
        shortest: Of each step in [s].
        longest: Of each step in [s].
    """

    torque: FloatArray
    shortest: float
    longest: float


class TransitionProblem:
    """The problem of one or more steps from a given state to another.

    All steps are one chain, in which the legs keep their names: in the second step foot 2 stands. Each
    step but the last ends in a landing at the walker's landing speed or faster; the last one's end is given.
    """

    def __init__(
        self,
        walker: WalkerParameters,
        mesh: Mesh,
        steps: tuple[int, ...],
        start: FloatArray,
        end: End,
        spring: KneeSpring,
        limits: TransitionLimits,
    ) -> None:
        """Lay the variables out.

        Args:
            walker: The walker.
            mesh: Phases and intervals of all steps; no foot of the first impact is pinned to the ground,
                since the start says where it is.
            steps: Number of phases of each step.
            start: State before the first step, (12,).
            end: State after the last one.
            spring: K and q_eq of both knees.
            limits: Of torques and durations.
        """
        self.walker, self.mesh, self.steps, self.start, self.end = walker, mesh, steps, start, end
        self.spring, self.limits = spring, limits
        self.variables = RefinedVariables(walker, mesh)

    def problem(self) -> Problem:
        """Return the program with its bounds."""
        rows = chain_bounds(self.mesh.layout, self.end.landing, self.walker.landing_speed)
        end, steps = self.end.bounds(), len(self.steps)
        lower, upper = self.variables.bounds((self.spring, self.spring), self.limits.torque)
        # The end pins what these would bound.
        last = self.variables.last_state_columns()
        lower[last], upper[last] = -np.inf, np.inf
        numbers = (self.walker.vector(), self.variables.own_numbers(), self.start / self.variables.state_unit)
        return Problem(
            nlp=_assembled(self.mesh.layout, self.steps, self.end.landing, self.walker.landing_speed),
            parameters=np.concatenate(numbers),
            lower_x=lower,
            upper_x=upper,
            lower_g=np.concatenate([rows[0], end[0], np.full(steps, self.limits.shortest)]),
            upper_g=np.concatenate([rows[1], end[1], np.full(steps, self.limits.longest)]),
        )

    def pack(self, points: RefinedPoints) -> FloatArray:
        """Return the scaled vector of all variables."""
        return self.variables.pack(points)

    def unpack(self, x: FloatArray) -> RefinedPoints:
        """Return the values of the scaled vector of all variables."""
        return self.variables.unpack(x, self.start)


@lru_cache(maxsize=16)
def _assembled(layout: PhaseLayout, steps: tuple[int, ...], landing: Landing, landing_speed: float) -> Nlp:
    """Return the program of phases and numbers of intervals; the durations of steps are its linear rows."""
    step_of_phase = np.repeat(np.arange(len(steps)), steps)
    durations = (step_of_phase == np.arange(len(steps))[:, None]).astype(float)
    spring = np.zeros((len(steps), len(SPRING_VARIABLES)))
    shared = np.hstack([spring, durations])
    stages = phase_stages(layout, landing, landing_speed)
    return assemble(stages, given_start_ends(), shared.shape[1], shared)
