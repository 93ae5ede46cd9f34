"""opty on the same walker: backward Euler like the report's grid, but with a smooth contact.

opty has no complementarity: the ground is a stiff spring with friction smoothed over a small slip speed, so
feet sink in and creep. States are q and p, as in the package, so that only contact differs. IPOPT gets no
second derivatives. The switch to the other leg is written as instance constraints.
"""

from typing import Any

import numpy as np
import sympy as sm
from measurements import Clock, FloatArray, Score, score_points, walker
from plain_transcription import MAXIMUM_ITERATIONS

from walk_optimizer.guess.kinematic import kinematic_guess
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.request import GaitRequest

SINKING = 5e-3  # depth under the whole weight in [m]
ROUNDING = 1e-3  # height over which contact sets in, in [m]
DAMPING = 0.75  # of the normal force per speed of the foot, in [s/m]
SLIP_SPEED = 0.1  # over which friction sets in, in [m/s]
RELABELLED = (0, 1, 4, 5, 2, 3)


def opty(request: GaitRequest, time_limit: float) -> Score:
    """Solve with smooth contact from the same kinematic guess."""
    from opty import Problem

    clock = Clock()
    parameters, nodes = walker(), request.points + 1
    time_symbol = sm.Symbol("t")
    states = [sm.Function(name)(time_symbol) for name in _names()]
    torques = [sm.Function(f"u{k}")(time_symbol) for k in range(1, 4)]
    motion, forces = _equations(parameters, states, torques, time_symbol)
    guess, first_torque = _guess(parameters, request), 12 * nodes

    def objective(free: FloatArray) -> float:
        return request.interval * float(np.sum(free[first_torque:] ** 2)) / 2

    def gradient(free: FloatArray) -> FloatArray:
        values = np.zeros_like(free)
        values[first_torque:] = request.interval * free[first_torque:]
        return values

    problem = Problem(
        objective,
        gradient,
        motion,
        states,
        nodes,
        request.interval,
        instance_constraints=_periodicity(states, request, guess),
        bounds=_bounds(parameters, states),
        time_symbol=time_symbol,
    )
    for name, value in {
        "max_wall_time": float(time_limit),
        "max_iter": 20 * MAXIMUM_ITERATIONS,
        "tol": 1e-6,
        "print_level": 0,
    }.items():
        problem.add_option(name, value)
    free, info = problem.solve(guess.ravel())
    points = _points(parameters, request, free, states, torques, forces)
    status = info["status_msg"]
    spring = kinematic_starts(parameters, request.spring_mode)[0].spring
    return score_points(clock.read(), request, points, spring, status.decode(), len(problem.obj_value))


def _names() -> list[str]:
    return [f"{kind}{k}" for kind in "qp" for k in range(1, 7)]


def _equations(
    body: WalkerParameters, states: list[Any], torques: list[Any], time_symbol: Any
) -> tuple[Any, Any]:
    """Return the implicit equations of motion, scaled, and the ground reactions (4,) in [N].

    p = dT/dqdot and pdot = dT/dq - dV/dq + B u + J' f, with the kinetic co-energy T(q, qdot).
    """
    q, v = sm.symbols("q1:7"), sm.symbols("v1:7")
    masses, feet = _bodies(body, q)

    def speed(position: Any) -> Any:
        return position.jacobian(q) * sm.Matrix(v)

    kinetic = sum(mass / 2 * speed(place).dot(speed(place)) for mass, place in masses)
    potential = sum(mass * body.gravity * place[1] for mass, place in masses)
    forces = [_ground_reaction(body, foot, speed(foot)) for foot in feet]
    u = sm.symbols("u1:4")
    loads = sm.Matrix([0, 0, u[0], u[1], -u[0], u[2]])
    for foot, force in zip(feet, forces, strict=True):
        loads += foot.jacobian(q).T * force
    momentum = sm.Matrix([kinetic.diff(one) for one in v])
    load = sm.Matrix([(kinetic - potential).diff(one) for one in q]) + loads
    rates = {symbol: state.diff(time_symbol) for symbol, state in zip(v, states, strict=False)}
    named = dict(zip((*q, *u), (*states[:6], *torques), strict=True))
    p = sm.Matrix(states[6:])
    rows = [(momentum.subs(rates | named) - p) / body.total_mass]
    rows.append((p.diff(time_symbol) - load.subs(rates | named)) / body.weight)
    return sm.Matrix.vstack(*rows), sm.lambdify([q, v], sm.Matrix.vstack(*forces), cse=True)


