"""Solvers of the CasADi wheel that are no back ends, each with the options that served it best here."""

from typing import Any

import casadi as ca
import numpy as np

from walk_optimizer.solve.back_end import SolveOptions, ended
from walk_optimizer.solve.oracle import Oracle, extended_parameters, free_variables
from walk_optimizer.solve.solution import FloatArray, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Problem

OTHERS = {
    "sqpmethod-qrqp": "CasADi's SQP with its own sparse active-set QP, Hessian regularised",
    "sqpmethod-qpoases": "the same with qpOASES",
    "sqpmethod-piqp": "the same with PIQP, an interior point QP",
    "sqpmethod-osqp": "the same with OSQP, a first-order QP",
    "blocksqp": "blockSQP; its Hessians need the linear solver MA27, which the wheel lacks",
    "sleqp": "SLEQP, active-set with trust region",
    "alpaqa": "alpaqa, augmented Lagrangian with first-order inner solver",
    "madnlp": "MadNLP, interior point",
    "knitro": "Knitro",
    "worhp": "WORHP",
    "conopt": "CONOPT",
}

_QP = {"error_on_fail": False, "print_time": False}
_QP_OPTIONS: dict[str, dict[str, Any]] = {
    "qrqp": {"print_iter": False, "print_header": False},
    "qpoases": {"sparse": True, "schur": False, "printLevel": "none"},
    "piqp": {},
    "osqp": {"osqp": {"verbose": False}},
}


def available(name: str) -> bool:
    """Return whether CasADi can load a solver here."""
    return bool(ca.has_nlpsol(name.partition("-")[0]))


def solve_with(name: str, problem: Problem, start: FloatArray, options: SolveOptions) -> Solution:
    """Solve a program in its free variables with a solver of CasADi."""
    plugin, _, qp = name.partition("-")
    free, parameters = free_variables(problem), extended_parameters(problem)
    oracle = Oracle.of(problem.nlp, free)
    settings: dict[str, Any] = {
        "cache": _functions(oracle, plugin),
        "print_time": False,
        "error_on_fail": False,
        "calc_lam_p": False,
    }
    if plugin == "sqpmethod":
        settings |= {
            "qpsol": qp,
            "qpsol_options": _QP | _QP_OPTIONS[qp],
            "convexify_strategy": "regularize",
            "max_iter": options.maximum_iterations,
            "tol_pr": 1e-8,
            "tol_du": 1e-6,
            "print_header": False,
            "print_iteration": False,
        }
    if plugin == "blocksqp":
        # Its own choice is a solver that the wheel does not have.
        settings |= {"linsol": "mumps", "max_iter": options.maximum_iterations, "print_iteration": False}
        settings |= {"print_header": False}
    solver = ca.nlpsol("program", plugin, oracle.expressions, settings)
    result = solver(
        x0=start[free],
        p=parameters,
        lbx=problem.lower_x[free],
        ubx=problem.upper_x[free],
        lbg=problem.lower_g,
        ubg=problem.upper_g,
    )
    statistics = solver.stats()
    x = parameters[problem.parameters.size :].copy()
    x[free] = np.asarray(result["x"]).ravel()
    status = Status.SOLVED if statistics["success"] else Status.SOLVER_ERROR
    iterations = int(statistics.get("iter_count", 0))
    return ended(problem, x, status, iterations, str(statistics.get("return_status", "")))


def _functions(oracle: Oracle, plugin: str) -> dict[str, ca.Function]:
    """Return the functions that a solver looks up, in its own signatures."""
    whole = ca.triu2symm(oracle.hessian)
    functions = oracle.values()
    if plugin == "sqpmethod":
        everything = (oracle.f, oracle.gradient, oracle.g, oracle.jacobian)
        functions |= {
            "nlp_fg": oracle.function("nlp_fg", oracle.f, oracle.g),
            "nlp_jac_fg": oracle.function("nlp_jac_fg", *everything),
            "nlp_hess_l": oracle.function("nlp_hess_l", whole, multipliers=True),
        }
    elif plugin == "blocksqp":
        everything = [oracle.f, oracle.g, oracle.gradient, oracle.jacobian]
        functions |= {
            "nlp_fg": oracle.function("nlp_fg", oracle.f, oracle.g),
            # blockSQP asks for its outputs by name.
            "nlp_gf_jg": ca.Function(
                "nlp_gf_jg", [oracle.x, oracle.p], everything, ["x", "p"], ["f", "g", "grad_f_x", "jac_g_x"]
            ),
            "nlp_hess_l": oracle.function("nlp_hess_l", oracle.hessian, multipliers=True),
        }
    elif plugin in ("sleqp", "alpaqa", "conopt"):
        del functions["nlp_grad_f"]
    return functions
