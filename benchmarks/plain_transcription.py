"""What a good engineer writes in an afternoon: the report's problem in plain CasADi `Opti` with IPOPT.

The measuring stick of `speed.py`. Variables and rows are scaled, derivatives are exact and CasADi's own,
nothing is generated or compiled. IPOPT has its adaptive barrier for far starts and a small first one for
near starts, and bounds that are not widened. It takes from the package the walker's symbolic mechanics
(`model/`: velocities, momentum rates, foot positions) and the kinematic first guesses; the transcription
shares no code with it. Mechanics written down as the gradient of the Hamiltonian took as long, within the
noise of the measurement.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.guess.kinematic import Start, kinematic_guess
from walk_optimizer.model import dynamics
from walk_optimizer.model.kinematics import foot_position
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest

FloatArray = NDArray[np.float64]
Points = tuple[FloatArray, KneeSpring]  # q, p, u, lambda and gamma in SI units, (23, N), and the spring

TOLERANCE, MAXIMUM_ITERATIONS, RELAXATION = 1e-9, 500, 1e-8  # as in config/solver.yaml
NEAR = 1e-9  # first barrier parameter of a start that is near a solution
KEPT_STARTS = 3
STATES_RELABELLED = [0, 1, 4, 5, 2, 3, 6, 7, 10, 11, 8, 9]


@dataclass(frozen=True, eq=False)
class PlainSolution:
    """Where a plain solve ended: IPOPT's words, points (23, N) in SI units, spring, iterations."""

    status: str
    points: FloatArray
    spring: KneeSpring
    iterations: int

    @property
    def solved(self) -> bool:
        """Whether IPOPT converged to its tolerance."""
        return self.status == "Solve_Succeeded"

    @property
    def objective(self) -> float:
        """F in [(N m)^2]."""
        return float(np.sum(self.points[12:15] ** 2) / 2)


@dataclass(frozen=True)
class Units:
    """Natural units of the walker: with them every variable is of order one."""

    state: FloatArray
    torque: float
    force: float
    stiffness: float

    @classmethod
    def of(cls, walker: WalkerParameters) -> "Units":
        moment, momentum = walker.weight * walker.leg_length, walker.total_mass
        state = np.array([walker.leg_length] * 2 + [1.0] * 4 + [momentum] * 2 + [momentum / 10] * 4)
        return cls(state, moment / 100, walker.weight, moment / 10)


def walker_function(walker: WalkerParameters) -> ca.Function:
    """Return (q, p, u, force, spring) -> qdot, pdot, feet (4,), their velocities (4,), in SI units."""
    q, p, u, f, spring = (ca.SX.sym(*one) for one in (("q", 6), ("p", 6), ("u", 3), ("f", 4), ("s", 2)))
    qdot = dynamics.velocity(walker, q, p)
    pdot = dynamics.momentum_rate(walker, q, qdot, u, ca.reshape(f, 2, 2), spring)
    feet = ca.vertcat(*(foot_position(walker, q, leg) for leg in range(2)))
    return ca.Function("walker", [q, p, u, f, spring], [qdot, pdot, feet, ca.jtimes(feet, q, qdot)])


def run_ipopt(opti: ca.Opti) -> tuple[str, int]:
    """Solve; return IPOPT's words and the number of iterations."""
    with suppress(RuntimeError):  # IPOPT's own words say what happened.
        opti.solve()
    return opti.stats()["return_status"], opti.stats()["iter_count"]


def prepare_ipopt(opti: ca.Opti, *, near: float | None = None, expand: bool = False) -> None:
    """Choose IPOPT with the package's options.

    Args:
        opti: The problem.
        near: First barrier parameter of a start that is near a solution; None for a far one.
        expand: Whether CasADi writes all points out as scalars: slower to build, faster to evaluate.
    """
    ipopt = {"print_level": 0, "sb": "yes", "tol": TOLERANCE, "max_iter": MAXIMUM_ITERATIONS}
    ipopt |= {"mu_strategy": "adaptive", "bound_relax_factor": 0.0}
    if near is not None:
        push = min(1e-6, 10 * near)
        ipopt |= {"mu_strategy": "monotone", "mu_init": near, "bound_push": push, "bound_frac": push}
    opti.solver("ipopt", {"print_time": False, "expand": expand, "detect_simple_bounds": True}, ipopt)


def bound_springs(opti: ca.Opti, spring_x: ca.MX, mode: SpringMode, stiffest: float) -> None:
    """Bound or fix K and q_eq, scaled, as the spring mode has it."""
    if mode is SpringMode.NONE:
        opti.subject_to(spring_x[0] == 0)
    else:
        opti.subject_to(opti.bounded(0, spring_x[0], stiffest))
    if mode is SpringMode.STIFFNESS_AND_EQUILIBRIUM:
        opti.subject_to(opti.bounded(0, spring_x[1], ca.pi))
    else:
        opti.subject_to(spring_x[1] == ca.pi)