def _bodies(body: WalkerParameters, q: Any) -> tuple[list[Any], list[Any]]:
    """Return (mass, position) of the point masses, and the positions of the feet."""

    def along(angle: Any) -> Any:
        return sm.Matrix([sm.sin(angle), -sm.cos(angle)])

    hip = sm.Matrix(q[:2])
    masses, feet = [(body.hip_mass, hip)], []
    for upper, knee in ((q[2], q[3]), (q[4], q[5])):
        thigh = body.upper_leg_length * along(upper)
        shank = -body.lower_leg_length * along(upper + knee)  # the angle pi is a stretched knee
        masses.append((body.upper_leg_mass, hip + thigh / 2))
        masses.append((body.lower_leg_mass, hip + thigh + shank / 2))
        feet.append(hip + thigh + shank)
    return masses, feet


def _ground_reaction(body: WalkerParameters, foot: Any, velocity: Any) -> Any:
    """Return the force of the smooth ground on a foot, x and y in [N]."""
    depth = (sm.sqrt(foot[1] ** 2 + ROUNDING**2) - foot[1]) / 2
    normal = body.weight / SINKING * depth * (1 - DAMPING * velocity[1])
    friction = -body.friction_coefficient * normal * sm.tanh(velocity[0] / SLIP_SPEED)
    return sm.Matrix([friction, normal])


def _periodicity(states: list[Any], request: GaitRequest, guess: FloatArray) -> tuple[Any, ...]:
    """Return the relabelled periodicity, and where the step begins."""
    end = request.step_time
    at_start = [state.func(0.0) for state in states]
    at_end = [states[6 * (k >= 6) + RELABELLED[k % 6]].func(end) for k in range(12)]
    rows = [start - last for start, last in zip(at_start, at_end, strict=True)]
    rows[0] += request.step_length
    return (*rows, at_start[0] - float(guess[0, 0]))


def _bounds(body: WalkerParameters, states: list[Any]) -> dict[Any, tuple[float, float]]:
    limit = body.hip_angle_limit
    hips, knees = (states[2], states[4]), (states[3], states[5])
    return dict.fromkeys(hips, (-limit, limit)) | dict.fromkeys(knees, (0.0, np.pi)) | {states[6]: (0.0, 1e4)}


def _guess(body: WalkerParameters, request: GaitRequest) -> FloatArray:
    """Return the kinematic guess as states and torques at the start and at all points, (15, N + 1)."""
    points = kinematic_guess(body, request, kinematic_starts(body, request.spring_mode)[0].shape)
    rows = [*RELABELLED, *(6 + k for k in RELABELLED)]
    before = points[rows, -1]
    before[0] -= request.step_length
    return np.column_stack([np.append(before, points[12:15, 0]), points[:15]])


def _points(
    body: WalkerParameters, request: GaitRequest, free: FloatArray, states: Any, torques: Any, forces: Any
) -> FloatArray:
    """Return opty's solution as the package's points, (23, N), forces and slips being those of its ground."""
    values = free.reshape(len(states) + len(torques), -1)
    q, v = values[:6, 1:], np.diff(values[:6], axis=1) / request.interval
    reaction = np.array([np.ravel(forces(*pair)) for pair in zip(q.T, v.T, strict=True)]).T
    slips = np.array([_foot_speed(body, q, v, leg) for leg in range(2)])
    parts = [
        (np.maximum(reaction[k], 0), np.maximum(-reaction[k], 0), np.maximum(reaction[k + 1], 0))
        for k in (0, 2)
    ]
    return np.vstack([values[:, 1:], *parts[0], *parts[1], np.abs(slips)])


def _foot_speed(body: WalkerParameters, q: FloatArray, v: FloatArray, leg: int) -> FloatArray:
    """Return the forward speed of a foot in [m/s], (N,)."""
    upper, knee = q[2 + 2 * leg], q[3 + 2 * leg]
    rate, knee_rate = v[2 + 2 * leg], v[3 + 2 * leg]
    thigh = body.upper_leg_length * np.cos(upper) * rate
    return v[0] + thigh - body.lower_leg_length * np.cos(upper + knee) * (rate + knee_rate)
