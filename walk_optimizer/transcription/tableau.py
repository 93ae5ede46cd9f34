"""The three-point Radau IIA method: nodes, differentiation weights, quadrature, interpolation.

[Hairer1996, section IV.5]. Plain numbers, so that a solution is evaluated without CasADi.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STAGES = 3
# Collocation points in (0, 1], and with the start of the interval before them.
NODES = np.array([(4 - np.sqrt(6)) / 10, (4 + np.sqrt(6)) / 10, 1.0])
NODES_WITH_START = np.concatenate([[0.0], NODES])


def _coefficients(nodes: FloatArray) -> FloatArray:
    """Return the matrix that turns values at nodes into coefficients of powers, lowest first."""
    coefficients: FloatArray = np.linalg.inv(np.vander(nodes, increasing=True)).astype(np.float64)
    return coefficients


# States are cubic through the start and the nodes, torques and forces quadratic through the nodes.
STATE_COEFFICIENTS = _coefficients(NODES_WITH_START)
NODE_COEFFICIENTS = _coefficients(NODES)


def _differentiation() -> FloatArray:
    """Return the derivatives at the nodes of the Lagrange polynomials of start and nodes, (3, 4)."""
    powers = np.arange(1, 4)
    return (powers * NODES[:, None] ** (powers - 1)) @ STATE_COEFFICIENTS[1:]


DIFFERENTIATION = _differentiation()
QUADRATURE = (1 / np.arange(1, 4)) @ NODE_COEFFICIENTS
# The matrix A of the Butcher tableau: values at the nodes from derivatives there.
BUTCHER = np.linalg.inv(DIFFERENTIATION[:, 1:])
