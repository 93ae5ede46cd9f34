"""Other solvers on the report's problem: pympcc, pounce, and SNOPT through Drake.

Each function runs in a process of its own and imports its solver there. It returns the last iterate, good or
bad, for the package's certificate to judge.
"""

from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from measurements import Clock, Score, score_points, walker
from peer_problem import (
    DEFECTS,
    PAIRS,
    POINT,
    ROWS,
    SIDES_B,
    Bounds,
    PeerProblem,
    SparseFunction,
    step_function,
)
from plain_transcription import MAXIMUM_ITERATIONS, RELAXATION, STATES_RELABELLED, TOLERANCE, FloatArray

from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.request import GaitRequest

INFINITE = 2e19  # what IPOPT and its kin take for no bound
NEAR = 1e-9
# Bounds on the products that drive the relaxation of solvers that have none of their own.
RELAXATIONS = (1e-3, 1e-5, RELAXATION)
# What SNOPT's commonest codes mean.
SNOPT_WORDS = {
    1: "optimality conditions satisfied",
    3: "feasible, but not as accurate as asked for",
    13: "nonlinear infeasibilities minimized",
    31: "iteration limit",
    32: "major iteration limit",
    34: "time limit",
    41: "current point cannot be improved",
    43: "cannot satisfy the general constraints",
}


def first_guess(problem: PeerProblem) -> FloatArray:
    """Return the first of the package's kinematic guesses, the same for all."""
    return problem.start(kinematic_starts(walker(), problem.request.spring_mode)[0])


def _score(clock: Clock, problem: PeerProblem, x: FloatArray, status: str, iterations: int = 0) -> Score:
    times = clock.read()
    points, spring = problem.unpack(np.asarray(x))
    return score_points(times, problem.request, points, spring, status, iterations)


class CyipoptProblem:
    """The callbacks that cyipopt and its like ask for."""

    def __init__(self, problem: PeerProblem) -> None:
        x, f, g = problem.x, problem.f, problem.g
        sigma, lam = ca.SX.sym("sigma"), ca.SX.sym("lam", problem.rows)
        self._objective = ca.Function("f", [x], [f])
        self._gradient = ca.Function("gradient", [x], [ca.densify(ca.gradient(f, x))])
        self._rows = ca.Function("g", [x], [g])
        self._jacobian = SparseFunction([x], ca.jacobian(g, x))
        hessian = ca.tril(ca.hessian(sigma * f + ca.dot(lam, g), x)[0])
        self._hessian = SparseFunction([x, lam, sigma], hessian)
        self.iterations = 0

    def objective(self, x: FloatArray) -> float:
        return float(self._objective(x))

    def gradient(self, x: FloatArray) -> FloatArray:
        return self._gradient(x).full().ravel()

    def constraints(self, x: FloatArray) -> FloatArray:
        return self._rows(x).full().ravel()

    def jacobian(self, x: FloatArray) -> FloatArray:
        return self._jacobian(x)

    def jacobianstructure(self) -> tuple[Any, Any]:
        return self._jacobian.rows, self._jacobian.columns

    def hessian(self, x: FloatArray, lagrange: FloatArray, factor: float) -> FloatArray:
        self.iterations += 1
        return self._hessian(x, lagrange, factor)

    def hessianstructure(self) -> tuple[Any, Any]:
        return self._hessian.rows, self._hessian.columns


def pounce(request: GaitRequest, free_contacts: bool, time_limit: float) -> Score:
    """Solve with given contacts, and from there the relaxed problem, as the plain transcription does."""
    import pounce as solver

    clock = Clock()
    problem = PeerProblem(request, walker())
    callbacks = CyipoptProblem(problem)
    x, status = first_guess(problem), ""
    stages: list[tuple[Bounds, float | None]] = [(problem.given_contacts(), None)]
    if free_contacts:
        stages.append((problem.free_contacts(RELAXATION), NEAR))
    for bounds, near in stages:
        limits = (np.nan_to_num(one, posinf=INFINITE, neginf=-INFINITE) for one in vars(bounds).values())
        lower, upper, lower_g, upper_g = limits
        program = solver.Problem(
            n=problem.size, m=problem.rows, problem_obj=callbacks, lb=lower, ub=upper, cl=lower_g, cu=upper_g
        )
        for name, value in _interior_point_options(near, time_limit).items():
            program.add_option(name, value)
        x, info = program.solve(x0=np.asarray(x))
        status = _text(info["status_msg"])
    if not free_contacts:
        x = problem.with_slips(x)
    return _score(clock, problem, x, status, callbacks.iterations)


