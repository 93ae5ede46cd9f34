"""Jobs that a test's worker process does instead of solving."""

import os
import subprocess
import sys
import time

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.solve.status import Progress


def work(job, progress):
    """Do what the first word of the job says."""
    verb, *rest = job.split()
    verbs = {
        "echo": echo,
        "pid": pid,
        "sleep": sleep,
        "raise": fail,
        "die": die,
        "child": child,
        "survivor": survivor,
    }
    return verbs[verb](rest, progress)


def echo(words, progress):
    return " ".join(words)


def pid(words, progress):
    return os.getpid()


def sleep(words, progress):
    """Report the process id as the iteration, until killed."""
    begin = time.monotonic()
    while True:
        progress(Progress("sleeping", os.getpid(), 1.5, 0.0, time.monotonic() - begin))
        time.sleep(0.02)


def fail(words, progress):
    raise InvalidRequestError("refused") if words == ["known"] else RuntimeError("surprise")


def die(words, progress):
    os._exit(1)


def child(words, progress):
    """Start a process as a compiler would be started, tell its id, and wait for it."""
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    progress(Progress("child", process.pid, 0.0, 0.0, 0.0))
    process.wait()


def survivor(words, progress):
    """Leave behind a fork that outlives this process with all of its open files, and tell its id."""
    fork = os.fork()
    if fork == 0:
        os.setsid()
        time.sleep(600)
        os._exit(0)
    progress(Progress("survivor", fork, 0.0, 0.0, 0.0))
    time.sleep(600)
