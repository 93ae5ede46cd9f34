"""SNOPT by way of Drake: quasi-Newton SQP for large sparse programs [Gill2005], the report's advice.

Drake asks for cost and rows in pieces, each with a small dense gradient, one piece after another for the
same x. The rows are cut into pieces of neighbours, which see few variables. A round of pieces without
cost comes first and collects x, so that everything else is evaluated once for all pieces.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import ExtractValue, InitializeAutoDiff
from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

from walk_optimizer.solve.back_end import SolveOptions, ended, refused_start
from walk_optimizer.solve.isolation import isolated
from walk_optimizer.solve.solution import FloatArray, Monitor, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Problem

# Variables of a piece of the cost, and rows of a piece of the rows.
_PIECE = 32
_WORKSPACE = 40_000_000
# SNOPT's exit conditions by their tens.
_STATUS = {0: Status.SOLVED, 1: Status.INFEASIBLE, 3: Status.ITERATION_LIMIT, 6: Status.EVALUATION_ERROR}
_NOT_ACCURATE = 3


@dataclass(eq=False)
class _Evaluation:
    """Cost, rows and derivatives at the x that was seen last.

    Attributes:
        problem: The program.
        x: What has been seen of the variables.
        evaluated: Where the values below belong to; None before the first evaluation.
        iterations: Evaluations.
    """

    problem: Problem
    x: FloatArray
    evaluated: FloatArray | None = None
    f: float = 0.0
    iterations: int = 0
    gradient: FloatArray = field(default_factory=lambda: np.zeros(0))
    g: FloatArray = field(default_factory=lambda: np.zeros(0))
    jacobian: Any = None

    def see(self, columns: NDArray[np.int64], values: NDArray[Any]) -> None:
        """Take a part of x, as plain numbers or with Drake's derivatives."""
        plain = values.dtype == np.float64
        self.x[columns] = values if plain else ExtractValue(values).ravel()

    def update(self) -> None:
        """Evaluate if x has changed."""
        if self.evaluated is not None and np.array_equal(self.evaluated, self.x):
            return
        nlp, parameters = self.problem.nlp, self.problem.parameters
        g, jacobian = nlp.jacobian(self.x, parameters)
        f, gradient = nlp.gradient(self.x, parameters)
        self.f, self.gradient, self.g = float(f), gradient.full().ravel(), g.full().ravel()
        self.jacobian = jacobian.sparse().tocsr()
        self.evaluated = self.x.copy()
        self.iterations += 1


def solve(
    problem: Problem, start: FloatArray, options: SolveOptions, monitor: Monitor | None = None
) -> Solution:
    """Solve a program from a start; see `BackEnd.solve`."""
    if (refusal := refused_start(start)) is not None:
        return refusal
    return isolated(lambda: _solve(problem, start, options), problem, start, monitor)


def _solve(problem: Problem, start: FloatArray, options: SolveOptions) -> Solution:
    # Drake refuses a start outside the bounds of nothing, but SNOPT begins better within them.
    inside = np.clip(start, problem.lower_x, problem.upper_x)
    evaluation = _Evaluation(problem, inside.copy())
    program = MathematicalProgram()
    x = program.NewContinuousVariables(start.size, "x")
    program.AddBoundingBoxConstraint(problem.lower_x, problem.upper_x, x)
    pieces = np.array_split(np.arange(start.size), max(1, start.size // _PIECE))
    for columns in pieces:
        program.AddCost(_collector(evaluation, columns), x[columns])
    for index, columns in enumerate(pieces):
        program.AddCost(_cost(evaluation, columns, first=index == 0), x[columns])
    _add_rows(program, x, evaluation)
    result = SnoptSolver().Solve(program, inside, _settings(options))
    info = result.get_solver_details().info
    status = _STATUS.get(info // 10, Status.SOLVER_ERROR)
    if info == _NOT_ACCURATE:
        status = Status.ACCEPTABLE_ONLY
    point = np.asarray(result.GetSolution(x), dtype=float)
    return ended(problem, point, status, evaluation.iterations, f"SNOPT info {info}")


def _settings(options: SolveOptions) -> SolverOptions:
    settings = SolverOptions()
    for name, value in {
        "Major iterations limit": options.maximum_iterations,
        "Iterations limit": 1000 * options.maximum_iterations,
        "Major feasibility tolerance": options.tolerance,
        "Major optimality tolerance": max(options.tolerance, 1e-6),
        "Superbasics limit": 2000,
        "Total real workspace": _WORKSPACE,
        "Total integer workspace": _WORKSPACE,
    }.items():
        settings.SetOption(SnoptSolver.id(), name, value)
    return settings


def _collector(evaluation: _Evaluation, columns: NDArray[np.int64]) -> Any:
    """Return a cost of zero that takes note of its variables."""

    def cost(values: NDArray[Any]) -> Any:
        evaluation.see(columns, values)
        return _answer(values, np.zeros(1), np.zeros((1, columns.size)))[0]

    return cost


def _cost(evaluation: _Evaluation, columns: NDArray[np.int64], *, first: bool) -> Any:
    """Return a piece of the cost: its part of the gradient, the value in the first one."""

    def cost(values: NDArray[Any]) -> Any:
        evaluation.see(columns, values)
        evaluation.update()
        value = np.array([evaluation.f if first else 0.0])
        return _answer(values, value, evaluation.gradient[None, columns])[0]

    return cost


def _add_rows(program: MathematicalProgram, x: NDArray[Any], evaluation: _Evaluation) -> None:
    """Add the rows in pieces, each with the variables that it depends on."""
    problem = evaluation.problem
    rows, columns = (np.array(one) for one in problem.nlp.jacobian.sparsity_out(1).get_triplet())
    height = problem.lower_g.size
    for piece in np.array_split(np.arange(height), max(1, height // _PIECE)):
        inside = (rows >= piece[0]) & (rows <= piece[-1])
        seen, place = np.unique(columns[inside], return_inverse=True)
        lower, upper = problem.lower_g[piece], problem.upper_g[piece]
        binding = program.AddConstraint(_piece(evaluation, piece, seen), lower, upper, x[seen])
        pattern = list(zip((rows[inside] - piece[0]).tolist(), place.tolist(), strict=True))
        binding.evaluator().SetGradientSparsityPattern(pattern)


def _piece(evaluation: _Evaluation, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Any:
    def values_of(values: NDArray[Any]) -> NDArray[Any]:
        evaluation.see(columns, values)
        evaluation.update()
        derivatives = evaluation.jacobian[rows[0] : rows[-1] + 1][:, columns].toarray()
        return _answer(values, evaluation.g[rows], derivatives)

    return values_of


def _answer(asked: NDArray[Any], values: FloatArray, derivatives: FloatArray) -> NDArray[Any]:
    """Return values with derivatives, if Drake asked for them."""
    if asked.dtype == np.float64:
        return values
    answer: NDArray[Any] = InitializeAutoDiff(values, derivatives).ravel()
    return answer
