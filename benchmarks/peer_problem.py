"""The report's problem with CasADi's sparse derivatives, as other solvers take it.

Variables are q, p, u, lambda and gamma of each point, scaled, then K and q_eq. The rows of a point are its
12 defects of implicit Euler, the sides a of its 8 complementarity pairs, and their products a b; the sides b
are variables. One more row is the step length.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from plain_transcription import STATES_RELABELLED, Units, walker_function

from walk_optimizer.contact.observation import slip_velocities
from walk_optimizer.guess.kinematic import Start, kinematic_guess
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest

FloatArray = NDArray[np.float64]

POINT, ROWS, DEFECTS, PAIRS = 23, 28, 12, 8
# Places of the sides b in a point: lambda_y, gamma, lambda_x+, lambda_x- of each foot.
SIDES_B = [17, 21, 15, 16, 20, 22, 18, 19]


def step_function(request: GaitRequest, walker: WalkerParameters) -> ca.Function:
    """Return (state before, point, spring) -> the rows of a point, and the landing distance in legs."""
    units = Units.of(walker)
    before, point, spring = ca.SX.sym("before", DEFECTS), ca.SX.sym("point", POINT), ca.SX.sym("spring", 2)
    state, torque = point[:12] * units.state, point[12:15] * units.torque
    x = point[15:21]
    force = ca.vertcat(x[0] - x[1], x[2], x[3] - x[4], x[5]) * units.force
    physical_spring = spring * ca.DM([units.stiffness, 1.0])
    qdot, pdot, feet, speeds = walker_function(walker)(state[:6], state[6:], torque, force, physical_spring)
    defects = point[:12] - before - request.interval * ca.vertcat(qdot, pdot) / units.state
    sides = []
    for leg in range(2):
        normal, gamma, forward, backward = ca.vertsplit(point[SIDES_B[4 * leg : 4 * leg + 4]])
        cone = walker.friction_coefficient * normal - forward - backward
        slip = speeds[2 * leg]
        sides += [feet[2 * leg + 1] / walker.leg_length, cone, gamma + slip, gamma - slip]
    a = ca.vertcat(*sides)
    rows = ca.vertcat(defects, a, a * point[SIDES_B])
    return ca.Function("step", [before, point, spring], [rows, feet[2] / walker.leg_length])


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of variables and rows."""

    lower_x: FloatArray
    upper_x: FloatArray
    lower_g: FloatArray
    upper_g: FloatArray


class PeerProblem:
    """The problem of a request: values, exact sparse derivatives, bounds, first guess."""

    def __init__(self, request: GaitRequest, walker: WalkerParameters) -> None:
        self.request, self.walker, self.units = request, walker, Units.of(walker)
        self.points = request.points
        self.x, self.f, self.g = self._expressions()
        self.size, self.rows = self.x.numel(), self.g.numel()

    def _expressions(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        step = step_function(self.request, self.walker)
        points, spring = ca.SX.sym("points", POINT, self.points), ca.SX.sym("spring", 2)
        length = step(ca.SX.zeros(DEFECTS), points[:, -1], spring)[1]
        before = points[STATES_RELABELLED, -1]
        before[0] -= length
        rows = []
        for i in range(self.points):
            rows.append(step(before, points[:, i], spring)[0])
            before = points[:DEFECTS, i]
        cost = self.request.interval * ca.sumsqr(points[12:15, :]) / 2
        return ca.vertcat(ca.vec(points), spring), cost, ca.vertcat(*rows, length)

    def _bounds(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return bounds of points (23, N) and rows (28, N): dynamics and joint limits; no contact yet."""
        low, high = np.full((POINT, self.points), -np.inf), np.full((POINT, self.points), np.inf)
        for row in (2, 4):
            low[row], high[row] = -self.walker.hip_angle_limit, self.walker.hip_angle_limit
            low[row + 1], high[row + 1] = 0.0, np.pi
        low[6] = 0.0
        low[15:] = 0.0
        low_g, high_g = np.full((ROWS, self.points), -np.inf), np.full((ROWS, self.points), np.inf)
        low_g[:DEFECTS] = high_g[:DEFECTS] = 0.0
        return low, high, low_g, high_g

    def _packed(self, low: FloatArray, high: FloatArray, low_g: FloatArray, high_g: FloatArray) -> Bounds:
        spring = np.array([0.0, np.pi])  # without springs: the peers' problem is `none`
        step_length = self.request.step_length / self.walker.leg_length
        return Bounds(
            np.append(low.ravel(order="F"), spring),
            np.append(high.ravel(order="F"), spring),
            np.append(low_g.ravel(order="F"), step_length),
            np.append(high_g.ravel(order="F"), np.inf),
        )

    def given_contacts(self) -> Bounds:
        """Return the bounds by which foot 1 sticks and foot 2 swings."""
        low, high, low_g, high_g = self._bounds()
        a = DEFECTS
        low_g[a] = high_g[a] = 0.0
        low_g[a + 1] = 0.0
        low_g[a + 2] = high_g[a + 2] = 0.0
        high[21] = 0.0
        low_g[a + 4] = 0.0
        high[18:21] = high[22] = 0.0
        return self._packed(low, high, low_g, high_g)

    def free_contacts(self, relaxation: float) -> Bounds:
        """Return the bounds with each product a b at most `relaxation`."""
        low, high, low_g, high_g = self._bounds()
        low_g[DEFECTS : DEFECTS + PAIRS] = 0.0
        high_g[DEFECTS + PAIRS :] = relaxation
        return self._packed(low, high, low_g, high_g)

    def start(self, start: Start) -> FloatArray:
        """Return the package's kinematic first guess."""
        points = kinematic_guess(self.walker, self.request, start.shape) / self._point_units()[:, None]
        return np.append(points.ravel(order="F"), [start.spring.stiffness, start.spring.equilibrium])

    def unpack(self, x: FloatArray) -> tuple[FloatArray, KneeSpring]:
        """Return points (23, N) in SI units and the spring."""
        points = x[:-2].reshape(POINT, -1, order="F") * self._point_units()[:, None]
        return points, KneeSpring(float(x[-2] * self.units.stiffness), float(x[-1]))

    def with_slips(self, x: FloatArray) -> FloatArray:
        """Return x with the least gamma that the pairs allow, the slip: given contacts leave it out."""
        points, spring = self.unpack(x)
        points[21:] = np.abs(slip_velocities(self.walker, points[:6], points[6:12]))
        scaled = points / self._point_units()[:, None]
        return np.append(
            scaled.ravel(order="F"), [spring.stiffness / self.units.stiffness, spring.equilibrium]
        )

    def _point_units(self) -> FloatArray:
        units = self.units
        return np.concatenate([units.state, [units.torque] * 3, [units.force] * 6, [1.0] * 2])


class SparseFunction:
    """An expression of x (and more) as values of nonzeros, with their places."""

    def __init__(self, inputs: list[ca.SX], expression: ca.SX) -> None:
        self._function = ca.Function("values", inputs, [expression.nz[:]])
        rows, columns = expression.sparsity().get_triplet()
        self.rows, self.columns = np.array(rows), np.array(columns)

    def __call__(self, *values: FloatArray | float) -> FloatArray:
        """Return the values of the nonzeros."""
        return self._function(*values).full().ravel()
