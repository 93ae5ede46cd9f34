"""The refined problem: Radau collocation of each contact phase, impacts between them, free durations."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.model.kinematics import KNEE_1, KNEE_2, UPPER_1, UPPER_2
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription import radau
from walk_optimizer.transcription.boundary import boundary_functions
from walk_optimizer.transcription.chain import STATE_WIDTH, Stage, assemble
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.phases import Modes, Phase
from walk_optimizer.transcription.problems import spring_bounds
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.scaling import point_units, spring_units, torque_unit
from walk_optimizer.transcription.tableau import NODES_WITH_START, STAGES

FloatArray = NDArray[np.float64]

# Shared variables: K, q_eq, then the duration of each phase in [s].
_SPRING = (0, 1)
_SHORTEST_PHASE = 1e-3
# Rows of contact in a point or an impact, two of each: gaps, velocities along x and y, sides of cones.
_GAP, _TANGENTIAL, _NORMAL, _CONE = 0, 2, 4, 6


@dataclass(frozen=True, eq=False)
class RefinedPoints:
    """Values of all variables of the refined grid in SI units.

    Attributes:
        states: At the start of each interval and at its nodes, (n, 4, 12): q, then p.
        torques: At the nodes of each interval in [N m], (n, 3, 3).
        forces: Ground reactions at the nodes in [N], (n, 3, 4): x, y of foot 1, then of foot 2.
        durations: Of each phase in [s].
        impulses: Of each phase's impact in [N s], (phases, 4); zero where there is none.
        spring: K and q_eq.
    """

    states: FloatArray
    torques: FloatArray
    forces: FloatArray
    durations: FloatArray
    impulses: FloatArray
    spring: KneeSpring


@dataclass(frozen=True, eq=False)
class Mesh:
    """Phases with their intervals.

    Attributes:
        phases: The contact phases of the step.
        parts: For each phase the lengths of its intervals as parts of it; they add up to 1.
    """

    phases: tuple[Phase, ...]
    parts: tuple[FloatArray, ...]

    @property
    def intervals(self) -> int:
        """Number of intervals of the step."""
        return sum(part.size for part in self.parts)

    @property
    def phase_of_interval(self) -> NDArray[np.int64]:
        """Index of the phase of each interval, (n,)."""
        return np.repeat(np.arange(len(self.phases)), [part.size for part in self.parts])

    @property
    def first_intervals(self) -> NDArray[np.int64]:
        """Index of the first interval of each phase."""
        return self.phase_of_interval.searchsorted(np.arange(len(self.phases)))

    def node_times(self, durations: FloatArray) -> FloatArray:
        """Return the times of the start and the nodes of each interval in [s], (n, 4)."""
        lengths = self.lengths(durations)
        starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        times: FloatArray = starts[:, None] + lengths[:, None] * NODES_WITH_START
        return times

    def divided(self, counts: NDArray[np.int64]) -> "Mesh":
        """Return the mesh with each interval cut into equal parts; `counts` is (n,)."""
        of_phases = np.split(counts, self.first_intervals[1:])
        pairs = zip(self.parts, of_phases, strict=True)
        return Mesh(self.phases, tuple(np.repeat(part / count, count) for part, count in pairs))

    def lengths(self, durations: FloatArray) -> FloatArray:
        """Return the lengths of all intervals in [s], (n,), for durations of the phases in [s]."""
        return np.concatenate([part * time for part, time in zip(self.parts, durations, strict=True)])


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
        state_low, state_high = self._state_bounds()
        modes = [self.mesh.phases[k].modes for k in self.mesh.phase_of_interval]
        force_low, force_high = np.array([_force_bounds(one) for one in modes]).transpose(1, 0, 2)
        free = np.full((count, STAGES, 3), np.inf)
        impulses = np.array([_force_bounds(phase.impact) for phase in self.mesh.phases]).transpose(1, 0, 2)
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

    def _state_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of a state, (12,) each, in SI units (report section IV)."""
        lower = np.full(STATE_WIDTH, -np.inf)
        upper = -lower
        for row in (UPPER_1, UPPER_2):
            lower[row], upper[row] = -self.walker.hip_angle_limit, self.walker.hip_angle_limit
        for row in (KNEE_1, KNEE_2):
            lower[row], upper[row] = 0.0, np.pi
        lower[6] = 0.0
        return lower, upper

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
    function = compiled(boundary_functions)["boundary_value"]
    units = np.array(point_units(walker)[:STATE_WIDTH], dtype=float)
    before: FloatArray = np.asarray(function(state / units, walker.vector())).ravel()[:STATE_WIDTH] * units
    return before


_Layout = tuple[tuple[Phase, int], ...]


