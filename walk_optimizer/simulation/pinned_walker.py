"""The walker in single support: its stance foot is a pivot, and four joint angles are all that moves.

A foot that sticks removes two of the six degrees of freedom. With q = q(theta) of the joint angles theta =
(q3, q4, q5, q6), the hip being where leg 1 puts it, Lagrange's equations read

    M_r thetadd + d/dt(M_r) thetad = d(T - V)/dtheta + B_r u + J_hip' push + stop,    M_r = J' M J

[Westervelt2007] section 3.4. The state x is (theta, thetad), (8,).
"""

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model import dynamics
from walk_optimizer.model.kinematics import RELABELLED, foot_position, mass_positions
from walk_optimizer.model.linear import solved
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.simulation.settings import KneeStop

FloatArray = NDArray[np.float64]

STATE_WIDTH, ANGLES, SPEEDS = 8, slice(0, 4), slice(4, 8)
KNEES = (1, 3)
# The stance leg's angles trade places with the swing leg's as the legs change names.
_RELABELLED_ANGLES = [row - 2 for row in RELABELLED[2:]]


class _Symbols:
    """The motion about a stance foot at the origin, as CasADi expressions."""

    def __init__(self) -> None:
        """Write the equations down."""
        self.walker = SymbolicWalker()
        self.x, self.u = ca.SX.sym("x", STATE_WIDTH), ca.SX.sym("u", 3)
        self.push, self.stop, self.spring = ca.SX.sym("push"), ca.SX.sym("stop", 2), ca.SX.sym("spring", 2)
        self.theta, self.omega = self.x[ANGLES], self.x[SPEEDS]
        floating = ca.vertcat(0, 0, self.theta)
        self.q = ca.vertcat(-foot_position(self.walker, floating, 0), self.theta)
        self.hip_jacobian = ca.jacobian(self.q[:2], self.theta)
        self.masses = mass_positions(self.walker, self.q)
        velocities = [(mass, ca.jtimes(position, self.theta, self.omega)) for mass, position in self.masses]
        self.kinetic = sum(mass / 2 * ca.sumsqr(velocity) for mass, velocity in velocities)
        self.potential = dynamics.potential_energy(self.walker, self.q, self.spring)
        self.acceleration = self._acceleration()

    def _acceleration(self) -> ca.SX:
        """Return thetadd, (4,)."""
        jacobians = [(mass, ca.jacobian(position, self.theta)) for mass, position in self.masses]
        matrix = sum(mass * jacobian.T @ jacobian for mass, jacobian in jacobians)
        momentum_drift = ca.jtimes(matrix, self.theta, self.omega) @ self.omega
        torque = ca.DM(dynamics.INPUT_MAP[2:]) @ self.u + self.hip_jacobian[0, :].T * self.push
        torque += self._stop_torque()
        force = ca.gradient(self.kinetic - self.potential, self.theta)
        return solved(matrix, force - momentum_drift + torque)

    def _stop_torque(self) -> ca.SX:
        """Return the torque -k d (1 + c dd), never forward, of a knee bent d backward [Hunt1975]."""
        torque = ca.SX.zeros(4)
        for knee in KNEES:
            depth = ca.fmax(self.theta[knee] - ca.pi, 0)
            torque[knee] = -self.stop[0] * depth * ca.fmax(1 + self.stop[1] * self.omega[knee], 0)
        return torque

    @property
    def rate(self) -> ca.SX:
        """Rate of the state, (8,)."""
        return ca.vertcat(self.omega, self.acceleration)

    @property
    def reaction(self) -> ca.SX:
        """Ground reaction on the stance foot: what accelerates all masses, less weight and push, (2,)."""
        force = ca.vertcat(-self.push, self.walker.gravity * self.walker.total_mass)
        for mass, position in self.masses:
            velocity = ca.jtimes(position, self.theta, self.omega)
            force += mass * ca.jtimes(velocity, self.x, self.rate)
        return force

    def touch_down(self) -> tuple[ca.SX, ca.SX]:
        """Return the state after touch-down (8,) and the impulse (2,).

        Foot 2 sticks, foot 1 is let go: M (qd+ - qd-) = J_2' L and J_2 qd+ = 0 [Westervelt2007] section
        3.4.2, report eq. (5). Then the legs change names.
        """
        free = ca.SX.sym("q", 6)
        landing = ca.substitute(dynamics.foot_jacobian(self.walker, free, 1), free, self.q)
        matrix = ca.substitute(dynamics.mass_matrix(self.walker, free), free, self.q)
        before = ca.jtimes(self.q, self.theta, self.omega)
        give = solved(matrix, landing.T)
        impulse = -solved(landing @ give, landing @ before)
        after = before + give @ impulse
        state = ca.vertcat(self.theta[_RELABELLED_ANGLES], after[2:][_RELABELLED_ANGLES])
        return state, impulse


