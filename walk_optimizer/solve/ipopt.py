"""IPOPT by way of CasADi, with exact derivatives from outside."""

import weakref
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from walk_optimizer.solve.solution import FloatArray, IterationState, Monitor, Solution
from walk_optimizer.solve.status import Status
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


@dataclass(frozen=True)
class IpoptOptions:
    """Options of one solve.

    Attributes:
        tolerance: Scaled optimality error to reach.
        maximum_iterations: Iteration limit.
        barrier: First barrier parameter for a start that is close to a solution, which is then left
            near its bounds; None for a start that may be far from one.
    """

    tolerance: float = 1e-9
    maximum_iterations: int = 500
    barrier: float | None = None

    def for_ipopt(self) -> dict[str, Any]:
        """Return the options under IPOPT's names."""
        options: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "tol": self.tolerance,
            "max_iter": self.maximum_iterations,
            "mu_strategy": "adaptive",
            # By default every bound is widened by 1e-8, and solutions make use of it.
            "bound_relax_factor": 0.0,
        }
        if self.barrier is not None:
            push = min(1e-6, 10 * self.barrier)
            options |= {"mu_strategy": "monotone", "mu_init": self.barrier}
            options |= {"bound_push": push, "bound_frac": push}
        return options


class _Watcher(ca.Callback):
    """Passes each iteration to the monitor of the running solve."""

    def __init__(self, nlp: Nlp) -> None:
        super().__init__()
        self._sizes = tuple(nlp.expressions[name].numel() for name in ("x", "g", "p"))
        self.monitor: Monitor | None = None
        self.problem: Problem | None = None
        self.verdict: Status | None = None
        self.error: BaseException | None = None
        self.iteration = 0
        self.construct("watcher", {})

    def begin(self, problem: Problem, monitor: Monitor | None) -> None:
        """Watch a new solve."""
        self.problem, self.monitor, self.iteration = problem, monitor, -1
        self.verdict = self.error = None

    def end(self) -> None:
        """Let go of the solve, since its program keeps this watcher alive; raise what the monitor raised."""
        error, self.problem, self.monitor, self.error = self.error, None, None, None
        if error is not None:
            raise error

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, index: int) -> ca.Sparsity:
        n, m, parameters = self._sizes
        size = {"x": n, "lam_x": n, "g": m, "lam_g": m, "f": 1, "p": parameters, "lam_p": parameters}
        return ca.Sparsity.dense(size[ca.nlpsol_out(index)], 1)

    def eval(self, arguments: list[ca.DM]) -> list[int]:
        self.iteration += 1
        if self.monitor is None or self.problem is None:
            return [0]
        x, f, g = (np.asarray(arguments[k]).ravel() for k in range(3))
        state = IterationState(self.iteration, float(f[0]), self.problem.infeasibility(x, g))
        try:
            self.verdict = self.monitor(state)
        except BaseException as error:  # noqa: BLE001  # CasADi would swallow it; `end` raises it again
            self.error = error
        return [0 if self.verdict is None and self.error is None else 1]


class _Instance:
    """One IPOPT solver object for a program and options; building it costs more than a few iterations."""

    def __init__(self, nlp: Nlp, options: IpoptOptions) -> None:
        self.watcher = _Watcher(nlp)
        settings = {
            "ipopt": options.for_ipopt(),
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


_instances: weakref.WeakKeyDictionary[Nlp, dict[IpoptOptions, _Instance]] = weakref.WeakKeyDictionary()


def _instance(nlp: Nlp, options: IpoptOptions) -> _Instance:
    of_program = _instances.setdefault(nlp, {})
    if options not in of_program:
        of_program[options] = _Instance(nlp, options)
    return of_program[options]


def solve(
    problem: Problem, start: FloatArray, options: IpoptOptions, monitor: Monitor | None = None
) -> Solution:
    """Solve a program from a start.

    Args:
        problem: The program, scaled.
        start: First iterate, same shape as x.
        options: Of this solve.
        monitor: Told at each iteration, may stop the solve; what it raises is raised here.
    """
    if not np.all(np.isfinite(start)):
        return Solution(Status.EVALUATION_ERROR, start, np.nan, np.inf, 0, "the first guess is not finite")
    instance = _instance(problem.nlp, options)
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
