"""`demo`: the whole suite at work, as real processes. What `make run` runs."""

import argparse
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from walk_optimizer.cli.arguments import Subparsers, add_verb, output_folder, positive_seconds
from walk_optimizer.errors import SolveFailedError
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest, parse_speed

if TYPE_CHECKING:
    from walk_optimizer.cli.processes import NodeProcess
    from walk_optimizer.gait import Gait
    from walk_optimizer.nodes.demo_client import Reception

_TEXT = """\
start the three ROS 2 nodes and let them do the whole job

An optimiser, a library and a publisher node run as processes of their own, on a ROS
domain of their own. A service call solves for a gait, the publisher streams it, a
subscriber checks every message against the gait, and a bag records it."""

_EPILOG = """\
examples:
  walk-optimizer demo
  walk-optimizer demo --speed 2.44km/h --spring stiffness --seconds 10"""

# A first solve compiles the model; on a slow machine that takes its time.
_SOLVE_TIMEOUT = 900.0


def add_parser(verbs: Subparsers) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "demo", _TEXT, _EPILOG)
    parser.add_argument("--speed", default="0.3185", metavar="SPEED", help="default: %(default)s")
    parser.add_argument(
        "--spring",
        default=SpringMode.STIFFNESS_AND_EQUILIBRIUM.value,
        metavar="MODE",
        help=f"{', '.join(SpringMode)} (default: %(default)s)",
    )
    parser.add_argument("--points", type=int, metavar="N", help="grid points of a step (default: 200)")
    parser.add_argument("--seconds", default="5", metavar="S", help="streaming time (default: %(default)s)")
    parser.add_argument(
        "--output", type=Path, metavar="FOLDER", help="folder of bag, picture and logs (default: in log/)"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the demonstration; 0 when everything agreed and everybody left cleanly."""
    request = GaitRequest.for_speed(parse_speed(args.speed), args.spring, args.points)
    seconds = positive_seconds(args.seconds, "seconds")
    output = args.output or Path("log") / f"demo_{datetime.now().astimezone():%Y_%m_%d-%H_%M_%S}"
    with _terminated_as_interrupted():
        return _Demo(request, seconds, output_folder(output)).run()


class _Demo:
    """One demonstration; prints a line for each thing that has happened."""

    def __init__(self, request: GaitRequest, seconds: float, output: Path) -> None:
        self._request, self._seconds, self._output = request, seconds, output
        self._walker = WalkerParameters.from_yaml()
        self._begin = time.monotonic()
        self._nodes: list[NodeProcess] = []

    def run(self) -> int:
        from walk_optimizer.cli.processes import isolated_environment, running_nodes

        os.environ.update(isolated_environment(os.environ))
        self._say(f"starting three nodes on ROS domain {os.environ['ROS_DOMAIN_ID']}")
        with running_nodes(self._output, os.environ) as self._nodes:
            gait, reception, bag = self._work()
        codes = {node.name: node.exit_code for node in self._nodes}
        clean = all(code == 0 for code in codes.values())
        self._say("all nodes have left cleanly" if clean else f"exit codes: {codes}; logs in {self._output}")
        self._show(gait, bag)
        return 0 if clean and reception.right else 1

    def _work(self) -> "tuple[Gait, Reception, Path]":
        from walk_optimizer.cli.text import refinement_text, request_text
        from walk_optimizer.nodes.demo_client import demo_client

        bag = self._output.absolute() / "bag"
        with demo_client(self._require_nodes) as client:
            self._say(f"asking gait_optimizer for {request_text(self._request)}")
            gait = client.optimize(self._request, self._walker, _SOLVE_TIMEOUT)
            self._say(
                f"solved in {gait.report.solve_time:.1f} s and certified: F = {gait.objective:.2f} (N m)^2, "
                f"K = {gait.spring.stiffness:.2f} N m/rad, q_eq = {gait.spring.equilibrium:.3f} rad"
            )
            self._say(f"refined: {refinement_text(gait)}")
            self._say(f"reference_publisher: {client.set_gait(self._request, _SOLVE_TIMEOUT)}")
            client.start_recording(str(bag))
            reception = client.listen(self._seconds)
            self._say(_reception_text(reception))
            self._say(f"recorded {client.stop_recording()}")
        return gait, reception, bag

    def _show(self, gait: "Gait", bag: Path) -> None:
        from walk_optimizer.cli.table_text import table_text
        from walk_optimizer.figures import gait_picture
        from walk_optimizer.library import GaitLibrary

        picture = self._output.absolute() / "gait.png"
        gait_picture(gait, picture)
        print(f"\n{table_text(GaitLibrary(self._walker))}\n")
        print(f"bag      {bag}\npicture  {picture}")

    def _require_nodes(self) -> None:
        """Raise SolveFailedError when a node has ended, with what it said last."""
        for node in self._nodes:
            if node.exit_code is not None:
                last = (node.output().strip().splitlines() or ["nothing was printed"])[-1]
                raise SolveFailedError(f"{node.name} ended with exit code {node.exit_code}: {last}")

    def _say(self, text: str) -> None:
        print(f"[{time.monotonic() - self._begin:6.1f} s] {text}", flush=True)


def _reception_text(reception: "Reception") -> str:
    verdict = "as the gait says" if reception.right else "NOT as the gait says"
    return (
        f"received {reception.messages} joint references over {reception.span:.2f} s, {verdict}: largest "
        f"deviation {reception.position:.1e} rad, {reception.velocity:.1e} rad/s, {reception.effort:.1e} N m"
    )


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Let SIGTERM unwind the program, so that no node is left behind."""

    def leave(number: int, _frame: object) -> NoReturn:
        sys.exit(128 + number)

    former = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, former)
