"""The refined problem: Radau collocation of each contact phase, impacts between them, free durations."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import radau
from walk_optimizer.transcription.boundary import periodic_ends
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.layout import STATE_WIDTH
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints
from walk_optimizer.transcription.phase_bounds import (
    PhaseLayout,
    force_bounds,
    impact_bounds,
    interval_bounds,
    kept_rows,
    landing_after,
)
from walk_optimizer.transcription.problems import spring_bounds, state_bounds
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.scaling import point_units, spring_units, torque_unit
from walk_optimizer.transcription.stage import Stage
from walk_optimizer.transcription.tableau import STAGES

FloatArray = NDArray[np.float64]

# Shared variables: K, q_eq, then the duration of each phase in [s].
_SPRING = (0, 1)
_SHORTEST_PHASE = 1e-3


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
        self.state_unit = np.array(point_units(walker)[:STATE_WIDTH], dtype=float)
        self.impulse_unit = walker.weight * radau.IMPULSE_DURATION
        self.impact_start, self.interval_start = self._offsets()

    def _offsets(self) -> tuple[list[int | None], FloatArray]:
        """Return where the variables of each phase's impact and of each interval begin."""
        impacts: list[int | None] = []
        intervals: list[int] = []
        place = 0
        for phase, parts in zip(self.mesh.phases, self.mesh.parts, strict=True):
            impacts.append(place if phase.begins_with_impact else None)
            place += radau.IMPACT_WIDTH if phase.begins_with_impact else 0
            intervals += [place + radau.INTERVAL_WIDTH * i for i in range(parts.size)]
            place += radau.INTERVAL_WIDTH * parts.size
        self.shared_start = place
        return impacts, np.array(intervals)

    @property
    def size(self) -> int:
        """Number of variables."""
        return self.shared_start + 2 + len(self.mesh.phases)

    def problem(self) -> Problem:
        """Return the program with its bounds."""
        pairs = zip(self.mesh.phases, self.mesh.parts, strict=True)
        layout = tuple((phase, parts.size) for phase, parts in pairs)
        bounds = _chain_bounds(layout)
        lower, upper = self._variable_bounds()
        numbers = [
            np.concatenate([np.zeros(int(phase.begins_with_impact)), parts])
            for phase, parts in zip(self.mesh.phases, self.mesh.parts, strict=True)
        ]
        step_length = self.request.step_length / self.walker.leg_length
        return Problem(
            nlp=_assembled(layout),
            parameters=np.concatenate([self.walker.vector(), *numbers]),
            lower_x=lower,
            upper_x=upper,
            lower_g=np.concatenate([bounds[0], [step_length, self.request.step_time]]),
            upper_g=np.concatenate([bounds[1], [np.inf, self.request.step_time]]),
        )

    def _variable_bounds(self) -> tuple[FloatArray, FloatArray]:
        low, high = spring_bounds(self.request.spring_mode, self.walker)
        count, phases = self.mesh.intervals, len(self.mesh.phases)
        state_low, state_high = state_bounds(self.walker)
        modes = [self.mesh.phases[k].modes for k in self.mesh.phase_of_interval]
        force_low, force_high = np.array([force_bounds(one) for one in modes]).transpose(1, 0, 2)
        free = np.full((count, STAGES, 3), np.inf)
        impulses = np.array([force_bounds(phase.impact) for phase in self.mesh.phases]).transpose(1, 0, 2)
        bounds = []
        for sign, states, forces, impulse, spring, duration in (
            (-1, state_low, force_low, impulses[0], low, _SHORTEST_PHASE),
            (1, state_high, force_high, impulses[1], high, np.inf),
        ):
            points = RefinedPoints(
                states=np.broadcast_to(states, (count, STAGES + 1, STATE_WIDTH)),
                torques=sign * free,
                forces=np.repeat(forces[:, None, :], STAGES, axis=1),
                durations=np.full(phases, duration),
                impulses=impulse,
                spring=spring,
            )
            bounds.append(self.pack(points))
        # The state after an impact has the angles of the one before it, which has bounds of its own.
        for place in (one for one in self.impact_start if one is not None):
            bounds[0][place : place + 6], bounds[1][place : place + 6] = -np.inf, np.inf
        return bounds[0], bounds[1]

    def pack(self, points: RefinedPoints) -> FloatArray:
        """Return the scaled vector of all variables."""
        x = np.zeros(self.size)
        starts = self.mesh.first_intervals
        for phase, place in enumerate(self.impact_start):
            if place is not None:
                x[place : place + STATE_WIDTH] = points.states[starts[phase], 0] / self.state_unit
                impulse = points.impulses[phase] / self.impulse_unit
                x[place + STATE_WIDTH : place + radau.IMPACT_WIDTH] = impulse
        inside = np.concatenate(
            [
                (points.states[:, 1:] / self.state_unit).reshape(self.mesh.intervals, -1),
                (points.torques / torque_unit(self.walker)).reshape(self.mesh.intervals, -1),
                (points.forces / self.walker.weight).reshape(self.mesh.intervals, -1),
            ],
            axis=1,
        )
        x[self.interval_start[:, None] + np.arange(radau.INTERVAL_WIDTH)] = inside
        spring = np.array([points.spring.stiffness, points.spring.equilibrium]) / spring_units(self.walker)
        x[self.shared_start :] = np.concatenate([spring, points.durations])
        return x

    def unpack(self, x: FloatArray) -> RefinedPoints:
        """Return the values of the scaled vector of all variables."""
        inside = x[self.interval_start[:, None] + np.arange(radau.INTERVAL_WIDTH)]
        count = self.mesh.intervals
        nodes = inside[:, : radau.TORQUE_START].reshape(count, STAGES, STATE_WIDTH) * self.state_unit
        torques = inside[:, radau.TORQUE_START : radau.FORCE_START].reshape(count, STAGES, 3)
        forces = inside[:, radau.FORCE_START :].reshape(count, STAGES, 4)
        before = state_before_step(self.walker, nodes[-1, -1])
        starts = np.concatenate([before[None], nodes[:-1, -1]])
        impulses = np.zeros((len(self.mesh.phases), 4))
        first = self.mesh.first_intervals
        for phase, place in enumerate(self.impact_start):
            if place is not None:
                starts[first[phase]] = x[place : place + STATE_WIDTH] * self.state_unit
                impulses[phase] = x[place + STATE_WIDTH : place + radau.IMPACT_WIDTH] * self.impulse_unit
        stiffness, equilibrium = x[self.shared_start : self.shared_start + 2] * spring_units(self.walker)
        return RefinedPoints(
            states=np.concatenate([starts[:, None], nodes], axis=1),
            torques=torques * torque_unit(self.walker),
            forces=forces * self.walker.weight,
            durations=x[self.shared_start + 2 :],
            impulses=impulses,
            spring=KneeSpring(float(stiffness), float(equilibrium)),
        )


