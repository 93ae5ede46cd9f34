"""IPOPT by way of CasADi, with exact derivatives from outside."""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from walk_optimizer.multifrontal.library import factorization_library, use_threads
from walk_optimizer.solve.back_end import SolveOptions, refused_start
from walk_optimizer.solve.instances import Instances
from walk_optimizer.solve.sharing import free_processors
from walk_optimizer.solve.solution import FloatArray, Monitor, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.solve.watcher import Watcher
from walk_optimizer.transcription.program import Nlp, Problem

_STATUS = {
    "Solve_Succeeded": Status.SOLVED,
    "Solved_To_Acceptable_Level": Status.ACCEPTABLE_ONLY,
    "Infeasible_Problem_Detected": Status.INFEASIBLE,
    "Maximum_Iterations_Exceeded": Status.ITERATION_LIMIT,
    "Restoration_Failed": Status.INFEASIBLE,
    "Search_Direction_Becomes_Too_Small": Status.ACCEPTABLE_ONLY,
    "Invalid_Number_Detected": Status.EVALUATION_ERROR,
}

# First barrier parameter for a start that may be far from a solution. From kinematic guesses larger ones,
# and IPOPT's adaptive choice, end in worse optima more often, and some solves take several times as long.
_FAR_BARRIER = 1e-4
# A start that is near a solution is moved off its bounds by no more than this part of their distance.
_LARGEST_PUSH = 1e-4


@dataclass(frozen=True)
class IpoptOptions(SolveOptions):
    """Options of a solve by IPOPT alone.

    Attributes:
        further: Names and values of IPOPT's own options, in place of ours for the barrier parameter.
    """

    further: tuple[tuple[str, str | float], ...] = ()


def _linear_solver() -> dict[str, str | int]:
    """Return what makes IPOPT load our factorisation, which answers to the name ma97."""
    library = factorization_library()
    if library is None:
        # Approximate minimum degree: a third faster on chains of stages than the ordering that MUMPS picks.
        return {"linear_solver": "mumps", "mumps_pivot_order": 0}
    return {
        "linear_solver": "ma97",
        "hsllib": str(library),
        "ma97_scaling": "none",
        "linear_system_scaling": "none",
    }


def _settings(options: SolveOptions) -> dict[str, Any]:
    """Return the options under IPOPT's names."""
    settings: dict[str, Any] = {
        "print_level": 0,
        "sb": "yes",
        "tol": options.tolerance,
        "max_iter": options.maximum_iterations,
        # By default every bound is widened by 1e-8, and solutions make use of it.
        "bound_relax_factor": 0.0,
        # Solutions are refined where their residual asks for it, not always.
        "min_refinement_steps": 0,
        # Multipliers of rows come with the first iteration. Least squares give no better ones, and on chains
        # of thousands of stages their linear system takes as long as fifty iterations.
        "constr_mult_init_max": 0.0,
        **_linear_solver(),
    }
    if isinstance(options, IpoptOptions):
        return settings | dict(options.further)
    return settings | _strategy(options.barrier)


def far_strategy(barrier: float) -> dict[str, str | float]:
    """Return how the barrier parameter goes down from `barrier` for a start that may be far away."""
    return {"mu_strategy": "monotone", "mu_init": barrier, "expect_infeasible_problem": "yes"}


def _strategy(barrier: float | None) -> dict[str, str | float]:
    """Return how the barrier parameter begins and goes down: from `barrier`, None for a far start."""
    if barrier is None:
        return far_strategy(_FAR_BARRIER)
    push = min(_LARGEST_PUSH, 10 * barrier)
    return {
        "mu_strategy": "adaptive",
        "mu_init": barrier,
        "mu_max": 10 * barrier,
        "bound_push": push,
        "bound_frac": push,
        # Multipliers of bounds as they are at this barrier parameter, not all alike.
        "bound_mult_init_method": "mu-based",
        # A second right-hand side per factorisation, for the error of the first step in the products of
        # bounds and multipliers [Mehrotra1992]: a seventh fewer iterations.
        "corrector_type": "affine",
    }


class _Instance:
    """One IPOPT solver object for a program and options."""

    def __init__(self, nlp: Nlp, options: SolveOptions) -> None:
        self.watcher = Watcher(nlp.expressions)
        settings = {
            "ipopt": _settings(options),
            "print_time": False,
            "error_on_fail": False,
            "show_eval_warnings": False,
            "no_nlp_grad": True,
            "calc_lam_p": False,
            "jac_g": nlp.jacobian,
            "hess_lag": nlp.hessian,
            "grad_f": nlp.gradient,
            "iteration_callback": self.watcher,
        }
        self.solver = ca.nlpsol("program", "ipopt", nlp.expressions, settings)


_instances: Instances[_Instance] = Instances()


def solve(
    problem: Problem, start: FloatArray, options: SolveOptions, monitor: Monitor | None = None
) -> Solution:
    """Solve a program from a start.

    Args:
        problem: The program, scaled.
        start: First iterate, same shape as x.
        options: Of this solve.
        monitor: Told at each iteration, may stop the solve; what it raises is raised here.
    """
    if (refusal := refused_start(start)) is not None:
        return refusal
    instance = _instances.of(problem.nlp, options, lambda: _Instance(problem.nlp, options))
    use_threads(free_processors())
    instance.watcher.begin(problem, monitor)
    try:
        result = instance.solver(
            x0=start,
            p=problem.parameters,
            lbx=problem.lower_x,
            ubx=problem.upper_x,
            lbg=problem.lower_g,
            ubg=problem.upper_g,
        )
    finally:
        instance.watcher.end()
    statistics = instance.solver.stats()
    detail = statistics["return_status"]
    status = instance.watcher.verdict or _STATUS.get(detail, Status.SOLVER_ERROR)
    x, g = (np.asarray(result[name]).ravel() for name in ("x", "g"))
    infeasibility, iterations = problem.infeasibility(x, g), statistics["iter_count"]
    return Solution(status, x, float(result["f"]), infeasibility, iterations, detail)