@lru_cache(maxsize=16)
def _assembled(layout: _Layout) -> Nlp:
    """Return the program of phases with their numbers of intervals."""
    stages = []
    for index, (phase, intervals) in enumerate(layout):
        if phase.begins_with_impact:
            kept = _kept(_impact_bounds(phase))
            stages.append(Stage(radau.impact_kind(), (), kept))
        kept = _kept(_interval_bounds(phase.modes))
        shared = (*_SPRING, 2 + index)
        stages += [Stage(radau.interval_kind(), shared, kept)] * (intervals - 1)
        kept = _kept(_interval_bounds(phase.modes, _landing_after(layout, index)))
        stages.append(Stage(radau.interval_kind(), shared, kept))
    durations = np.concatenate([np.zeros(2), np.ones(len(layout))])
    return assemble(stages, durations.size, durations[None])


def _chain_bounds(layout: _Layout) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the kept rows of all stages."""
    lower: list[FloatArray] = []
    upper: list[FloatArray] = []
    for index, (phase, intervals) in enumerate(layout):
        blocks = [_impact_bounds(phase)] * phase.begins_with_impact
        blocks += [_interval_bounds(phase.modes)] * (intervals - 1)
        blocks.append(_interval_bounds(phase.modes, _landing_after(layout, index)))
        for bounds in blocks:
            kept = _kept(bounds)
            lower.append(bounds[0][kept])
            upper.append(bounds[1][kept])
    return np.concatenate(lower), np.concatenate(upper)


_RowBounds = tuple[FloatArray, FloatArray]


def _kept(bounds: _RowBounds) -> NDArray[np.bool_]:
    """Return which rows have a bound."""
    return np.isfinite(bounds[0]) | np.isfinite(bounds[1])


def _landing_after(layout: _Layout, index: int) -> tuple[bool, bool]:
    """Return which feet land at the end of a phase; the legs change names at the last."""
    last = index == len(layout) - 1
    first, second = layout[0 if last else index + 1][0].landing
    return (second, first) if last else (first, second)


def _interval_bounds(modes: Modes, landing: tuple[bool, bool] = (False, False)) -> _RowBounds:
    """Return the bounds of an interval's rows: dynamics, then contacts at each node.

    The impact after it pins the gap of a landing foot, so the last node must not bound it once more.
    """
    contact = _contact_bounds(modes)
    dynamics = np.zeros(STAGES * STATE_WIDTH)
    low, high = (np.concatenate([dynamics, *[side] * STAGES]) for side in contact)
    last_gaps = low[-radau.CONTACT_ROWS :][_GAP : _GAP + 2]
    last_gaps[list(landing)] = -np.inf
    return low, high


def _impact_bounds(phase: Phase) -> _RowBounds:
    """Return the bounds of an impact's rows: momentum, then contacts.

    A landing foot is on the ground. One that stood before is there already: to pin it once more
    would ask twice for the same.
    """
    contact = _contact_bounds(phase.impact)
    low, high = (np.concatenate([np.zeros(STATE_WIDTH), side]) for side in contact)
    for foot in range(2):
        gap = STATE_WIDTH + _GAP + foot
        low[gap], high[gap] = (0.0, 0.0) if phase.landing[foot] else (-np.inf, np.inf)
    return low, high


def _contact_bounds(modes: Modes) -> _RowBounds:
    """Return the bounds of the contact rows, (10,) each.

    A foot that stands has zero velocity, one in the air stays above the ground. One that slips has
    its tangential force on the side of the cone against it.
    """
    low, high = np.full(radau.CONTACT_ROWS, -np.inf), np.full(radau.CONTACT_ROWS, np.inf)

    def pin(row: int) -> None:
        low[row] = high[row] = 0.0

    for foot, mode in enumerate(modes):
        if mode is FootMode.FREE:
            low[_GAP + foot] = 0.0
            continue
        pin(_NORMAL + foot)
        # Rows of the cone: mu f_y - f_x, then mu f_y + f_x.
        low[_CONE + 2 * foot : _CONE + 2 * foot + 2] = 0.0
        if mode is FootMode.STICK:
            pin(_TANGENTIAL + foot)
        elif mode is FootMode.SLIP_FORWARD:
            low[_TANGENTIAL + foot] = 0.0
            pin(_CONE + 2 * foot + 1)
        else:
            high[_TANGENTIAL + foot] = 0.0
            pin(_CONE + 2 * foot)
    return low, high


def _force_bounds(modes: Sequence[FootMode]) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of forces or impulses, (4,) each: none on a free foot, no pulling."""
    loaded = np.repeat([mode is not FootMode.FREE for mode in modes], 2)
    high = np.where(loaded, np.inf, 0.0)
    return np.where([True, False, True, False], -high, 0.0), high
