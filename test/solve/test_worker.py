import errno
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from solve.worker_jobs import work

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.solve import worker as worker_module
from walk_optimizer.solve import worker_process
from walk_optimizer.solve.status import Status
from walk_optimizer.solve.worker import BusyError, PoolState, WorkerPool
from walk_optimizer.solve.worker_task import SolveStoppedError

PATIENCE = 120.0
FOREVER = 1e6


@pytest.fixture
def pool():
    pool = WorkerPool(work, workers=1, queue_limit=2)
    yield pool
    pool.close()


class FirstProgress:
    """Keeps the first progress event of a job."""

    def __init__(self):
        self._event, self._came = None, threading.Event()

    def __call__(self, event):
        self._event = self._event or event
        self._came.set()

    def wait(self):
        assert self._came.wait(PATIENCE)
        return self._event


def exists(pid):
    """Whether a process runs; a dead one that nobody has waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_until_gone(pid):
    deadline = time.monotonic() + PATIENCE
    while exists(pid):
        assert time.monotonic() < deadline, f"process {pid} still runs"
        time.sleep(0.01)


def status_of(ticket):
    error = ticket.future.exception(PATIENCE)
    assert isinstance(error, SolveStoppedError), error
    return error.report.status


def test_a_job_is_answered_by_another_process_that_stays(pool):
    first = pool.submit("pid", FOREVER).future.result(PATIENCE)
    assert first != os.getpid()
    assert pool.submit("echo a b", FOREVER).future.result(PATIENCE) == "a b"
    assert pool.submit("pid", FOREVER).future.result(PATIENCE) == first


def test_cancel_answers_at_once_and_ends_the_process(pool):
    progress = FirstProgress()
    ticket = pool.submit("sleep", FOREVER, progress)
    worker = progress.wait().iteration
    ticket.cancel()
    assert ticket.future.done()  # Nobody has to wait for the process to end.
    assert status_of(ticket) is Status.CANCELLED
    wait_until_gone(worker)
    assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"


def test_a_process_that_is_still_starting_outlives_a_job_that_is_given_up(pool):
    ticket = pool.submit("pid", FOREVER)
    deadline = time.monotonic() + PATIENCE
    while ticket.progress.stage == "queued":
        assert time.monotonic() < deadline
    (worker,) = pool._workers.values()
    ticket.cancel()
    assert pool.submit("pid", FOREVER).future.result(PATIENCE) == worker._process.pid


def test_a_cancelled_report_keeps_the_last_iterate(pool):
    progress = FirstProgress()
    ticket = pool.submit("sleep", FOREVER, progress)
    event = progress.wait()
    ticket.cancel()
    report = ticket.future.exception().report
    assert (report.iterations, report.objective) == (event.iteration, 1.5)
    assert report.message == Status.CANCELLED.sentence


def test_a_ticket_tells_where_its_job_stands_also_while_the_solver_is_silent(pool):
    progress = FirstProgress()
    running = pool.submit("sleep", FOREVER, progress)
    waiting = pool.submit("echo", FOREVER)
    progress.wait()
    assert pool.state() == PoolState(workers=1, running=1, waiting=1)
    first, second = running.progress, running.progress
    assert (first.stage, first.objective) == ("sleeping", 1.5)
    assert second.elapsed > first.elapsed
    assert (waiting.progress.stage, waiting.progress.elapsed) == ("queued", 0.0)
    running.cancel()
    waiting.future.result(PATIENCE)
    assert pool.state() == PoolState(workers=1, running=0, waiting=0)


def test_what_the_job_has_started_is_killed_too(pool):
    progress = FirstProgress()
    ticket = pool.submit("child", FOREVER, progress)
    grandchild = progress.wait().iteration
    ticket.cancel()
    wait_until_gone(grandchild)


def test_a_killed_worker_is_told_and_replaced(pool):
    progress = FirstProgress()
    ticket = pool.submit("sleep", FOREVER, progress)
    os.kill(progress.wait().iteration, signal.SIGKILL)
    assert status_of(ticket) is Status.WORKER_LOST
    assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"


def test_a_worker_that_died_idle_is_replaced_unnoticed(pool):
    worker = pool.submit("pid", FOREVER).future.result(PATIENCE)
    os.kill(worker, signal.SIGKILL)
    # A process is dead for its parent when the last of its threads is.
    deadline = time.monotonic() + PATIENCE
    while pool.state().workers:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"


def test_a_process_that_cannot_be_started_is_an_answer_and_the_next_job_is_done(pool, monkeypatch):
    os.kill(pool.submit("pid", FOREVER).future.result(PATIENCE), signal.SIGKILL)
    deadline = time.monotonic() + PATIENCE
    while pool.state().workers:
        assert time.monotonic() < deadline
        time.sleep(0.01)

    def no_process(_function):
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    with monkeypatch.context() as patch:
        patch.setattr(worker_module, "WorkerHandle", no_process)
        error = pool.submit("echo lost", FOREVER).future.exception(PATIENCE)
    assert isinstance(error, SolveFailedError)
    assert str(error) == "no process for the solve: Resource temporarily unavailable"
    assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"


def test_a_first_process_that_cannot_be_started_is_an_answer_and_the_next_job_is_done(monkeypatch):
    tried = threading.Event()

    def no_process(_function):
        tried.set()
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    with monkeypatch.context() as patch:
        patch.setattr(worker_module, "WorkerHandle", no_process)
        pool = WorkerPool(work)
        assert tried.wait(PATIENCE)
        assert pool.state() == PoolState(workers=0, running=0, waiting=0)
        error = pool.submit("echo lost", FOREVER).future.exception(PATIENCE)
    try:
        assert isinstance(error, SolveFailedError)
        assert str(error) == "no process for the solve: Too many open files"
        assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"
    finally:
        pool.close()


def test_a_pool_that_never_had_a_process_is_closed(monkeypatch):
    def no_process(_function):
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr(worker_module, "WorkerHandle", no_process)
    pool = WorkerPool(work)
    pool.close()
    assert not any(thread.name.startswith("solve_worker") for thread in threading.enumerate())


def test_a_worker_that_exits_by_itself_is_lost(pool):
    assert status_of(pool.submit("die", FOREVER)) is Status.WORKER_LOST


def test_time_limit_is_enforced_from_outside():
    pool = WorkerPool(work, grace=0.1)
    try:
        progress = FirstProgress()
        ticket = pool.submit("sleep", 0.3, progress)
        assert status_of(ticket) is Status.TIME_LIMIT
        wait_until_gone(progress.wait().iteration)
        assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"
    finally:
        pool.close()


def test_what_outlives_a_killed_worker_is_not_taken_for_it():
    pool = WorkerPool(work, grace=0.1)
    progress = FirstProgress()
    try:
        assert status_of(pool.submit("survivor", 0.3, progress)) is Status.TIME_LIMIT
        assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"
    finally:
        os.kill(progress.wait().iteration, signal.SIGKILL)
        pool.close()


def test_two_clients_share_one_solve(pool):
    progress, other = FirstProgress(), FirstProgress()
    first = pool.submit("sleep", FOREVER, progress)
    worker = progress.wait().iteration
    second = pool.submit("sleep", FOREVER, other)
    assert other.wait().iteration == worker
    first.cancel()
    assert status_of(first) is Status.CANCELLED
    assert exists(worker)
    assert not second.future.done()
    second.cancel()
    wait_until_gone(worker)


def test_a_full_queue_is_busy_and_frees_up(pool):
    running = FirstProgress()
    tickets = [pool.submit("sleep", FOREVER, running)]
    running.wait()
    tickets += [pool.submit(f"echo {number}", FOREVER) for number in range(2)]
    with pytest.raises(BusyError, match="busy: 2 solves are waiting, no more than 2 may"):
        pool.submit("echo 2", FOREVER)
    assert pool.submit("echo 1", FOREVER).future is not tickets[2].future  # The same job needs no place.
    tickets[1].cancel()
    assert status_of(tickets[1]) is Status.CANCELLED
    last = pool.submit("echo 2", FOREVER)
    tickets[0].cancel()
    assert last.future.result(PATIENCE) == "2"


def test_a_flood_is_answered_to_the_last_request(pool):
    def answer(number):
        try:
            return pool.submit(f"echo {number % 5}", FOREVER).future
        except BusyError as error:
            return error

    answers = [answer(number) for number in range(1000)]
    assert all(isinstance(one, BusyError) or one.result(PATIENCE) in set("01234") for one in answers)


@pytest.mark.parametrize(("words", "message"), [("known", "refused"), ("unknown", "unexpectedly.*surprise")])
def test_an_exception_is_an_answer(pool, words, message):
    error = pool.submit(f"raise {words}", FOREVER).future.exception(PATIENCE)
    assert isinstance(error, SolveFailedError)
    with pytest.raises(SolveFailedError, match=message):
        raise error
    assert pool.submit("echo next", FOREVER).future.result(PATIENCE) == "next"


def test_where_a_mistake_was_made_is_logged(caplog):
    _, connection = multiprocessing.Pipe()
    assert isinstance(worker_process._run(work, "raise unknown", connection), worker_process.Failed)
    assert "Traceback" in caplog.text
    assert "surprise" in caplog.text


def test_close_ends_everything(pool):
    progress = FirstProgress()
    running = pool.submit("sleep", FOREVER, progress)
    waiting = pool.submit("echo", FOREVER)
    worker = progress.wait().iteration
    pool.close()
    assert not exists(worker)
    assert status_of(running) is status_of(waiting) is Status.CANCELLED
    assert {str(one.future.exception()) for one in (running, waiting)} == {
        "the solver is shutting down; ask again when it runs"
    }
    assert not any(thread.name.startswith("solve_worker") for thread in threading.enumerate())
    with pytest.raises(BusyError, match="shutting down"):
        pool.submit("echo", FOREVER)


PARENT = """
import sys, time
from solve.worker_jobs import work
from walk_optimizer.solve.worker import WorkerPool
if __name__ == "__main__":
    pool = WorkerPool(work)
    pool.submit("sleep", 1e6, lambda event: print(event.iteration, flush=True))
    time.sleep(0 if sys.argv[1] == "return" else 600)
    if sys.argv[1] == "return":
        sys.stdin.readline()
"""


@pytest.mark.parametrize("end", ["return", "killed"])
def test_no_worker_outlives_its_parent(tmp_path, end):
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)}
    pipe = subprocess.PIPE
    command = [sys.executable, script, end]
    parent = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment)
    worker = int(parent.stdout.readline())
    if end == "killed":
        parent.kill()
    parent.stdin.close()
    parent.stdout.close()
    assert parent.wait(PATIENCE) == (-signal.SIGKILL if end == "killed" else 0)
    wait_until_gone(worker)


def test_unknown_objective_is_nan(pool):
    assert math.isnan(pool.submit("die", FOREVER).future.exception(PATIENCE).report.objective)