def _interior_point_options(near: float | None, time_limit: float) -> dict[str, Any]:
    options = {
        "tol": TOLERANCE,
        "max_iter": MAXIMUM_ITERATIONS,
        "print_level": 0,
        "max_wall_time": float(time_limit),
    }
    options |= {"bound_relax_factor": 0.0, "mu_strategy": "adaptive"}
    if near is not None:
        options |= {"mu_strategy": "monotone", "mu_init": near, "bound_push": 1e-8, "bound_frac": 1e-8}
    return options


def _text(message: str | bytes) -> str:
    return message.decode() if isinstance(message, bytes) else str(message)


def pympcc(request: GaitRequest, time_limit: float) -> Score:
    """Solve by the Scholtes method of pympcc with its own sequence of relaxations."""
    import pympcc as solver

    clock = Clock()
    problem = PeerProblem(request, walker())
    pieces = _mpcc_pieces(problem)
    bounds = problem.free_contacts(0.0)
    mpcc = solver.MPCCProblem(
        n=problem.size,
        n_comp=PAIRS * problem.points,
        n_eq=DEFECTS * problem.points,
        n_ineq=1,
        x0=first_guess(problem),
        xl=bounds.lower_x,
        xu=bounds.upper_x,
        **pieces,
    )
    options = {"tol": TOLERANCE, "max_iter": MAXIMUM_ITERATIONS, "print_level": 0}
    result = solver.solve(
        mpcc, strategy="scholtes", ipopt_options=options, epsilon_min=RELAXATION, time_limit=time_limit
    )
    success = "success" if result.success else "no success"
    iterations = sum(one.n_ipopt_iter for one in result.history)
    return _score(clock, problem, result.x, f"says {success}: {_text(result.message)}", iterations)


def _mpcc_pieces(problem: PeerProblem) -> dict[str, Any]:
    """Return objective, equations, step length and both sides of the pairs as pympcc wants them."""
    x, rows = problem.x, ca.reshape(problem.g[:-1], ROWS, problem.points)
    points = ca.reshape(x[:-2], POINT, problem.points)
    shortest = problem.request.step_length / problem.walker.leg_length
    blocks = {
        "ineq": shortest - problem.g[-1],
        "eq": ca.vec(rows[:DEFECTS, :]),
        "comp_G": ca.vec(rows[DEFECTS : DEFECTS + PAIRS, :]),
        "comp_H": ca.vec(points[SIDES_B, :]),
    }
    pieces: dict[str, Any] = {}
    for name, block in blocks.items():
        value = "_constraints" if name in ("eq", "ineq") else ""
        values, jacobian = ca.Function(name, [x], [block]), SparseFunction([x], ca.jacobian(block, x))
        pieces[name + value] = partial(_column, values)
        pieces[f"{name}_jacobian"] = jacobian
        pieces[f"{name}_jacobian_sparsity"] = (jacobian.rows, jacobian.columns)
    sigma, pair = ca.SX.sym("sigma"), blocks["comp_G"] * blocks["comp_H"]
    everything = ca.vertcat(*blocks.values(), pair)
    lam = ca.SX.sym("lam", everything.numel())
    lagrangian = ca.tril(ca.hessian(sigma * problem.f + ca.dot(lam, everything), x)[0])
    hessian = SparseFunction([x, lam, sigma], lagrangian)
    objective = ca.Function("f", [x], [problem.f])
    gradient = ca.Function("gradient", [x], [ca.densify(ca.gradient(problem.f, x))])
    return pieces | {
        "objective": lambda z: float(objective(z)),
        "gradient": partial(_column, gradient),
        "lagrangian_hessian": hessian,
        "lagrangian_hessian_sparsity": (hessian.rows, hessian.columns),
    }


