"""Fatrop by way of CasADi: an interior point method that factorises stage by stage [Vanroye2023].

The cost of an iteration grows linearly with the number of stages. It carries the last state and the
shared variables along all of them, see `staging`.
"""

from typing import Any

import casadi as ca
import numpy as np

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.solve.back_end import SolveOptions, ended, refused_start
from walk_optimizer.solve.instances import Instances
from walk_optimizer.solve.isolation import isolated
from walk_optimizer.solve.oracle import FloatArray, IntArray, Oracle, extended_parameters, free_variables
from walk_optimizer.solve.solution import Monitor, Solution
from walk_optimizer.solve.staging import Staging, staged_oracle
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Nlp, Problem, StageOrder

# Smaller pivots, divided by the number of stages, are left to an earlier stage: the shorter a stage, the
# less its controls can do. With a value that does not fit, fatrop's search for a factorisation of the right
# inertia may never end.
_PIVOT_TOLERANCE = 1e-2
# Fatrop widens every bound by 1e-8, and has no option against it.
_WIDENED = 1e-8


class _Instance:
    """One solver object for a program with certain free variables, and for options."""

    def __init__(self, nlp: Nlp, free: IntArray, options: SolveOptions) -> None:
        if nlp.stages is None:
            raise ConfigurationError("back end fatrop solves chains of stages; this program has none")
        oracle = Oracle.of(nlp, free)
        order = StageOrder(nlp.stages.variables[free], nlp.stages.rows)
        self.staging = Staging(oracle, order)
        staged = staged_oracle(oracle, self.staging)
        hessian = staged.function("nlp_hess_l", staged.lagrangian_gradient, staged.hessian, multipliers=True)
        derivatives = {
            "nlp_jac_g": staged.function("nlp_jac_g", staged.g, staged.jacobian),
            "nlp_hess_l": hessian,
        }
        settings: dict[str, Any] = {
            "cache": staged.values() | derivatives,
            "print_time": False,
            "error_on_fail": False,
            "show_eval_warnings": False,
            "calc_lam_p": False,
            "fatrop": {
                "print_level": 0,
                "tolerance": max(options.tolerance, _WIDENED),
                "max_iter": options.maximum_iterations,
                "linsol_lu_fact_tol": _PIVOT_TOLERANCE / self.staging.count,
            },
        }
        if options.barrier is not None:
            settings["fatrop"] |= {"mu_init": options.barrier}
        self.solver = ca.nlpsol("program", "fatrop", staged.expressions, settings | self.staging.structure)


_instances: Instances[_Instance] = Instances()


def solve(
    problem: Problem, start: FloatArray, options: SolveOptions, monitor: Monitor | None = None
) -> Solution:
    """Solve a program from a start; see `BackEnd.solve`.

    Raises:
        ConfigurationError: the program is no chain of stages.
    """
    if (refusal := refused_start(start)) is not None:
        return refusal
    free = free_variables(problem)
    key = (options, free.tobytes())
    instance = _instances.of(problem.nlp, key, lambda: _Instance(problem.nlp, free, options))
    return isolated(lambda: _solve(instance, problem, start, free, options), problem, start, monitor)


def _solve(
    instance: _Instance, problem: Problem, start: FloatArray, free: IntArray, options: SolveOptions
) -> Solution:
    staging, parameters = instance.staging, extended_parameters(problem)
    low, high = np.full(staging.width, -np.inf), np.full(staging.width, np.inf)
    low[staging.main], high[staging.main] = problem.lower_x[free], problem.upper_x[free]
    low_rows, high_rows = np.zeros(staging.height), np.zeros(staging.height)
    low_rows[staging.row_places], high_rows[staging.row_places] = problem.lower_g, problem.upper_g
    result = instance.solver(
        x0=staging.spread(start[free]), p=parameters, lbx=low, ubx=high, lbg=low_rows, ubg=high_rows
    )
    statistics = instance.solver.stats()
    iterations = statistics["iter_count"]
    if statistics["success"]:
        status = Status.SOLVED
    else:
        limit = iterations >= options.maximum_iterations
        status = Status.ITERATION_LIMIT if limit else Status.SOLVER_ERROR
    x = parameters[problem.parameters.size :].copy()
    x[free] = np.asarray(result["x"]).ravel()[staging.main]
    return ended(problem, x, status, iterations, f"return status {statistics['return_status']}")
