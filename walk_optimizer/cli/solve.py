"""`solve`: one gait, its report and its certificate."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from walk_optimizer.cli.arguments import (
    Subparsers,
    add_library,
    add_request,
    add_verb,
    add_walker,
    positive_seconds,
    refuse_beside,
    request_from,
    walker_from,
)
from walk_optimizer.errors import InvalidRequestError, quoted
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.registry import BACK_ENDS, back_end

if TYPE_CHECKING:
    from walk_optimizer.solve.settings import SolverSettings

_TEXT = """\
solve for the gait of least torque at a speed

The search begins at the library's gaits of the next speeds, without them at several
first guesses; the best optimum is solved with free contacts and checked by a
certificate that is computed apart from the solver. A gait that fails its
certificate is not a gait: the exit code is then 1 and nothing is stored."""

_EPILOG = """\
examples:
  walk-optimizer solve --speed 0.3185
  walk-optimizer solve --speed 1.15km/h --spring stiffness_and_equilibrium --save
  walk-optimizer solve --speed 0.5 --points 400 --time-limit 60 --export gait.csv
  walk-optimizer solve --speed 0.5 --points 50 --solver fatrop
        with another solver; takes half a minute, most of it for the refinement
  walk-optimizer solve --speed 1.15km/h --points 50 --formulation report
        what became of the report's own program: residuals, no gait unless certified"""

_FORMULATIONS = ("ours", "report")


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "solve", _TEXT, _EPILOG)
    add_request(parser)
    add_walker(parser)
    add_library(parser)
    parser.add_argument("--time-limit", metavar="SECONDS", help="give up after this time")
    known = ", ".join(f"{name} ({entry.method})" for name, entry in BACK_ENDS.items())
    parser.add_argument(
        "--solver",
        metavar="NAME",
        help=f"{known}; default: that of config/solver.yaml. uno is for coarse grids: refinements, whose "
        "grid is not, take it minutes",
    )
    parser.add_argument(
        "--formulation",
        choices=_FORMULATIONS,
        default=_FORMULATIONS[0],
        help="ours, or the report's own program, to see how far it gets (default: %(default)s)",
    )
    parser.add_argument(
        "--from-scratch", action="store_true", help="search without the library's gaits of other speeds"
    )
    parser.add_argument("--save", action="store_true", help="store the gait in the library")
    parser.add_argument("--export", type=Path, metavar="CSV", help="write the numbers to a file")
    parser.set_defaults(run=run)


def _refuse_ignored(args: argparse.Namespace) -> None:
    """Refuse options that would be ignored.

    Raises:
        InvalidRequestError: one of them was given.
    """
    if args.formulation == "report":
        # It begins with a guess of its own, and shows residuals.
        refuse_beside("--formulation report", args, ("library", "from_scratch", "save", "export"))
        if args.solver not in (None, "ipopt"):
            raise InvalidRequestError("--formulation report is IPOPT's: leave --solver out")
    if args.from_scratch and not args.save:
        refuse_beside("--from-scratch without --save", args, ("library",))


def solver_settings_from(args: argparse.Namespace) -> "SolverSettings":
    """Return the settings with the chosen back end.

    Raises:
        InvalidRequestError: there is no such back end.
        MissingDependencyError: its library is missing.
    """
    if args.solver not in (None, *BACK_ENDS):
        allowed = ", ".join(BACK_ENDS)
        raise InvalidRequestError(f"unknown solver {quoted(args.solver)}; allowed are {allowed}")

    from walk_optimizer.solve.settings import solver_settings

    settings = solver_settings()
    if args.solver is not None:
        settings = replace(settings, back_end=args.solver)
    back_end(settings.back_end)
    return settings


def _try_report(
    request: GaitRequest, walker: WalkerParameters, settings: "SolverSettings", time_limit: float | None
) -> int:
    """Solve the report's own formulation and print how far it got."""
    from walk_optimizer.cli.gaits import watched
    from walk_optimizer.cli.text import certificate_text, gait_text, report_text, request_text
    from walk_optimizer.optimizer.reference_solve import solve_reference

    print(request_text(request))
    outcome = watched(
        lambda progress: solve_reference(
            request, walker, settings=settings, time_limit=time_limit, progress=progress
        )
    )
    print(report_text(outcome.report))
    if outcome.gait is not None:
        print(gait_text(outcome.gait))
    print(f"\n{certificate_text(outcome.certificate)}")
    return 0 if outcome.gait is not None else 1


def run(args: argparse.Namespace) -> int:
    """Solve, print, store."""
    _refuse_ignored(args)
    request, walker = request_from(args), walker_from(args)
    time_limit = None if args.time_limit is None else positive_seconds(args.time_limit, "time limit")
    settings = solver_settings_from(args)

    from walk_optimizer.cli.gaits import solve
    from walk_optimizer.cli.text import (
        certificate_text,
        gait_text,
        refinement_text,
        report_text,
        request_text,
    )
    from walk_optimizer.gait_files.access import writable_target
    from walk_optimizer.gait_files.gait_csv import write_csv
    from walk_optimizer.library import GaitLibrary

    if args.formulation == "report":
        return _try_report(request, walker, settings, time_limit)
    # Before the work, not after it: where the gait goes must be writable.
    library = GaitLibrary(walker, args.library, writable=args.save)
    if args.export:
        writable_target(args.export)
    print(request_text(request))
    start_from = None if args.from_scratch else library
    outcome = solve(request, walker, start_from, time_limit, settings)
    print(report_text(outcome.report))
    if outcome.gait is None:
        return 1
    print(gait_text(outcome.gait))
    print(f"refined        {refinement_text(outcome.gait)}")
    print(f"\n{certificate_text(outcome.gait.certificate)}")
    if args.export:
        write_csv(outcome.gait, args.export)
        print(f"\nexported to {args.export}")
    if args.save:
        print(f"\nstored as {library.store(outcome.gait)}")
    return 0