class EulerGrid:
    """The report's grid as an `Opti` problem: states, torques, springs, dynamics, periodicity."""

    def __init__(self, request: GaitRequest, walker: WalkerParameters) -> None:
        self.request, self.walker, self.units = request, walker, Units.of(walker)
        self.opti = ca.Opti()
        self.state_x = self.opti.variable(12, request.points)
        self.torque_x = self.opti.variable(3, request.points)
        self.spring_x = self.opti.variable(2)
        self.opti.minimize(request.interval * ca.sumsqr(self.torque_x) / 2)
        self._bound()

    def _bound(self) -> None:
        opti, limit = self.opti, self.walker.hip_angle_limit
        for row in (2, 4):
            opti.subject_to(opti.bounded(-limit, self.state_x[row, :], limit))
            opti.subject_to(opti.bounded(0, self.state_x[row + 1, :], ca.pi))
        opti.subject_to(self.state_x[6, :] >= 0)
        stiffest = self.walker.stiffness_limit / self.units.stiffness
        bound_springs(opti, self.spring_x, self.request.spring_mode, stiffest)

    def add_dynamics(self, forces_x: Sequence[ca.MX]) -> tuple[list[ca.MX], list[ca.MX]]:
        """Add implicit Euler with scaled ground reactions (4,) a point; return feet and velocities, SI."""
        rates, units = walker_function(self.walker), self.units
        spring = self.spring_x * ca.DM([units.stiffness, 1.0])
        states = [self.state_x[:, i] * ca.DM(units.state) for i in range(self.request.points)]
        values = [
            rates(state[:6], state[6:], self.torque_x[:, i] * units.torque, force * units.force, spring)
            for i, (state, force) in enumerate(zip(states, forces_x, strict=True))
        ]
        step_length = values[-1][2][2] / self.walker.leg_length
        before = self.state_x[STATES_RELABELLED, -1]
        before[0] -= step_length
        for i, (qdot, pdot, _, _) in enumerate(values):
            rate = ca.vertcat(qdot, pdot) / ca.DM(units.state)
            self.opti.subject_to(self.state_x[:, i] - before == self.request.interval * rate)
            before = self.state_x[:, i]
        self.opti.subject_to(step_length >= self.request.step_length / self.walker.leg_length)
        return [one[2] for one in values], [one[3] for one in values]

    def set_start(self, start: Points) -> None:
        points, spring = start
        self.opti.set_initial(self.state_x, points[:12] / self.units.state[:, None])
        self.opti.set_initial(self.torque_x, points[12:15] / self.units.torque)
        self.opti.set_initial(self.spring_x, [spring.stiffness / self.units.stiffness, spring.equilibrium])

    def solution(self, ending: tuple[str, int], reaction: FloatArray, slip: FloatArray) -> PlainSolution:
        value = self.opti.debug.value
        states = value(self.state_x) * self.units.state[:, None]
        stiffness, equilibrium = value(self.spring_x)
        points = np.vstack([states, value(self.torque_x) * self.units.torque, reaction, slip])
        spring = KneeSpring(float(stiffness * self.units.stiffness), float(equilibrium))
        return PlainSolution(ending[0], points, spring, ending[1])


class FixedSchedule(EulerGrid):
    """Given contacts: foot 1 sticks, foot 2 is free above the ground; built once, solved from any start."""

    def __init__(
        self, request: GaitRequest, walker: WalkerParameters, *, push_off: bool = False, expand: bool = False
    ) -> None:
        """Write the problem down.

        Args:
            request: Speed, step, spring mode and grid.
            walker: The walker.
            push_off: Whether foot 2 still stands at the first point.
            expand: As for `prepare_ipopt`.
        """
        super().__init__(request, walker)
        self.force_x = self.opti.variable(4, request.points)
        feet, self.speeds = self.add_dynamics(ca.horzsplit(self.force_x))
        for i, (foot, speed) in enumerate(zip(feet, self.speeds, strict=True)):
            for leg, stands in enumerate((True, push_off and i == 0)):
                force_x = self.force_x[2 * leg : 2 * leg + 2, i]
                self._add_foot(force_x, foot[2 * leg + 1], speed[2 * leg], stands)
        prepare_ipopt(self.opti, expand=expand)

    def _add_foot(self, force_x: ca.MX, height: ca.MX, speed: ca.MX, stands: bool) -> None:
        if not stands:
            self.opti.subject_to(force_x == 0)
            self.opti.subject_to(height / self.walker.leg_length >= 0)
            return
        self.opti.subject_to(height / self.walker.leg_length == 0)
        self.opti.subject_to(speed == 0)
        cone = self.walker.friction_coefficient * force_x[1]
        self.opti.subject_to(cone - force_x[0] >= 0)
        self.opti.subject_to(cone + force_x[0] >= 0)

    def solve(self, start: Points) -> PlainSolution:
        """Solve from a start."""
        self.set_start(start)
        reaction = start[0][15:21]
        net = [reaction[0] - reaction[1], reaction[2], reaction[3] - reaction[4], reaction[5]]
        self.opti.set_initial(self.force_x, np.array(net) / self.units.force)
        ending = run_ipopt(self.opti)
        forces = self.opti.debug.value(self.force_x) * self.units.force
        parts = [(np.maximum(f[0], 0), np.maximum(-f[0], 0), f[1]) for f in (forces[:2], forces[2:])]
        slip = np.abs(self.opti.debug.value(ca.horzcat(*self.speeds)))[[0, 2]]
        return self.solution(ending, np.vstack([*parts[0], *parts[1]]), slip)


