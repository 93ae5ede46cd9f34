"""Solves from the gaits that a library has on both sides of a speed, where it has them.

They are the best of a search with many starts, and their continuation keeps what it found: it takes
half the time of a search for the new speed alone, and its optima are as good or better.
"""

from collections.abc import Sequence
from dataclasses import replace

from walk_optimizer.gait import Gait
from walk_optimizer.library.gait_library import GaitLibrary
from walk_optimizer.library.selection import EXACT_SPEED_TOLERANCE, is_on_line
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import Outcome, optimize
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.settings import SolverSettings, solver_settings
from walk_optimizer.solve.status import ProgressCallback, SolveReport, Status

# Whoever ended a solve so does not want another.
_ENDED = (Status.CANCELLED, Status.TIME_LIMIT)


def optimize_from(
    library: GaitLibrary,
    request: GaitRequest,
    walker: WalkerParameters,
    *,
    settings: SolverSettings | None = None,
    time_limit: float | None = None,
    progress: ProgressCallback | None = None,
) -> Outcome:
    """Solve for the gait of least torque, from its neighbours in a library if it has any.

    Args:
        library: Of the walker.
        request: Speed, step, spring mode and grid.
        walker: The walker.
        settings: Of the search; the packaged ones by default.
        time_limit: In [s], above 0; the settings' by default.
        progress: Called at every iteration; returning False cancels the solve.

    Raises:
        InvalidRequestError: the time limit is not above 0.
    """
    settings = settings or solver_settings()
    limit = settings.time_limit if time_limit is None else time_limit
    seeds = neighbours(library.gaits(), request)
    if not seeds:
        return optimize(request, walker, settings=settings, time_limit=limit, progress=progress)
    continued = optimize(
        request,
        walker,
        settings=settings,
        time_limit=limit,
        progress=progress,
        seeds=seeds,
        from_scratch=False,
    )
    if continued.gait is not None or continued.report.status in _ENDED:
        return continued
    left = max(limit - continued.report.solve_time, 1e-3)
    searched = optimize(request, walker, settings=settings, time_limit=left, progress=progress)
    return _after(continued.report, searched)


def _after(former: SolveReport, outcome: Outcome) -> Outcome:
    """Return an outcome whose report counts what another solve took before it."""
    report = replace(
        outcome.report,
        starts=former.starts + outcome.report.starts,
        iterations=former.iterations + outcome.report.iterations,
        solve_time=former.solve_time + outcome.report.solve_time,
    )
    gait = None if outcome.gait is None else replace(outcome.gait, report=report)
    return replace(outcome, gait=gait, report=report)


def neighbours(gaits: Sequence[Gait], request: GaitRequest) -> list[Gait]:
    """Return the nearest gaits of the mode that are as fast or slower, and as fast or faster.

    There are none where one side has no gait, or for a step of the user's own instead of the speed's.

    Args:
        gaits: All that there are.
        request: What is asked for.
    """
    if not is_on_line(request):
        return []
    fitting = [gait for gait in gaits if gait.request.spring_mode is request.spring_mode]

    def nearness(gait: Gait) -> tuple[float, bool]:
        return abs(gait.request.speed - request.speed), gait.request.points != request.points

    below = [gait for gait in fitting if gait.request.speed <= request.speed + EXACT_SPEED_TOLERANCE]
    above = [gait for gait in fitting if gait.request.speed >= request.speed - EXACT_SPEED_TOLERANCE]
    if not (below and above):
        return []
    nearest = [min(side, key=nearness) for side in (below, above)]
    return nearest[:1] if nearest[0] is nearest[1] else nearest
