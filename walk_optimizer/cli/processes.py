"""The suite's nodes as processes of this one: start, watch, stop; none is left behind."""

import contextlib
import ctypes
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from walk_optimizer.resources import config_file

NODES = ("gait_optimizer", "gait_library", "reference_publisher")

# How long a node may take to close its bag and its worker in [s].
STOP_PATIENCE = 20.0

# Fast DDS: the first participant of a domain listens on this port, each domain 250 further.
_FIRST_PORT = 7410
_PORTS_PER_DOMAIN = 250
# Above this the ports reach into those that Linux hands out to anybody.
_LAST_DOMAIN = 101

# Loaded here: between fork and exec only the call itself is safe.
_LIBC = ctypes.CDLL(None)
_PR_SET_PDEATHSIG = 1


def free_domain() -> int:
    """Return a ROS domain that nobody on this machine uses."""
    domains = random.sample(range(1, _LAST_DOMAIN + 1), _LAST_DOMAIN)
    return next((domain for domain in domains if _is_free(domain)), domains[0])


def _is_free(domain: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", _FIRST_PORT + _PORTS_PER_DOMAIN * domain))
        except OSError:
            return False
    return True


def isolated_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with a ROS domain of its own on this machine, unless it names one."""
    isolated = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **environment}
    if not isolated.get("ROS_DOMAIN_ID"):
        isolated["ROS_DOMAIN_ID"] = str(free_domain())
    return isolated


def node_command(name: str, arguments: Sequence[str] = ()) -> list[str]:
    """Return the command line of a node with its parameter file.

    Args:
        name: Of the node's executable.
        arguments: Further arguments behind `--ros-args`; they win over the file.
    """
    executable = shutil.which(name, path=str(Path(sys.executable).parent))
    start = [executable] if executable else [sys.executable, "-m", f"walk_optimizer.nodes.{name}"]
    return [*start, "--ros-args", "--params-file", str(config_file(f"{name}.yaml")), *arguments]


class NodeProcess:
    """A node in a process of its own.

    Attributes:
        name: Of its executable.
        log: File with what it prints.
    """

    def __init__(
        self,
        name: str,
        log: Path,
        arguments: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start the process.

        Args:
            name: Of the node's executable.
            log: File to create.
            arguments: Further ROS arguments.
            environment: Of the process; this one's by default.
        """
        self.name, self.log = name, log
        with log.open("wb") as output:
            # In a session of its own, Ctrl-C reaches only us, and we stop the nodes in order.
            self.process = subprocess.Popen(
                node_command(name, arguments),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=dict(environment) if environment is not None else None,
                start_new_session=True,
                preexec_fn=_end_with_parent,  # noqa: PLW1509  # one system call
            )

    @property
    def exit_code(self) -> int | None:
        """Exit code; None while it runs."""
        return self.process.poll()

    def output(self) -> str:
        """Return what it has printed so far."""
        return self.log.read_text(encoding="utf-8", errors="replace")

    def stop(self, number: signal.Signals = signal.SIGINT) -> int:
        """Ask the process to stop, and return its exit code; one that does not stop in time is killed."""
        with contextlib.suppress(ProcessLookupError):
            self.process.send_signal(number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(STOP_PATIENCE)
        self.kill()
        return self.process.wait()

    def kill(self) -> None:
        """End the process at once, whatever it is doing."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


def _end_with_parent() -> None:
    """Have Linux stop this process when its parent is killed; elsewhere nothing happens."""
    with contextlib.suppress(AttributeError):
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


@contextlib.contextmanager
def running_nodes(logs: Path, environment: Mapping[str, str]) -> Iterator[list[NodeProcess]]:
    """Run the three nodes; when this is left, whatever the reason, none of them is.

    Args:
        logs: Folder for what they print.
        environment: Of the processes.
    """
    nodes: list[NodeProcess] = []
    try:
        nodes.extend(NodeProcess(name, logs / f"{name}.log", environment=environment) for name in NODES)
        yield nodes
    finally:
        _stop_all(nodes)


def _stop_all(nodes: Sequence[NodeProcess]) -> None:
    """Ask all nodes to stop at the same time, then kill those that have not."""
    try:
        for node in nodes:
            with contextlib.suppress(ProcessLookupError):
                node.process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + STOP_PATIENCE
        for node in nodes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                node.process.wait(max(deadline - time.monotonic(), 0.0))
    finally:
        for node in nodes:
            node.kill()
