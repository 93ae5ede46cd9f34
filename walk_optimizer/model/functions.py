"""The symbolic model as numerical functions of arrays."""

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model import dynamics, kinematics
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker

FloatArray = NDArray[np.float64]

# No quantity of the model depends on the ground.
_ANY_TREAD = 1.0


@cache
def _model_functions() -> dict[str, ca.Function]:
    walker = SymbolicWalker()
    q, p, spring = ca.SX.sym("q", 6), ca.SX.sym("p", 6), ca.SX.sym("spring", 2)
    qdot = dynamics.velocity(walker, q, p)
    feet = [kinematics.foot_position(walker, q, leg) for leg in range(2)]
    quantities = {
        "mass_matrix": dynamics.mass_matrix(walker, q),
        "velocity": qdot,
        "force": dynamics.generalized_force(walker, q, qdot, spring),
        "feet": ca.horzcat(*feet),
        "foot_velocities": ca.horzcat(*(ca.jacobian(foot, q) @ qdot for foot in feet)),
        "energy": dynamics.kinetic_energy(walker, q, qdot) + dynamics.potential_energy(walker, q, spring),
    }
    inputs = [q, p, walker.symbols, spring]
    return {name: ca.Function(name, inputs, [value]) for name, value in quantities.items()}


def model_function(name: str) -> ca.Function:
    """Return one quantity of the model as a CasADi function of q, p, the walker's vector and (K, q_eq).

    Args:
        name: `mass_matrix` (6, 6), `velocity` (6,), `force` -dH/dq (6,), `feet` (2, 2) columns are
            feet, `foot_velocities` (2, 2), `energy` the Hamiltonian.
    """
    return _model_functions()[name]


def evaluate(
    name: str,
    walker: WalkerParameters,
    q: FloatArray,
    p: FloatArray,
    spring: tuple[float, float] = (0.0, 0.0),
) -> FloatArray:
    """Return a quantity of the model at each of N states.

    None of them depends on the ground, so neither does the result.

    Args:
        name: As for `model_function`.
        walker: The walker.
        q: Coordinates, (6, N).
        p: Momenta, (6, N).
        spring: (K, q_eq).

    Returns:
        Shape (N, rows, columns), columns left out where there is one.
    """
    function, count = model_function(name), q.shape[1]
    rows, columns = function.size_out(0)
    parameters = np.tile(walker.vector(_ANY_TREAD), (count, 1)).T
    values = function.map(count)(q, p, parameters, np.tile(spring, (count, 1)).T)
    stacked: FloatArray = np.asarray(values).reshape(rows, count, columns).transpose(1, 0, 2)
    return stacked[:, :, 0] if columns == 1 else stacked


def mass_matrices(walker: WalkerParameters, q: FloatArray) -> FloatArray:
    """Return M(q) at each of N configurations (6, N), as (N, 6, 6)."""
    return evaluate("mass_matrix", walker, q, np.zeros_like(q))