@cache
def _functions() -> dict[str, ca.Function]:
    """Return all quantities as functions of (x, u, push, stop, spring, walker)."""
    model = _Symbols()
    rate, swing_foot = model.rate, foot_position(model.walker, model.q, 1)
    after, impulse = model.touch_down()
    quantities = {
        "rate": [rate],
        "state_jacobian": [ca.jacobian(rate, model.x), ca.jacobian(rate, model.u)],
        "reaction": [model.reaction],
        "hip": [model.q[:2], ca.jacobian(model.q[:2], model.x)],
        "swing_foot": [swing_foot, ca.jacobian(swing_foot, model.x)],
        "touch_down": [after, impulse],
        "touch_down_jacobian": [ca.jacobian(after, model.x)],
        "energy": [model.kinetic + model.potential],
    }
    inputs = [model.x, model.u, model.push, model.stop, model.spring, model.walker.symbols]
    dense = {name: [ca.densify(value) for value in values] for name, values in quantities.items()}
    return {name: ca.Function(name, inputs, values, {"cse": True}) for name, values in dense.items()}


class _Call:
    """A function on arrays that stay where they are: a call costs no more than its operations."""

    def __init__(self, function: ca.Function, parameters: list[FloatArray]) -> None:
        """Connect the arrays."""
        self._buffer, self._evaluate = function.buffer()
        self._x, self._u, self._push = np.zeros(STATE_WIDTH), np.zeros(3), np.zeros(1)
        for index, values in enumerate([self._x, self._u, self._push, *parameters]):
            self._buffer.set_arg(index, values.data)
        # CasADi writes column after column.
        sizes = [function.size_out(index) for index in range(function.n_out())]
        self._results = [np.zeros((columns, rows)) for rows, columns in sizes]
        for index, result in enumerate(self._results):
            self._buffer.set_res(index, result.data)

    def __call__(self, x: FloatArray, u: FloatArray | float, push: float) -> list[FloatArray]:
        """Return the results as new arrays."""
        self._x[:], self._u[:], self._push[0] = x, u, push
        self._evaluate()
        return [result.T.copy() for result in self._results]


class PinnedWalker:
    """A walker with its knee springs and stops on its stance foot, as functions of arrays."""

    def __init__(self, walker: WalkerParameters, spring: KneeSpring, stop: KneeStop | None = None) -> None:
        """Take the parameters.

        Args:
            walker: The walker.
            spring: Its knee springs.
            stop: What keeps its knees from bending backward; None leaves them free to.
        """
        self.walker, self.spring, self.stop = walker, spring, stop
        stop_numbers = [0.0, 0.0] if stop is None else [stop.stiffness, stop.damping]
        # The motion about a stance foot does not depend on the ground.
        parameters = (stop_numbers, [spring.stiffness, spring.equilibrium], walker.vector(1.0))
        self._parameters = [np.array(values) for values in parameters]
        self._calls: dict[str, _Call] = {}

    def _evaluate(
        self, name: str, x: FloatArray, u: FloatArray | float = 0.0, push: float = 0.0
    ) -> list[FloatArray]:
        if name not in self._calls:
            self._calls[name] = _Call(_functions()[name], self._parameters)
        return self._calls[name](x, u, push)

    def rate(self, x: FloatArray, u: FloatArray, push: float = 0.0) -> FloatArray:
        """Return the rate of the state (8,) under torques in [N m], (3,), and a push on the hip in [N]."""
        return self._evaluate("rate", x, u, push)[0][:, 0]

    def linearized(self, x: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of the rate by the state (8, 8) and by the torques (8, 3)."""
        state, torque = self._evaluate("state_jacobian", x, u)
        return state, torque

    def reaction(self, x: FloatArray, u: FloatArray, push: float = 0.0) -> FloatArray:
        """Return the ground reaction along and normal to the ground in [N], (2,)."""
        force = self._evaluate("reaction", x, u, push)[0][:, 0]
        components: FloatArray = self.walker.terrain.along_and_normal(force)
        return components

    def hip(self, x: FloatArray) -> FloatArray:
        """Return the hip from the stance foot in [m], (2,)."""
        return self._evaluate("hip", x)[0][:, 0]

    def hip_gradient(self, x: FloatArray) -> FloatArray:
        """Return the derivative of the hip's horizontal position by the state, (8,)."""
        gradient: FloatArray = self._evaluate("hip", x)[1][0]
        return gradient

    def swing_foot(self, x: FloatArray) -> FloatArray:
        """Return the swing foot from the stance foot in [m], (2,)."""
        return self._evaluate("swing_foot", x)[0][:, 0]

    def swing_foot_jacobian(self, x: FloatArray) -> FloatArray:
        """Return the derivative of the swing foot by the state, (2, 8)."""
        return self._evaluate("swing_foot", x)[1]

    def touch_down(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what landing on the swing foot does.

        Returns:
            The state after it with the legs' names changed, (8,), and the impulse along and normal to the
            ground in [N s], (2,).
        """
        state, impulse = (value[:, 0] for value in self._evaluate("touch_down", x))
        return state, self.walker.terrain.along_and_normal(impulse)

    def touch_down_jacobian(self, x: FloatArray) -> FloatArray:
        """Return the derivative of the state after touch-down by that before, (8, 8)."""
        return self._evaluate("touch_down_jacobian", x)[0]

    def energy(self, x: FloatArray) -> float:
        """Return kinetic energy, weight's and springs' potential in [J]; that of the stops is left out."""
        return float(self._evaluate("energy", x)[0][0, 0])
