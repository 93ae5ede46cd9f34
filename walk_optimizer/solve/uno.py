"""Uno's filter SQP by way of CasADi: few iterations, each one an exact quadratic program [Vanaret2024].

Its quadratic programs are solved by an active-set method, so that its solutions lie exactly on their
bounds, at a cost that grows faster than the number of grid points.
"""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from walk_optimizer.solve.back_end import SolveOptions, ended, refused_start
from walk_optimizer.solve.instances import Instances
from walk_optimizer.solve.oracle import IntArray, Oracle, extended_parameters, free_variables
from walk_optimizer.solve.solution import FloatArray, Monitor, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.solve.watcher import Watcher
from walk_optimizer.transcription.program import Nlp, Problem

_STATUS = {
    "Converged with feasible KKT point": Status.SOLVED,
    "Converged with feasible FJ point": Status.ACCEPTABLE_ONLY,
    "Terminated with feasible small step": Status.ACCEPTABLE_ONLY,
    "Converged with infeasible stationary point": Status.INFEASIBLE,
    "Terminated with infeasible small step": Status.INFEASIBLE,
}
# In double precision its quadratic programs are not solved more closely than this.
_TIGHTEST = 1e-7


class _LagrangianGradient(ca.Callback):
    """The gradient of the Lagrangian with the derivative that CasADi can't find in compiled functions."""

    def __init__(self, oracle: Oracle) -> None:
        super().__init__()
        self._oracle = oracle
        self._value = oracle.function("value", oracle.lagrangian_gradient, multipliers=True)
        self.construct("nlp_grad_l", {})

    def get_n_in(self) -> int:
        """Return the number of inputs: x, p, sigma, lam."""
        return 4

    def get_n_out(self) -> int:
        """Return the number of outputs."""
        return 1

    def get_sparsity_in(self, index: int) -> ca.Sparsity:
        """Return the pattern of an input."""
        return self._value.sparsity_in(index)

    def get_sparsity_out(self, index: int) -> ca.Sparsity:
        """Return the pattern of the output."""
        return self._value.sparsity_out(index)

    def eval(self, arguments: list[ca.DM]) -> list[ca.DM]:
        """Return the gradient."""
        return [self._value(*arguments)]

    def has_forward(self, count: int) -> bool:
        """Return whether there is a derivative for so many seeds at once."""
        return count == 1

    def get_forward(
        self, _: int, name: str, inputs: list[str], outputs: list[str], options: dict[str, Any]
    ) -> ca.Function:
        """Return the product of the Hessian and the seed of x; CasADi gives no other seeds."""
        one = self._oracle
        symbols = [one.x, one.p, one.sigma, one.lam]
        seeds = [ca.MX.sym("seed", symbol.numel()) for symbol in symbols]
        product = ca.densify(ca.mtimes(ca.triu2symm(one.hessian), seeds[0]))
        value = ca.MX.sym("value", one.x.numel())
        return ca.Function(name, [*symbols, value, *seeds], [product], inputs, outputs, options)


class _Instance:
    """One solver object for a program with certain free variables, and for options."""

    def __init__(self, nlp: Nlp, free: IntArray, options: SolveOptions) -> None:
        oracle = Oracle.of(nlp, free)
        self.watcher = Watcher(oracle.expressions, oracle.function("values", oracle.f, oracle.g))
        self._gradient = _LagrangianGradient(oracle)
        jacobian = oracle.function("nlp_jac_g", oracle.jacobian)
        hessian = oracle.function("nlp_hess_l", oracle.hessian, multipliers=True)
        derivatives = {"nlp_jac_g": jacobian, "nlp_hess_l": hessian, "nlp_grad_l": self._gradient}
        tolerance = max(options.tolerance, _TIGHTEST)
        settings = {
            "cache": oracle.values() | derivatives,
            "print_time": False,
            "error_on_fail": False,
            "show_eval_warnings": False,
            "calc_lam_p": False,
            "iteration_callback": self.watcher,
            "uno": {
                "preset": "filtersqp",
                "logger": "SILENT",
                "max_iterations": options.maximum_iterations,
                "primal_tolerance": tolerance,
                "dual_tolerance": tolerance,
            },
        }
        self.solver = ca.nlpsol("program", "uno", oracle.expressions, settings)


_instances: Instances[_Instance] = Instances()


def solve(
    problem: Problem, start: FloatArray, options: SolveOptions, monitor: Monitor | None = None
) -> Solution:
    """Solve a program from a start; see `BackEnd.solve`."""
    if (refusal := refused_start(start)) is not None:
        return refusal
    free, parameters = free_variables(problem), extended_parameters(problem)
    key = (options, free.tobytes())
    instance = _instances.of(problem.nlp, key, lambda: _Instance(problem.nlp, free, options))
    reduced = replace(
        problem, parameters=parameters, lower_x=problem.lower_x[free], upper_x=problem.upper_x[free]
    )
    instance.watcher.begin(reduced, monitor)
    try:
        result = instance.solver(
            x0=start[free],
            p=parameters,
            lbx=reduced.lower_x,
            ubx=reduced.upper_x,
            lbg=problem.lower_g,
            ubg=problem.upper_g,
        )
    except RuntimeError:
        # Uno gives up by an exception where its quadratic programs fail, and tells no iterate then.
        status = instance.watcher.verdict or Status.SOLVER_ERROR
        return ended(problem, start, status, max(instance.watcher.iteration, 0), "an exception within Uno")
    finally:
        instance.watcher.end()
    statistics = instance.solver.stats()
    detail, iterations = statistics["return_status"], statistics["iter_count"]
    limit = Status.ITERATION_LIMIT if iterations >= options.maximum_iterations else Status.SOLVER_ERROR
    status = instance.watcher.verdict or _STATUS.get(detail, limit)
    x = parameters[problem.parameters.size :].copy()
    x[free] = np.asarray(result["x"]).ravel()
    return ended(problem, x, status, iterations, detail)