def _column(function: ca.Function, x: FloatArray) -> FloatArray:
    return function(x).full().ravel()


def snopt(request: GaitRequest, time_limit: float) -> Score:
    """Solve the relaxed problem with Drake's SNOPT, one block of constraints a point."""
    from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

    clock = Clock()
    problem = PeerProblem(request, walker())
    x, status = first_guess(problem), ""
    solver, options = SnoptSolver(), SolverOptions()
    for name, value in {
        "Major iterations limit": 2000,
        "Iterations limit": 200_000,
        "Major optimality tolerance": 1e-6,
        "Major feasibility tolerance": 1e-8,
        "Time limit": time_limit / len(RELAXATIONS),
        "Total real workspace": 20_000_000,
        "Total integer workspace": 20_000_000,
    }.items():
        options.SetOption(solver.solver_id(), name, value)
    for relaxation in RELAXATIONS:
        program = MathematicalProgram()
        variables = program.NewContinuousVariables(problem.size)
        _add_blocks(program, variables, problem, problem.free_contacts(relaxation))
        result = solver.Solve(program, x, options)
        x, code = result.GetSolution(variables), result.get_solver_details().info
        status = f"INFO {code}: {SNOPT_WORDS.get(code, 'see its manual')}"
    return _score(clock, problem, x, status)


def _add_blocks(program: Any, variables: Any, problem: PeerProblem, bounds: Bounds) -> None:
    """Add bounds, objective and the rows of each point to Drake's program."""
    program.AddBoundingBoxConstraint(bounds.lower_x, bounds.upper_x, variables)
    columns = variables[:-2].reshape(POINT, -1, order="F")
    torques = columns[12:15].ravel()
    weight = problem.request.interval * np.eye(torques.size)
    program.AddQuadraticCost(weight, np.zeros(torques.size), torques, True)
    low, high = (one[:-1].reshape(ROWS, -1, order="F") for one in (bounds.lower_g, bounds.upper_g))
    step = step_function(problem.request, problem.walker)
    inner, first = _Block(step, closes=False), _Block(step, closes=True)
    for i in range(problem.points):
        block, before = (inner, columns[:DEFECTS, i - 1]) if i else (first, columns[:, -1])
        block.add(program, np.concatenate([before, columns[:, i], variables[-2:]]), low[:, i], high[:, i])
    last = np.concatenate([columns[:, -1], variables[-2:]])
    _Block(step, length_only=True).add(program, last, bounds.lower_g[-1:], bounds.upper_g[-1:])


class _Block:
    """The rows of a point as a function of Drake's automatic derivatives, which CasADi provides."""

    def __init__(self, step: ca.Function, *, closes: bool = False, length_only: bool = False) -> None:
        before = ca.SX.sym("before", POINT if closes else 0 if length_only else DEFECTS)
        point, spring = ca.SX.sym("point", POINT), ca.SX.sym("spring", 2)
        state = before
        if closes:
            state = before[STATES_RELABELLED]
            state[0] -= step(ca.SX.zeros(DEFECTS), before, spring)[1]
        rows, length = step(ca.SX.zeros(DEFECTS) if length_only else state, point, spring)
        outputs, inputs = length if length_only else rows, ca.vertcat(before, point, spring)
        jacobian = ca.jacobian(outputs, inputs)
        self._function = ca.Function("block", [inputs], [outputs, ca.densify(jacobian)])
        self._pattern = list(zip(*jacobian.sparsity().get_triplet(), strict=True))

    def __call__(self, x: Any) -> Any:
        from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff

        if x.dtype != object:
            return self._function(x)[0].full().ravel()
        values, jacobian = (one.full() for one in self._function(ExtractValue(x)))
        return InitializeAutoDiff(values, jacobian @ ExtractGradient(x)).ravel()

    def add(self, program: Any, variables: Any, low: FloatArray, high: FloatArray) -> None:
        """Add the rows to a program, with the pattern of their Jacobian."""
        binding = program.AddConstraint(self, lb=low, ub=high, vars=variables)
        binding.evaluator().SetGradientSparsityPattern(self._pattern)
