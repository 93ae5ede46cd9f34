"""Run the nodes under SROS2 with Enforce, and try who can do what with them.

    .venv/bin/python tools/check_permissions/nodes.py KEYSTORE

KEYSTORE is what `ros2 security generate_artifacts` made, with the ROS_DOMAIN_ID that is set now. The four
nodes run in their enclaves. Then a stranger without keys, a controller and the operator each try to hear
references, to be served a gait, to change a parameter, to command a speed and to publish references; an
operator is witness to what comes of it. Takes two minutes, and needs a ROS 2 whose middleware has security,
as that of a ROS distribution has.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from walk_optimizer.cli.processes import NodeProcess  # noqa: E402
from walk_optimizer.recording.info import describe_bag  # noqa: E402

NODES = ("gait_optimizer", "gait_library", "reference_publisher", "walker_visualizer")
OPERATOR, CONTROLLER, STRANGER = "operator", "controller", "stranger"
# Who can do what; the operator comes last, because it sets the walker off.
EXPECTED = {
    "hears_references": {OPERATOR, CONTROLLER},
    "is_served": {OPERATOR},
    "changes_a_parameter": set(),
    "is_obeyed": {OPERATOR},
    "is_believed": set(),
}
# How long each thing is tried, and how long a witness looks on, in [s].
TRIAL, WATCH = 4.0, 30.0

Answer = dict[str, object]


class Party:
    """A process that tries things, in an enclave or without keys."""

    def __init__(self, name: str, role: str, seconds: float, secure: Mapping[str, str], folder: Path) -> None:
        """Start it.

        Args:
            name: Of its enclave; the stranger has none.
            role: Of those that party.py knows.
            seconds: How long each thing is tried in [s].
            secure: Environment of those who have keys.
            folder: For what it prints.
        """
        program = [sys.executable, str(Path(__file__).with_name("party.py")), role, str(seconds)]
        plain = {name: value for name, value in secure.items() if not name.startswith("ROS_SECURITY")}
        enclave = [] if name == STRANGER else ["--ros-args", "--enclave", f"/walk_optimizer/{name}"]
        self._log = folder / f"{name}_{role}.log"
        with self._log.open("wb") as log:
            environment = plain if name == STRANGER else secure
            self._process = subprocess.Popen([*program, *enclave], env=environment, stdout=log, stderr=log)

    def answer(self) -> Answer:
        """Return what it found."""
        code = self._process.wait()
        # Fast DDS logs what it denies between our lines.
        output = self._log.read_text(encoding="utf-8", errors="replace")
        found = re.search(r"\{\".*\}", output)
        if found is None:
            raise SystemExit(f"a party ended with exit code {code}:\n{output}")
        return dict(json.loads(found.group()))


def abilities(name: str, secure: Mapping[str, str], folder: Path) -> set[str]:
    """Return what a party can do: what it sees itself, and what a witness sees of it."""
    witness = Party(OPERATOR, "witness", WATCH, secure, folder)
    tried = Party(name, "attempt", TRIAL, secure, folder).answer()
    seen = witness.answer()
    if not seen["present"]:
        raise SystemExit("the witness heard nothing: is the keystore for this ROS_DOMAIN_ID?")
    can = {"is_obeyed": seen["obeyed"], "is_believed": seen["believed"], **tried}
    return {what for what in EXPECTED if can[what]}


@contextlib.contextmanager
def running_nodes(folder: Path, environment: Mapping[str, str]) -> Iterator[None]:
    """Run the nodes in their enclaves."""
    nodes = []
    try:
        for name in NODES:
            arguments = ["--enclave", f"/walk_optimizer/{name}"]
            if name == "reference_publisher":
                arguments += ["-p", f"recording_folder:={folder}"]
            nodes.append(NodeProcess(name, folder / f"{name}.log", arguments, environment))
        yield
        for node in nodes:
            if node.exit_code is not None:
                raise SystemExit(f"{node.name} ended:\n{node.output()}")
    finally:
        for node in nodes:
            node.stop()


def main() -> int:
    """Try everything, and return whether all was as expected."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("keystore", type=Path)
    secure = {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        **os.environ,
        "ROS_SECURITY_KEYSTORE": str(parser.parse_args().keystore.resolve()),
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
    }
    right = True
    with tempfile.TemporaryDirectory() as name, running_nodes(folder := Path(name), secure):
        for party in (STRANGER, CONTROLLER, OPERATOR):
            can = abilities(party, secure, folder)
            right &= can == {what for what, names in EXPECTED.items() if party in names}
            print(f"{party}: {', '.join(sorted(can)) or 'can do nothing'}", flush=True)
        recorded = Party(OPERATOR, "record", TRIAL, secure, folder).answer()
        topics = sorted(topic.name for topic in describe_bag(Path(recorded["bag"])).topics)
        print(f"recorded {recorded['messages']} messages: {', '.join(topics)}")
    print("as the policy says" if right else "not as the policy says")
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
