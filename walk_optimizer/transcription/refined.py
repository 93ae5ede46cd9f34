"""The refined problem: Radau collocation of each contact phase, impacts between them, free durations."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import radau
from walk_optimizer.transcription.boundary import periodic_bounds, periodic_ends
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.layout import STATE_WIDTH
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints
from walk_optimizer.transcription.phase_bounds import PhaseLayout, kept_rows, stage_bounds
from walk_optimizer.transcription.phases import Landing
from walk_optimizer.transcription.problems import spring_bounds
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.refined_variables import SPRING_VARIABLES, RefinedVariables
from walk_optimizer.transcription.scaling import point_units
from walk_optimizer.transcription.stage import Stage

FloatArray = NDArray[np.float64]


class RefinedProblem:
    """The refined problem of a request on a mesh, with the places of its variables."""

    def __init__(self, request: GaitRequest, walker: WalkerParameters, mesh: Mesh) -> None:
        """Lay the variables out.

        Args:
            request: Speed, step and spring mode; its number of points plays no part.
            walker: The walker.
            mesh: Phases and intervals.
        """
        self.request, self.walker, self.mesh = request, walker, mesh
        self.variables = RefinedVariables(walker, mesh)

    def problem(self) -> Problem:
        """Return the program with its bounds."""
        layout = self.mesh.layout
        rows = chain_bounds(layout, _landing(layout))
        lower, upper = self.variables.bounds(spring_bounds(self.request.spring_mode, self.walker))
        vector = self.walker.vector(self.request.step_length)
        end_low, end_high = periodic_bounds(self.request, self.walker)
        return Problem(
            nlp=_assembled(layout, self.walker.landing_speed > 0),
            parameters=np.concatenate([vector, self.variables.own_numbers()]),
            lower_x=lower,
            upper_x=upper,
            lower_g=np.concatenate([rows[0], end_low, [self.request.step_time]]),
            upper_g=np.concatenate([rows[1], end_high, [self.request.step_time]]),
        )

    def pack(self, points: RefinedPoints) -> FloatArray:
        """Return the scaled vector of all variables."""
        return self.variables.pack(points)

    def unpack(self, x: FloatArray) -> RefinedPoints:
        """Return the values of the scaled vector of all variables."""
        last = x[self.variables.last_state_columns()] * self.variables.state_unit
        return self.variables.unpack(x, state_before_step(self.walker, self.request.step_length, last))


def state_before_step(walker: WalkerParameters, step_length: float, state: FloatArray) -> FloatArray:
    """Return the state (12,) before the next step's impact: legs relabelled, hip back by the step.

    Args:
        walker: The walker.
        step_length: Of the request, in [m].
        state: At the end of the step, (12,).
    """
    function = periodic_ends().functions["periodic_value"]
    units = np.array(point_units(walker)[:STATE_WIDTH], dtype=float)
    before = np.asarray(function(state / units, walker.vector(step_length))).ravel()[:STATE_WIDTH]
    scaled: FloatArray = before * units
    return scaled


def _landing(layout: PhaseLayout) -> Landing:
    """Return which feet land at the end of a step that is repeated with the legs exchanged."""
    first, second = layout[0][0].landing
    return second, first


@lru_cache(maxsize=16)
def _assembled(layout: PhaseLayout, landing: bool) -> Nlp:
    """Return the program of phases with their numbers of intervals, `landing` speeds being a row or not."""
    stages = phase_stages(layout, _landing(layout))
    shared = len(SPRING_VARIABLES)
    durations = np.concatenate([np.zeros(shared), np.ones(len(layout))])
    return assemble(stages, periodic_ends(landing=landing), durations.size, durations[None])


def phase_stages(layout: PhaseLayout, landing: Landing, landing_speed: float = 0.0) -> list[Stage]:
    """Return the stages of phases with their numbers of intervals; arguments as for `stage_bounds`."""
    kept = (kept_rows(bounds) for bounds in stage_bounds(layout, landing, landing_speed))
    stages = []
    for index, (phase, intervals) in enumerate(layout):
        if phase.begins_with_impact:
            stages.append(Stage(radau.impact_kind(), (), next(kept)))
        shared = (*SPRING_VARIABLES, len(SPRING_VARIABLES) + index)
        stages += [Stage(radau.interval_kind(), shared, next(kept)) for _ in range(intervals)]
    return stages


def chain_bounds(
    layout: PhaseLayout, landing: Landing, landing_speed: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the kept rows of all stages; arguments as for `stage_bounds`."""
    bounds = stage_bounds(layout, landing, landing_speed)
    lower, upper = (np.concatenate([one[side][kept_rows(one)] for one in bounds]) for side in range(2))
    return lower, upper
