"""A program of few points, and the same one written down plainly."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from transcription.plain_program import REPORT_ROWS, ROWS, dense, plain_program, random_scaled_point

from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription.problems import complementarity_problem

# Unequal segments, legs of other than 1 m and stairs on a slope, so that no factor of one hides a mistake.
WALKER = WalkerParameters(
    upper_leg_length=0.55, lower_leg_length=0.35, hip_mass=30.0, terrain=Terrain(0.2, 0.07)
)


@pytest.fixture(scope="session")
def walker():
    return WALKER


@pytest.fixture(scope="session")
def request_of_three_points():
    return GaitRequest(0.3, 0.75, SpringMode.STIFFNESS_AND_EQUILIBRIUM, 3)


@pytest.fixture(scope="session")
def complementarity(request_of_three_points, walker):
    return complementarity_problem(request_of_three_points, walker, 1e-8)


@pytest.fixture(scope="session")
def plain(request_of_three_points, walker, complementarity):
    """Values and derivatives of the plain program at a random x, with random multipliers."""
    generator = np.random.default_rng(5)
    x_value = random_scaled_point(request_of_three_points, generator)
    x, objective, g = plain_program(request_of_three_points, walker)
    # The rows of the report: those of each point, and the last one.
    report = np.flatnonzero(np.arange(g.numel()) % ROWS < REPORT_ROWS)
    multipliers = np.zeros(g.numel())
    multipliers[report] = generator.normal(size=report.size)
    # The unit of the program's objective is its own choice.
    value = complementarity.nlp.gradient(x_value, complementarity.parameters)[0]
    unit = float(value) / float(ca.evalf(ca.substitute(objective, x, x_value)))
    lagrangian = 0.7 * unit * objective + ca.dot(ca.DM(multipliers), g)
    outputs = [g, ca.jacobian(g, x), ca.hessian(lagrangian, x)[0], unit * ca.gradient(objective, x)]
    values = [dense(one) for one in ca.Function("plain", [x], outputs)(x_value)]
    return SimpleNamespace(
        x=x_value,
        sigma=0.7,
        report=report,
        multipliers=multipliers,
        unit=unit,
        objective=ca.Function("objective", [x], [objective]),
        g=values[0].ravel(),
        jacobian=values[1],
        hessian=values[2],
        gradient=values[3].ravel(),
    )
