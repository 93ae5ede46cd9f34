"""`walk-optimizer`: picks the verb and turns errors of the core into one line and an exit code.

Only light modules are imported here; a verb imports what it needs when it runs, so that `--help`
answers at once.
"""

import argparse
import importlib
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from walk_optimizer import __version__
from walk_optimizer.errors import SolveFailedError, WalkOptimizerError

EXIT_FAILED = 1
EXIT_ERROR = 2
EXIT_INTERRUPTED = 130

_VERBS = (
    "solve",
    "table",
    "library",
    "transitions",
    "export",
    "picture",
    "simulate",
    "reproduce",
    "example",
    "urdf",
    "bag",
    "demo",
)

_DESCRIPTION = """\
Least-torque walking gaits for a planar biped with knee springs.

Speeds are in m/s, or carry a unit: 0.3185, 0.3185m/s, 1.15km/h.
Springs: none (no knee springs), stiffness (K is chosen, q_eq = pi),
stiffness_and_equilibrium (K and q_eq are chosen)."""

_EPILOG = """\
examples:
  walk-optimizer table
        the gaits that ship with the package, beside those of the report
  walk-optimizer solve --speed 1.15km/h --spring stiffness_and_equilibrium
        a gait of your own, with its certificate
  walk-optimizer picture --speed 0.3185 --output gait.png
        stick figures, angles, torques and ground reaction
  walk-optimizer export --speed 0.3185 --output gait.csv
        the numbers

`walk-optimizer VERB --help` explains a verb. Exit codes: 0 done, 1 no gait or a failed check,
2 refused, 130 interrupted."""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message and leave with the exit code of a refusal."""
        self.exit(EXIT_ERROR, f"{self.prog}: {message} (see {self.prog} --help)\n")


def build_parser() -> argparse.ArgumentParser:
    """Return the parser with all verbs that are installed."""
    parser = Parser(
        prog="walk-optimizer",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    verbs = parser.add_subparsers(metavar="VERB", required=True, parser_class=Parser)
    for verb in _VERBS:
        importlib.import_module(f"walk_optimizer.cli.{verb}").add_parser(verbs)
    return parser


def join_negative_values(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `--option -1km/h` written as `--option=-1km/h`.

    argparse takes a value that begins with a minus for another option, and then complains about a
    missing value instead of a negative one.
    """
    joined: list[str] = []
    for argument in arguments:
        value = argument.startswith("-") and argument[1:2].lower() in {*"0123456789.ni"} and argument != "-i"
        if value and joined and joined[-1].startswith("--") and "=" not in joined[-1]:
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    given = join_negative_values(sys.argv[1:] if arguments is None else arguments)
    args = build_parser().parse_args(given)
    try:
        code: int = args.run(args)
        sys.stdout.flush()
    except WalkOptimizerError as error:
        print(f"walk-optimizer: {_one_line(error)}", file=sys.stderr)
        return EXIT_FAILED if isinstance(error, SolveFailedError) else EXIT_ERROR
    except KeyboardInterrupt:
        print("walk-optimizer: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        # The reader of a pipe, such as `head`, has enough. Python would complain once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _one_line(error: Exception) -> str:
    """Return the message of an error without line breaks."""
    return " ".join(str(error).split()) or type(error).__name__


if __name__ == "__main__":
    sys.exit(main())
