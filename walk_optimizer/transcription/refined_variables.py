"""Where the variables of contact phases on collocation intervals stand, and their bounds."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transcription import radau
from walk_optimizer.transcription.layout import STATE_WIDTH
from walk_optimizer.transcription.mesh import SHORTEST_PHASE, Mesh, RefinedPoints
from walk_optimizer.transcription.phase_bounds import force_bounds
from walk_optimizer.transcription.problems import state_bounds
from walk_optimizer.transcription.scaling import point_units, spring_units, torque_unit
from walk_optimizer.transcription.tableau import STAGES

FloatArray = NDArray[np.float64]

# The first of the shared variables are K and q_eq, then follows the duration of each phase in [s].
SPRING_VARIABLES = (0, 1)
_UNLIMITED = np.full(3, np.inf)


class RefinedVariables:
    """The variables of a chain of phases on a mesh: impacts and intervals, then the shared ones."""

    def __init__(self, walker: WalkerParameters, mesh: Mesh) -> None:
        """Lay the variables out.

        Args:
            walker: The walker; it gives the units.
            mesh: Phases and intervals.
        """
        self.walker, self.mesh = walker, mesh
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
        return self.shared_start + len(SPRING_VARIABLES) + len(self.mesh.phases)

    def own_numbers(self) -> FloatArray:
        """Return the own number of each stage: its part of the phase, 0 for an impact."""
        pairs = zip(self.mesh.phases, self.mesh.parts, strict=True)
        return np.concatenate(
            [np.concatenate([np.zeros(int(phase.begins_with_impact)), parts]) for phase, parts in pairs]
        )

    def bounds(
        self, springs: tuple[KneeSpring, KneeSpring], torque_limit: FloatArray = _UNLIMITED
    ) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of all variables, scaled.

        Args:
            springs: Least and largest K and q_eq.
            torque_limit: Largest magnitudes of u1, u2 and u3 in [N m], (3,).
        """
        count, phases = self.mesh.intervals, len(self.mesh.phases)
        states = state_bounds(self.walker)
        modes = [self.mesh.phases[k].modes for k in self.mesh.phase_of_interval]
        least = least_vertical_force(self.walker)
        forces = np.array([force_bounds(one, least) for one in modes]).transpose(1, 0, 2)
        impulses = np.array([force_bounds(phase.impact) for phase in self.mesh.phases]).transpose(1, 0, 2)
        lower, upper = (
            self.pack(
                RefinedPoints(
                    states=np.broadcast_to(states[side], (count, STAGES + 1, STATE_WIDTH)),
                    torques=np.full((count, STAGES, 3), (-torque_limit, torque_limit)[side]),
                    forces=np.repeat(forces[side][:, None, :], STAGES, axis=1),
                    durations=np.full(phases, (SHORTEST_PHASE, np.inf)[side]),
                    impulses=impulses[side],
                    spring=springs[side],
                )
            )
            for side in range(2)
        )
        # The state after an impact has the angles of the one before it, which has bounds of its own.
        for place in (one for one in self.impact_start if one is not None):
            lower[place : place + 6], upper[place : place + 6] = -np.inf, np.inf
        return lower, upper

    def last_state_columns(self) -> slice:
        """Return which variables are the last state."""
        start = int(self.interval_start[-1]) + (STAGES - 1) * STATE_WIDTH
        return slice(start, start + STATE_WIDTH)

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

    def unpack(self, x: FloatArray, before: FloatArray) -> RefinedPoints:
        """Return the values of the scaled vector of all variables.

        Args:
            x: All variables.
            before: The state (12,) that is handed to the first stage.
        """
        inside = x[self.interval_start[:, None] + np.arange(radau.INTERVAL_WIDTH)]
        count = self.mesh.intervals
        nodes = inside[:, : radau.TORQUE_START].reshape(count, STAGES, STATE_WIDTH) * self.state_unit
        torques = inside[:, radau.TORQUE_START : radau.FORCE_START].reshape(count, STAGES, 3)
        forces = inside[:, radau.FORCE_START :].reshape(count, STAGES, 4)
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
            durations=x[self.shared_start + len(SPRING_VARIABLES) :],
            impulses=impulses,
            spring=KneeSpring(float(stiffness), float(equilibrium)),
        )


def least_vertical_force(walker: WalkerParameters) -> float:
    """Return a vertical force in [N] within the friction cone that loads a foot as it has to be.

    On a slope a, n = f_y cos a - f_x sin a is the normal force and t, |t| <= mu n, the tangential one: then
    f_y = n cos a + t sin a <= n (cos a + mu |sin a|).
    """
    slope = walker.terrain.slope
    widest = np.cos(slope) + walker.friction_coefficient * abs(np.sin(slope))
    return float(walker.stance_load * walker.weight * widest)
