"""Where a verb gets its gait from: a file, the library, or a solve."""

import argparse
import sys
from collections.abc import Callable
from typing import TypeVar

from walk_optimizer.cli.arguments import refuse_beside, request_from, walker_from
from walk_optimizer.cli.terminal import SolveProgress, interruptible
from walk_optimizer.cli.text import request_text
from walk_optimizer.errors import GaitNotFoundError, InvalidRequestError, SolveFailedError
from walk_optimizer.gait import Gait
from walk_optimizer.gait_files import read_gait_file
from walk_optimizer.library import GaitLibrary
from walk_optimizer.library.warm_start import optimize_from
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import Outcome, optimize
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.settings import SolverSettings
from walk_optimizer.solve.status import ProgressCallback

_Result = TypeVar("_Result")


def watched(work: Callable[[ProgressCallback], _Result]) -> _Result:
    """Return what work returns; its progress is shown on stderr.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed; the work has ended.
    """
    with interruptible() as interrupt:
        progress = SolveProgress(interrupt)
        try:
            return work(progress)
        finally:
            progress.close()


def solve(
    request: GaitRequest,
    walker: WalkerParameters,
    library: GaitLibrary | None = None,
    time_limit: float | None = None,
    settings: SolverSettings | None = None,
) -> Outcome:
    """Return the outcome of a solve whose progress is shown on stderr.

    Args:
        request: What is asked for.
        walker: The walker.
        library: Whose gaits to start from, where they are neighbours; None for a search of its own.
        time_limit: In [s]; the settings' by default.
        settings: Of the search; the packaged ones by default.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed; the solve has ended.
    """

    def work(progress: ProgressCallback) -> Outcome:
        if library is None:
            return optimize(request, walker, settings=settings, time_limit=time_limit, progress=progress)
        return optimize_from(
            library, request, walker, settings=settings, time_limit=time_limit, progress=progress
        )

    return watched(work)


def chosen_gait(args: argparse.Namespace) -> Gait:
    """Return the gait that `add_gait_choice` asks for.

    Without `--points` a gait of the library will do; what the library lacks is solved.

    Raises:
        WalkOptimizerError: the choice is impossible, or there is no such gait.
    """
    walker = walker_from(args)
    if args.file is not None:
        refuse_beside("--file", args, ("speed", "spring", "points", "library"))
        return read_gait_file(args.file, walker if args.walker else None)
    if args.speed is None:
        raise InvalidRequestError("say which gait: --speed SPEED [--spring MODE], or --file GAIT")
    request = request_from(args)
    points = None if args.points is None else request.points
    library = GaitLibrary(walker, args.library)
    try:
        return library.find(request.speed, request.spring_mode, points=points)[0]
    except GaitNotFoundError as error:
        print(f"{error}; solving {request_text(request)}", file=sys.stderr)
    outcome = solve(request, walker, library)
    if outcome.gait is None:
        raise SolveFailedError(f"no gait: {outcome.report.message}")
    return outcome.gait