def state_before_step(walker: WalkerParameters, state: FloatArray) -> FloatArray:
    """Return the state (12,) before the next step's impact: legs relabelled, hip back by the step length."""
    function = periodic_ends().functions["periodic_value"]
    units = np.array(point_units(walker)[:STATE_WIDTH], dtype=float)
    before: FloatArray = np.asarray(function(state / units, walker.vector())).ravel()[:STATE_WIDTH] * units
    return before


@lru_cache(maxsize=16)
def _assembled(layout: PhaseLayout) -> Nlp:
    """Return the program of phases with their numbers of intervals."""
    stages = []
    for index, (phase, intervals) in enumerate(layout):
        if phase.begins_with_impact:
            kept = kept_rows(impact_bounds(phase))
            stages.append(Stage(radau.impact_kind(), (), kept))
        kept = kept_rows(interval_bounds(phase.modes))
        shared = (*_SPRING, 2 + index)
        stages += [Stage(radau.interval_kind(), shared, kept)] * (intervals - 1)
        kept = kept_rows(interval_bounds(phase.modes, landing_after(layout, index)))
        stages.append(Stage(radau.interval_kind(), shared, kept))
    durations = np.concatenate([np.zeros(2), np.ones(len(layout))])
    return assemble(stages, periodic_ends(), durations.size, durations[None])


def _chain_bounds(layout: PhaseLayout) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the kept rows of all stages."""
    lower: list[FloatArray] = []
    upper: list[FloatArray] = []
    for index, (phase, intervals) in enumerate(layout):
        blocks = [impact_bounds(phase)] * phase.begins_with_impact
        blocks += [interval_bounds(phase.modes)] * (intervals - 1)
        blocks.append(interval_bounds(phase.modes, landing_after(layout, index)))
        for bounds in blocks:
            kept = kept_rows(bounds)
            lower.append(bounds[0][kept])
            upper.append(bounds[1][kept])
    return np.concatenate(lower), np.concatenate(upper)
