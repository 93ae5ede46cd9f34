"""The accurate solution in plain CasADi `Opti`: three-point Radau collocation with impacts, free durations.

The measuring stick of `speed.py` for gaits on the refined grid. Its phases and mesh are those of a refined
gait of the package; mechanics, scaling and IPOPT's options are those of `plain_transcription.py`.
"""

from dataclasses import dataclass
from itertools import groupby

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from plain_transcription import (
    STATES_RELABELLED,
    Units,
    bound_springs,
    prepare_ipopt,
    run_ipopt,
    walker_function,
)

from walk_optimizer.gait import RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters

FloatArray = NDArray[np.float64]
Feet = tuple[bool, bool]

IMPULSE_DURATION = 0.1  # impulses are of the order of weight times this, in [s]
SHORTEST_PHASE = 1e-3
NEAR = 1e-5  # first barrier parameter of a start from another speed
POINTS = ca.collocation_points(3, "radau")


@dataclass(frozen=True, eq=False)
class PlainPhase:
    """A part of a step between changes of contact.

    Attributes:
        parts: Lengths of its intervals as parts of the phase.
        standing: Which feet stand in it.
        struck: Which feet take an impulse as it begins.
        landing: Which feet come down then.
    """

    parts: FloatArray
    standing: Feet
    struck: Feet
    landing: Feet


def phases_of(trajectory: RefinedTrajectory) -> list[PlainPhase]:
    """Return the phases of a refined solution, read off its forces and impulses."""

    def feet(forces: FloatArray) -> Feet:
        return bool(np.any(forces[..., :2])), bool(np.any(forces[..., 2:]))

    number, key = 0, []
    for index in range(trajectory.intervals):
        changed = index and feet(trajectory.forces[index]) != feet(trajectory.forces[index - 1])
        number += bool(changed or (index and trajectory.impulses[index].any()))
        key.append(number)
    phases = []
    before = feet(trajectory.forces[-1])[::-1]
    for _, group in groupby(range(trajectory.intervals), key.__getitem__):
        members = list(group)
        struck, standing = feet(trajectory.impulses[members[0]]), feet(trajectory.forces[members])
        landing = (struck[0] and not before[0], struck[1] and not before[1])
        lengths = trajectory.lengths[members]
        phases.append(PlainPhase(lengths / lengths.sum(), standing, struck, landing))
        before = standing
    return phases


@dataclass(frozen=True, eq=False)
class PlainRefinedSolution:
    """Where a plain solve ended: IPOPT's words, the step, spring, iterations."""

    status: str
    trajectory: RefinedTrajectory
    spring: KneeSpring
    iterations: int