class Relaxed(EulerGrid):
    """The report's problem with each complementarity product bounded (its eqs. 5a to 5d)."""

    def __init__(self, request: GaitRequest, walker: WalkerParameters) -> None:
        super().__init__(request, walker)
        self.reaction_x = self.opti.variable(6, request.points)
        self.slip_x = self.opti.variable(2, request.points)
        self.opti.subject_to(ca.vec(self.reaction_x) >= 0)
        self.opti.subject_to(ca.vec(self.slip_x) >= 0)
        x = ca.horzsplit(self.reaction_x)
        feet, speeds = self.add_dynamics([ca.vertcat(f[0] - f[1], f[2], f[3] - f[4], f[5]) for f in x])
        for i, (foot, speed) in enumerate(zip(feet, speeds, strict=True)):
            for leg in range(2):
                force_x, gamma = x[i][3 * leg : 3 * leg + 3], self.slip_x[leg, i]
                self._add_foot(force_x, gamma, foot[2 * leg + 1], speed[2 * leg])
        prepare_ipopt(self.opti, near=NEAR, expand=True)

    def _add_foot(self, force_x: ca.MX, gamma: ca.MX, height: ca.MX, speed: ca.MX) -> None:
        forward, backward, normal = ca.vertsplit(force_x)
        cone = self.walker.friction_coefficient * normal - forward - backward
        a = ca.vertcat(height / self.walker.leg_length, cone, gamma + speed, gamma - speed)
        b = ca.vertcat(normal, gamma, forward, backward)
        self.opti.subject_to(a >= 0)
        self.opti.subject_to(a * b <= RELAXATION)

    def solve(self, start: Points) -> PlainSolution:
        """Solve from a start."""
        self.set_start(start)
        self.opti.set_initial(self.reaction_x, start[0][15:21] / self.units.force)
        self.opti.set_initial(self.slip_x, start[0][21:])
        ending, value = run_ipopt(self.opti), self.opti.debug.value
        return self.solution(ending, value(self.reaction_x) * self.units.force, value(self.slip_x))


def kinematic_points(request: GaitRequest, walker: WalkerParameters, start: Start) -> Points:
    """Return the package's kinematic first guess of a start."""
    return kinematic_guess(walker, request, start.shape), start.spring


def with_free_contacts(request: GaitRequest, walker: WalkerParameters, fixed: PlainSolution) -> PlainSolution:
    """Return the solution of the relaxed problem from one with given contacts; that one if it is no worse."""
    relaxed = Relaxed(request, walker).solve((fixed.points, fixed.spring))
    best = relaxed if relaxed.solved and relaxed.objective < fixed.objective else fixed
    return replace(best, iterations=fixed.iterations + relaxed.iterations)


def search(request: GaitRequest, walker: WalkerParameters, starts: Sequence[Start]) -> PlainSolution | None:
    """Return the best gait of several starts; None if none of them converges.

    All starts are solved with plain single support, the best few with the push-off of foot 2 too, and the
    best of all starts the relaxed problem, as the package does.
    """
    swing = FixedSchedule(request, walker, expand=True)
    found = [swing.solve(kinematic_points(request, walker, start)) for start in starts]
    best = sorted((one for one in found if one.solved), key=lambda one: one.objective)[:KEPT_STARTS]
    if not best:
        return None
    pushing = FixedSchedule(request, walker, push_off=True, expand=True)
    pushed = [pushing.solve((one.points, one.spring)) for one in best]
    optima = [*best, *(one for one in pushed if one.solved)]
    start = min(optima, key=lambda one: one.objective)
    ended = with_free_contacts(request, walker, start)
    before = sum(one.iterations for one in [*found, *pushed])
    return replace(ended, iterations=ended.iterations + before - start.iterations)
