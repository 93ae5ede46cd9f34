"""`export`: the numbers of a gait for other programs."""

import argparse
import sys
from pathlib import Path

from walk_optimizer.cli.arguments import Subparsers, add_gait_choice, add_verb

_TEXT = """\
write the numbers of a gait as CSV

One row a grid point, SI units. Lines `# key: value` before the column names give
speed, step_length, step_time, N, spring mode, K, q_eq, friction and F.

  time                     end of the interval from the start of the step
  q1..q6, p1..p6           coordinates and momenta
  u1, u2, u3               hip torque, knee torques of leg 1 (stance) and leg 2 (swing)
  lambda1_xp, _xm, _y      ground reaction of foot 1 forward, backward, up; lambda2 of foot 2
  gamma1, gamma2           slip speeds of the feet

With --grid refined one row a node of the refined solution, which controllers are fed;
instead of the last columns lambda1_x, lambda1_y, lambda2_x, lambda2_y. The line
`# grid: radau` tells. N and F remain those of the report's grid.

The gait comes from the library; one that the library lacks is solved."""

_EPILOG = """\
examples:
  walk-optimizer export --speed 1.15km/h --spring stiffness --output gait.csv
  walk-optimizer export --speed 0.3185 | python3 -c \\
        "import sys, numpy; print(numpy.genfromtxt(sys.stdin, delimiter=',')[1:].shape)"
"""


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "export", _TEXT, _EPILOG)
    add_gait_choice(parser)
    parser.add_argument("--grid", choices=["report", "refined"], default="report", help="default: report")
    parser.add_argument("--output", type=Path, metavar="FILE", help="default: standard output")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the gait."""
    from walk_optimizer.cli.gaits import chosen_gait
    from walk_optimizer.gait_files.access import writable_target, write_text
    from walk_optimizer.gait_files.gait_csv import gait_csv, refined_csv

    to_csv = refined_csv if args.grid == "refined" else gait_csv
    if args.output is None:
        sys.stdout.write(to_csv(chosen_gait(args)))
        return 0
    writable_target(args.output)
    write_text(args.output, to_csv(chosen_gait(args)))
    print(f"exported to {args.output}")
    return 0
