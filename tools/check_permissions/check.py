"""Try the permissions that sros2 made of the policy in a Fast DDS that is built with security.

    .venv/bin/python tools/check_permissions/check.py KEYSTORE

KEYSTORE is what `ros2 security generate_artifacts` made. In each enclave a writer and a reader are tried for
every name that the policy knows, and what Fast DDS allows is compared with the policy. Then references are
sent from the publisher's enclave and by a stranger without keys, to the operator and to a stranger. Needs a
C++ compiler and Fast DDS 2 with its headers; CPATH and LIBRARY_PATH say where, if not in the usual places.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test"))

from security.policies import enclaves  # noqa: E402

REFERENCES = "rt/reference_publisher/joint_reference"
PUBLISHER, OPERATOR = "/walk_optimizer/reference_publisher", "/walk_optimizer/operator"
STRANGER = "-"
SECONDS = "6"

Endpoint = tuple[str, str]


def endpoints(rule: str, name: str) -> set[Endpoint]:
    """Return the DDS writers and readers that a rule of a policy stands for."""
    if rule in ("publish", "subscribe"):
        return {(rule, f"rt{name}")}
    if rule == "reply":
        return {("subscribe", f"rq{name}Request"), ("publish", f"rr{name}Reply")}
    if rule == "request":
        return {("publish", f"rq{name}Request"), ("subscribe", f"rr{name}Reply")}
    service, topic = ("reply", "publish") if rule == "execute" else ("request", "subscribe")
    parts = [(service, part) for part in ("send_goal", "cancel_goal", "get_result")]
    parts += [(topic, part) for part in ("feedback", "status")]
    return set().union(*(endpoints(kind, f"{name}/_action/{part}") for kind, part in parts))


def allowed_by(allowed: dict[str, set[str]]) -> set[Endpoint]:
    """Return all writers and readers of an enclave, with those that rmw itself needs."""
    rules = [endpoints(rule, name) for rule, names in allowed.items() for name in names]
    return set().union(*rules, {(rule, "ros_discovery_info") for rule in ("publish", "subscribe")})


class Probe:
    """The compiled program `probe`."""

    def __init__(self, folder: Path, keystore: Path) -> None:
        """Compile it into a folder."""
        self._program, self._enclaves = folder / "probe", keystore / "enclaves"
        source = Path(__file__).with_name("probe.cpp")
        command = ["c++", "-std=c++17", source, "-lfastrtps", "-lfastcdr", "-o", self._program]
        subprocess.run(command, check=True)

    def start(self, enclave: str, lines: set[Endpoint], *seconds: str) -> subprocess.Popen[str]:
        """Ask for writers and readers in an enclave, or as a stranger."""
        folder = enclave if enclave == STRANGER else str(self._enclaves / enclave.lstrip("/"))
        process = subprocess.Popen(
            [self._program, folder, *seconds],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert process.stdin is not None  # noqa: S101  # it is a pipe
        process.stdin.write("".join(f"{rule} {name}\n" for rule, name in sorted(lines)))
        process.stdin.close()
        return process

    def allowed(self, enclave: str, lines: set[Endpoint]) -> set[Endpoint]:
        """Return those writers and readers that may be created."""
        answers = [line.split() for line in _output(self.start(enclave, lines)).splitlines()]
        if len(answers) != len(lines):
            raise SystemExit(
                f"{enclave}: {len(answers)} answers to {len(lines)} questions; are its keys there?"
            )
        return {(rule, name) for rule, name, answer in answers if answer == "yes"}

    def received(self, sender: str, receivers: list[str]) -> list[int]:
        """Return how many references each receiver gets from a sender."""
        writer = self.start(sender, {("publish", REFERENCES)}, SECONDS)
        readers = [self.start(receiver, {("subscribe", REFERENCES)}, SECONDS) for receiver in receivers]
        counts = [int(_output(reader).split()[-1]) for reader in readers]
        writer.wait()
        return counts


def _output(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None  # noqa: S101  # it is a pipe
    text = process.stdout.read()
    process.wait()
    return text


def main() -> int:
    """Check, and return whether everything was as the policy says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("keystore", type=Path)
    wanted = {path: allowed_by(allowed) for path, allowed in enclaves().items()}
    names = {name for endpoints in wanted.values() for _, name in endpoints}
    tried = {(rule, name) for rule in ("publish", "subscribe") for name in names}
    right = True
    with tempfile.TemporaryDirectory() as folder:
        probe = Probe(Path(folder), parser.parse_args().keystore.resolve())
        for enclave, expected in wanted.items():
            wrong = probe.allowed(enclave, tried) ^ expected
            right &= not wrong
            print(f"{enclave}: {len(expected)} of {len(tried)} allowed, {len(wrong)} not as the policy says")
        for sender, reached in ((PUBLISHER, [True, False]), (STRANGER, [False, True])):
            counts = probe.received(sender, [OPERATOR, STRANGER])
            right &= [count > 0 for count in counts] == reached
            print(f"references of {sender}: operator received {counts[0]}, a stranger {counts[1]}")
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
