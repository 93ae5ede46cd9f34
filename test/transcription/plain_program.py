"""The report's program written down plainly, for few points: one expression, derivatives by CasADi.

Shares only the units of variables and rows with the package: mechanics are those of the Hamiltonian
1/2 p' M^-1 p + V, differentiated as it stands.
"""

import casadi as ca
import numpy as np

from walk_optimizer.transcription.scaling import point_units, row_units, spring_units

# Columns and rows of a point; the first of its rows are the report's.
POINT, ROWS, REPORT_ROWS = 23, 32, 28


def leg_points(walker, q, leg):
    """Middle of the upper leg, middle of the lower leg, and foot."""
    upper = q[2 + 2 * leg]
    lower = upper + q[3 + 2 * leg] - ca.pi
    down = ca.vertcat(ca.sin(upper), -ca.cos(upper)) * walker.upper_leg_length
    further = ca.vertcat(ca.sin(lower), -ca.cos(lower)) * walker.lower_leg_length
    return q[:2] + down / 2, q[:2] + down + further / 2, q[:2] + down + further


def hamiltonian(walker, q, p, spring):
    masses = [(walker.hip_mass, q[:2])]
    for leg in range(2):
        upper, lower, _ = leg_points(walker, q, leg)
        masses += [(walker.upper_leg_mass, upper), (walker.lower_leg_mass, lower)]
    jacobians = [(mass, ca.jacobian(position, q)) for mass, position in masses]
    matrix = sum(mass * ca.mtimes(jacobian.T, jacobian) for mass, jacobian in jacobians)
    qdot = ca.ldl_solve(p, *ca.ldl(matrix))
    potential = sum(mass * walker.gravity * position[1] for mass, position in masses)
    potential += spring[0] / 2 * ((q[3] - spring[1]) ** 2 + (q[5] - spring[1]) ** 2)
    return ca.dot(p, qdot) / 2 + potential, qdot


def ground_height(terrain, tread, x):
    stairs = terrain.step_up * (x / tread - ca.sin(2 * ca.pi * x / tread) / (2 * ca.pi))
    return x * np.tan(terrain.slope) + stairs


def point_rows(walker, request):
    """(point, state before, spring) -> 12 dynamics, 8 sides a, 8 products a b, 4 of cones, in SI units."""
    tangent = ca.DM([np.cos(walker.terrain.slope), np.sin(walker.terrain.slope)])
    across = ca.DM([-np.sin(walker.terrain.slope), np.cos(walker.terrain.slope)])
    point, before, spring = ca.SX.sym("point", POINT), ca.SX.sym("before", 12), ca.SX.sym("spring", 2)
    q, p, u, reaction, gamma = ca.vertsplit(point, [0, 6, 12, 15, 21, 23])
    energy, qdot = hamiltonian(walker, q, p, spring)
    pdot = -ca.gradient(energy, q) + ca.vertcat(0, 0, u[0], u[1], -u[0], u[2])
    sides = []
    for leg in range(2):
        foot = leg_points(walker, q, leg)[2]
        jacobian = ca.jacobian(foot, q)
        forward, backward, normal = ca.vertsplit(reaction[3 * leg : 3 * leg + 3])
        pdot += ca.mtimes(jacobian.T, (forward - backward) * tangent + normal * across)
        slip = ca.dot(tangent, ca.mtimes(jacobian, qdot))
        above = foot[1] - ground_height(walker.terrain, request.step_length, foot[0])
        sides += [
            (above * np.cos(walker.terrain.slope), normal),
            (walker.friction_coefficient * normal - forward - backward, gamma[leg]),
            (gamma[leg] + slip, forward),
            (gamma[leg] - slip, backward),
        ]
    defects = point[:12] - before - request.interval * ca.vertcat(qdot, pdot)
    cones = []
    for leg in range(2):
        forward, backward, normal = (point[15 + 3 * leg + k] for k in range(3))
        limit = walker.friction_coefficient * normal
        cones += [limit - forward + backward, limit + forward - backward]
    rows = ca.vertcat(defects, *(a for a, _ in sides), *(a * b for a, b in sides), *cones)
    return ca.Function("point_rows", [point, before, spring], [rows])


def plain_program(request, walker):
    """Scaled x -> (F in [(N m)^2], scaled rows of all points and the scaled step length)."""
    x = ca.MX.sym("x", POINT * request.points + 2)
    units, spring_unit = ca.DM(point_units(walker)), ca.DM(spring_units(walker))
    points = ca.horzcat(*(x[POINT * i : POINT * (i + 1)] * units for i in range(request.points)))
    rows, spring = point_rows(walker, request), x[-2:] * spring_unit
    last = points[:, -1]
    foot = ca.MX.sym("q", 6)
    landing = ca.Function("landing", [foot], [leg_points(walker, foot, 1)[2][0]])(last[:6])
    relabelled = [0, 1, 4, 5, 2, 3]
    before = ca.vertcat(last[relabelled], last[[6 + row for row in relabelled]])
    before[0] -= landing
    before[1] -= ground_height(walker.terrain, request.step_length, landing)
    g = []
    for i in range(request.points):
        g.append(rows(points[:, i], before, spring) / ca.DM(row_units(walker)))
        before = points[:12, i]
    objective = ca.sumsqr(points[12:15, :]) / 2
    return x, objective, ca.vertcat(*g, landing / walker.leg_length)


def random_scaled_point(request, generator):
    """A scaled x away from any solution."""
    x = generator.normal(0.0, 0.5, POINT * request.points + 2)
    x[-2:] = 0.3, 3.0
    return x


def dense(matrix):
    return np.asarray(ca.densify(matrix))
