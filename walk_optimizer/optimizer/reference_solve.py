"""Tries the report's own formulation, as it was tried: its first guess, its options of IPOPT.

What it ends with is judged by the same certificate as every gait, and is a gait only if that passes.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.grid import certify, landing_distance
from walk_optimizer.contact.observation import slip_velocities
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import Certificate, Gait, Trajectory
from walk_optimizer.guess.kinematic import GuessShape, kinematic_guess
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.ipopt import IpoptOptions
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import SolverSettings, solver_settings
from walk_optimizer.solve.solution import Solution
from walk_optimizer.solve.status import FamilyViolation, ProgressCallback, SolveReport, Status
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.problems import from_scaled, to_scaled
from walk_optimizer.transcription.reference_formulation import reference_problem
from walk_optimizer.transcription.scaling import torque_unit

FloatArray = NDArray[np.float64]

# Where IPOPT's defaults are not those of our own solves.
_DEFAULTS = (
    ("linear_solver", "mumps"),
    ("mumps_pivot_order", 7),
    ("min_refinement_steps", 1),
    ("constr_mult_init_max", 1e3),
)
# Section 3.2 of the report; everything else is as IPOPT has it by default.
_REPORT_OPTIONS = (
    *_DEFAULTS,
    ("mu_strategy", "adaptive"),
    ("adaptive_mu_globalization", "kkt-error"),
    ("mu_oracle", "probing"),
    ("bound_relax_factor", 1e-8),
)
OPTIONS = IpoptOptions(tolerance=1e-8, maximum_iterations=3000, further=_REPORT_OPTIONS)
# The report derives first derivatives only, with which IPOPT estimates the second ones.
FIRST_ORDER = replace(OPTIONS, further=(*_REPORT_OPTIONS, ("hessian_approximation", "limited-memory")))
# The report does not say where K begins: at a spring as soft as those that it finds.
_FIRST_STIFFNESS = 10.0


@dataclass(frozen=True)
class ReferenceOutcome:
    """How far the report's formulation got.

    Attributes:
        gait: The gait; None unless it was solved and certified.
        report: How the solve went.
        certificate: Residuals of its last iterate.
    """

    gait: Gait | None
    report: SolveReport
    certificate: Certificate


def solve_reference(
    request: GaitRequest,
    walker: WalkerParameters,
    *,
    settings: SolverSettings | None = None,
    options: IpoptOptions = OPTIONS,
    time_limit: float | None = None,
    progress: ProgressCallback | None = None,
) -> ReferenceOutcome:
    """Solve the report's program from the report's first guess.

    Args:
        request: Speed, step, spring mode and grid.
        walker: The walker, on level ground.
        settings: Their time limit counts; the packaged ones by default.
        options: Of IPOPT: `OPTIONS` with exact second derivatives, `FIRST_ORDER` without.
        time_limit: In [s], above 0; the settings' by default.
        progress: Called at every iteration; returning False cancels the solve.

    Raises:
        InvalidRequestError: the time limit is not above 0, or the ground is not level.
    """
    settings = replace(settings or solver_settings(), back_end="ipopt")
    limit = settings.time_limit if time_limit is None else time_limit
    if not limit > 0:
        raise InvalidRequestError(f"time limit is {limit} s, allowed is above 0")
    if not walker.terrain.is_flat:
        raise InvalidRequestError("the report's formulation knows level ground only; choose another walker")
    session = SolveSession(settings, limit, progress)
    problem = reference_problem(request, walker)
    start = to_scaled(walker, reference_guess(walker, request), _first_spring(request.spring_mode))
    unit = torque_unit(walker) ** 2 / request.interval
    solution = session.solve(problem, start, "reference", objective_unit=unit, options=options)
    return _judged(request, walker, solution, session.elapsed)


def reference_guess(walker: WalkerParameters, request: GaitRequest) -> FloatArray:
    """Return the report's first guess, (23, N) in SI units: imposed paths of hip and foot (section 5).

    The report says no more. The slip speeds are those of these paths, so that no pair is violated
    without need.
    """
    points = kinematic_guess(walker, request, GuessShape())
    points[layout.SLIP] = np.abs(slip_velocities(walker, points[layout.Q], points[layout.P]))
    return points


def _first_spring(mode: SpringMode) -> KneeSpring:
    return KneeSpring() if mode is SpringMode.NONE else KneeSpring(_FIRST_STIFFNESS)


def _judged(
    request: GaitRequest, walker: WalkerParameters, solution: Solution, elapsed: float
) -> ReferenceOutcome:
    """Return the outcome of an iterate, by its certificate."""
    points, spring = from_scaled(walker, solution.x)
    trajectory = Trajectory.from_stacked(points, request.step_time)
    certificate = certify(walker, request, spring, trajectory)
    status = solution.status
    if status is Status.SOLVED and not certificate.certified:
        status = Status.NOT_CERTIFIED
    worst = certificate.worst
    remarks = [status.sentence, f"IPOPT says {solution.detail}", *([] if worst.met else [str(worst)])]
    report = SolveReport(
        status,
        "; ".join(remarks),
        "ipopt, report's formulation",
        start="report's first guess",
        starts=1,
        iterations=solution.iterations,
        solve_time=elapsed,
        objective=trajectory.torque_cost,
        violations=tuple(FamilyViolation(one.family, one.violation, one.unit) for one in certificate.entries),
    )
    if status is not Status.SOLVED:
        return ReferenceOutcome(None, report, certificate)
    length = landing_distance(walker, trajectory)
    gait = Gait(walker, request, spring, trajectory, report, certificate, length)
    return ReferenceOutcome(gait, report, certificate)
