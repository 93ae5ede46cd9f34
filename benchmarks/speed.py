"""How much faster the optimiser is than a plain CasADi `Opti` + IPOPT transcription of the same problem.

Every solve runs in a process of its own, one at a time, and is judged by the certificate of the package.
Failures stay in the tables. With `--only` the other sections of the page stay as they were.

    .venv/bin/python benchmarks/speed.py
    .venv/bin/python benchmarks/speed.py --only resolve,startup
"""

import argparse
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path

from bench import SAMPLED_SPEEDS, Bench
from report import machine, save_section
from speed_gaits import cold, whole_table
from speed_running import growth, resolve, startup

from walk_optimizer.request import gait_table_settings

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks" / "speed.md"
TITLE = """\
# Speed

Made by `.venv/bin/python benchmarks/speed.py`; each section ends with the machine and the load that it
began with. *Plain* is `benchmarks/plain_transcription.py` and `plain_refined.py`: the same walker, grid,
bounds, first guesses and tolerances in CasADi's `Opti`, with CasADi's own exact derivatives, nothing
compiled, and IPOPT's adaptive barrier for far starts and a small first one for near starts. How the barrier
and multipliers begin is part of what is compared. It takes the walker's symbolic mechanics and the first
guesses from the package, not its transcription.

Each solve has a process of its own. Times are wall times that include building the problem, but not
importing packages. A ratio is the plain time over ours; several are averaged by the geometric mean. F is
the sum over the grid points of |u|^2 / 2 in (N m)^2. Both sides are judged by the package's certificate: a
residual above its tolerance is printed as a multiple of it.
"""
HEADINGS = {
    "cold": "One cold gait, N = 200",
    "table": "The whole table of 21 gaits",
    "resolve": "A new speed from the library's neighbour",
    "growth": "Cost against N",
    "startup": "Start-up and memory",
}


def parsed_arguments() -> argparse.Namespace:
    """Return the arguments of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = ",".join(HEADINGS)
    parser.add_argument("--only", metavar="PARTS", default=names, help=f"some of {names}")
    parser.add_argument("--all-entries", action="store_true", help="plain solves all 21 entries of the table")
    parser.add_argument("--output", type=Path, default=PAGE, help="Markdown page to write or renew")
    args = parser.parse_args()
    args.only = args.only.split(",")
    unknown = sorted(set(args.only) - set(HEADINGS))
    if unknown:
        parser.error(f"unknown part {', '.join(unknown)}; there are {names}")
    return args


def section_text(section: Callable[[Bench], str], bench: Bench) -> str:
    """Return a section; one that fails says so, and lets the others be measured."""
    try:
        return section(bench)
    except Exception as problem:  # noqa: BLE001  # failures stay on the page
        traceback.print_exc()
        return f"**Not measured: {type(problem).__name__}: {problem}**"


def main() -> None:
    """Measure the sections that are asked for, and save each as soon as it is done."""
    args = parsed_arguments()
    speeds = range(gait_table_settings().gaits) if args.all_entries else SAMPLED_SPEEDS
    sections: dict[str, Callable[[Bench], str]] = {
        "cold": cold,
        "table": partial(whole_table, speeds=speeds),
        "resolve": resolve,
        "growth": growth,
        "startup": startup,
    }
    bench = Bench()
    for name in (one for one in sections if one in args.only):
        where = machine()
        text = f"{section_text(sections[name], bench)}\n\n{where}"
        print(f"\n## {HEADINGS[name]}\n\n{text}\n", flush=True)
        save_section(args.output, TITLE, list(HEADINGS.values()), HEADINGS[name], text)


if __name__ == "__main__":
    main()