class PlainRefined:
    """The problem of given phases for any speed; built once, solved from any start."""

    def __init__(self, mode: SpringMode, walker: WalkerParameters, phases: list[PlainPhase]) -> None:
        """Write the problem down; step length and time are its parameters."""
        self.walker, self.units, self.phases = walker, Units.of(walker), phases
        self.opti, self.function = ca.Opti(), walker_function(walker)
        self.step_length, self.step_time = self.opti.parameter(), self.opti.parameter()
        self.spring_x = self.opti.variable(2)
        self.duration = self.opti.variable(len(phases))
        self.impulse_x = self.opti.variable(4, len(phases))
        count = sum(phase.parts.size for phase in phases)
        # States at the three nodes of each interval side by side, and so torques and forces.
        self.state_x = self.opti.variable(12, 3 * count)
        self.torque_x = self.opti.variable(3, 3 * count)
        self.force_x = self.opti.variable(4, 3 * count)
        self.start_x = self.opti.variable(12, len(phases))
        bound_springs(self.opti, self.spring_x, mode, walker.stiffness_limit / self.units.stiffness)
        self.opti.subject_to(self.duration >= SHORTEST_PHASE)
        self.opti.subject_to(ca.sum1(self.duration) == self.step_time)
        self._bound()
        self.opti.minimize(self._add_phases())
        prepare_ipopt(self.opti, near=NEAR, expand=True)

    def _bound(self) -> None:
        limit = self.walker.hip_angle_limit
        for row in (2, 4):
            self.opti.subject_to(self.opti.bounded(-limit, self.state_x[row, :], limit))
            self.opti.subject_to(self.opti.bounded(0, self.state_x[row + 1, :], ca.pi))
        self.opti.subject_to(self.state_x[6, :] >= 0)

    def _add_phases(self) -> ca.MX:
        """Add all phases; return the objective."""
        last = self.state_x[:, -1]
        landed = self._at(last, ca.MX.zeros(3), ca.MX.zeros(4))[2][2]
        self.opti.subject_to(landed / self.walker.leg_length >= self.step_length / self.walker.leg_length)
        before = last[STATES_RELABELLED]
        before[0] -= landed / self.walker.leg_length
        cost, place = 0, 0
        for index, phase in enumerate(self.phases):
            start = self.start_x[:, index]
            self._add_impact(index, phase, before, start)
            for number, part in enumerate(phase.parts):
                landing = self._landing_after(index) if number == phase.parts.size - 1 else (False, False)
                length = part * self.duration[index]
                cost += self._add_interval(place, start, length, phase.standing, landing)
                start = self.state_x[:, 3 * place + 2]
                place += 1
            before = start
        return cost

    def _landing_after(self, index: int) -> Feet:
        """Return which feet land as a phase ends; the legs change names at the end of the step."""
        if index + 1 < len(self.phases):
            return self.phases[index + 1].landing
        return self.phases[0].landing[::-1]

    def _add_impact(self, index: int, phase: PlainPhase, before: ca.MX, after: ca.MX) -> None:
        """Join a phase to the one before: feet that land stop, momentum jumps by J' impulse."""
        impulse_x = self.impulse_x[:, index]
        impulse = impulse_x * self.units.force * IMPULSE_DURATION
        free = self._at(after, ca.MX.zeros(3), ca.MX.zeros(4))
        pushed = self._at(after, ca.MX.zeros(3), impulse)
        jump = ca.vertcat(ca.MX.zeros(6), pushed[1] - free[1]) / ca.DM(self.units.state)
        self.opti.subject_to(after - before - jump == 0)
        for leg in range(2):
            own = impulse_x[2 * leg : 2 * leg + 2]
            if not phase.struck[leg]:
                self.opti.subject_to(own == 0)
                continue
            self.opti.subject_to(free[3][2 * leg : 2 * leg + 2] == 0)
            self._add_cone(own)
            if phase.landing[leg]:
                self.opti.subject_to(free[2][2 * leg + 1] / self.walker.leg_length == 0)

    def _add_interval(self, place: int, start: ca.MX, length: ca.MX, standing: Feet, landing: Feet) -> ca.MX:
        """Add one interval; return its part of the objective."""
        columns = range(3 * place, 3 * place + 3)
        slopes, _, weights = ca.collocation_coeff(POINTS)
        nodes = ca.horzcat(start, self.state_x[:, columns.start : columns.stop])
        derivatives = ca.mtimes(nodes, slopes)
        cost = 0
        for node, column in enumerate(columns):
            # The impact pins a foot that lands; its last node must not be bounded once more.
            rates = self._add_node(column, standing, landing if node == 2 else (False, False))
            self.opti.subject_to(derivatives[:, node] == length * rates)
            cost += length * weights[node] * ca.sumsqr(self.torque_x[:, column]) / 2
        return cost

    def _add_node(self, column: int, standing: Feet, landing: Feet) -> ca.MX:
        """Add the contacts of a collocation point; return the scaled rates of its state."""
        force_x, units = self.force_x[:, column], self.units
        torque, force = self.torque_x[:, column] * units.torque, force_x * units.force
        qdot, pdot, feet, speeds = self._at(self.state_x[:, column], torque, force)
        for leg in range(2):
            own = slice(2 * leg, 2 * leg + 2)
            if standing[leg]:
                self.opti.subject_to(speeds[own] == 0)
                self._add_cone(force_x[own])
                continue
            self.opti.subject_to(force_x[own] == 0)
            if not landing[leg]:
                self.opti.subject_to(feet[2 * leg + 1] / self.walker.leg_length >= 0)
        return ca.vertcat(qdot, pdot) / ca.DM(units.state)

    def _add_cone(self, force_x: ca.MX) -> None:
        cone = self.walker.friction_coefficient * force_x[1]
        self.opti.subject_to(cone - force_x[0] >= 0)
        self.opti.subject_to(cone + force_x[0] >= 0)

    def _at(self, state_x: ca.MX, torque: ca.MX, force: ca.MX) -> list[ca.MX]:
        state = state_x * ca.DM(self.units.state)
        spring = self.spring_x * ca.DM([self.units.stiffness, 1.0])
        return self.function(state[:6], state[6:], torque, force, spring)

    def solve(self, start: RefinedGait, step_length: float, step_time: float) -> PlainRefinedSolution:
        """Solve for a step of given length in [m] and time in [s] from a refined gait of another speed."""
        opti, old, units = self.opti, start.trajectory, self.units
        opti.set_value(self.step_length, step_length)
        opti.set_value(self.step_time, step_time)
        first = np.cumsum([0, *(phase.parts.size for phase in self.phases)])
        opti.set_initial(self.spring_x, [start.spring.stiffness / units.stiffness, start.spring.equilibrium])
        opti.set_initial(self.duration, np.diff(old.breaks[first]) * step_time / old.step_time)
        opti.set_initial(self.state_x, old.states[:, 1:].reshape(-1, 12).T / units.state[:, None])
        opti.set_initial(self.start_x, old.states[first[:-1], 0].T / units.state[:, None])
        opti.set_initial(self.torque_x, old.torques.reshape(-1, 3).T / units.torque)
        opti.set_initial(self.force_x, old.forces.reshape(-1, 4).T / units.force)
        opti.set_initial(self.impulse_x, old.impulses[first[:-1]].T / (units.force * IMPULSE_DURATION))
        status, iterations = run_ipopt(opti)
        return self._solution(status, iterations, first)

    def _solution(self, status: str, iterations: int, first: NDArray[np.int64]) -> PlainRefinedSolution:
        value, units = self.opti.debug.value, self.units
        durations = np.atleast_1d(value(self.duration))
        lengths = [phase.parts * time for phase, time in zip(self.phases, durations, strict=True)]
        nodes = (value(self.state_x) * units.state[:, None]).T.reshape(-1, 3, 12)
        begins = value(self.start_x).reshape(12, -1) * units.state[:, None]
        starts = np.concatenate([nodes[:1, -1], nodes[:-1, -1]])
        starts[first[:-1]] = begins.T
        impulses = np.zeros((nodes.shape[0], 4))
        impulses[first[:-1]] = value(self.impulse_x).reshape(4, -1).T * units.force * IMPULSE_DURATION
        trajectory = RefinedTrajectory(
            breaks=np.concatenate([[0.0], np.cumsum(np.concatenate(lengths))]),
            states=np.concatenate([starts[:, None], nodes], axis=1),
            torques=(value(self.torque_x) * units.torque).T.reshape(-1, 3, 3),
            forces=(value(self.force_x) * units.force).T.reshape(-1, 3, 4),
            impulses=impulses,
        )
        stiffness, equilibrium = value(self.spring_x)
        spring = KneeSpring(float(stiffness * units.stiffness), float(equilibrium))
        return PlainRefinedSolution(status, trajectory, spring, iterations)
