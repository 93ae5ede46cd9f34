"""Independent solves are shared out between processes, and come back as if one had done them."""

import ctypes
import multiprocessing
import multiprocessing.connection
import os
import signal
import time

import numpy as np
import pytest
from solve.small_programs import START, rosenbrock

from walk_optimizer.solve import session as session_module
from walk_optimizer.solve import sharing
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.sharing import Shares, free_processors
from walk_optimizer.solve.status import Status


def never():
    return False


def who(number):
    time.sleep(0.05)
    return os.getpid()


@pytest.fixture
def session(monkeypatch):
    monkeypatch.setattr(session_module, "processor_count", lambda: 2)
    return SolveSession(solver_settings(), 60.0, None)


def running_children():
    return multiprocessing.active_children()


@pytest.mark.parametrize("processes", [1, 2, 3])
def test_every_piece_is_done_once_by_as_many_processes_as_asked(processes):
    results = Shares(who, 12).done(processes, never, int)
    assert sorted(results) == list(range(12))
    assert len(set(results.values())) == processes
    assert os.getpid() in results.values()
    assert running_children() == []


def test_processes_that_share_work_leave_each_other_their_processors(monkeypatch):
    monkeypatch.setattr(sharing, "processor_count", lambda: 3)
    assert free_processors() == 3
    assert set(Shares(lambda _: free_processors(), 8).done(2, never, int).values()) == {2}
    assert set(Shares(lambda _: free_processors(), 8).done(5, never, int).values()) == {1}
    assert free_processors() == 3


def test_no_more_processes_than_pieces_and_none_for_nothing():
    assert set(Shares(who, 1).done(4, never, int).values()) == {os.getpid()}
    assert Shares(who, 0).done(4, never, int) == {}


def test_a_stop_ends_the_forks_at_once():
    begin = time.monotonic()
    own = os.getpid()

    def work(number):
        time.sleep(0.1 if os.getpid() == own else 60)
        return number

    results = Shares(work, 100).done(2, lambda: time.monotonic() - begin > 0.5, int)
    assert time.monotonic() - begin < 10
    assert 1 <= len(results) < 100
    assert running_children() == []


@pytest.mark.parametrize("parent_ends", ["before the fork's first line", "while the fork works"])
def test_a_fork_ends_with_a_parent_that_is_killed(monkeypatch, parent_ends):
    receiver, sender = multiprocessing.Pipe(duplex=False)
    load_library = ctypes.CDLL

    def load_library_late(name):
        while parent_ends.startswith("before") and os.getppid() == parent:
            time.sleep(0.001)
        return load_library(name)

    def work():
        sender.send("works")
        time.sleep(60)

    parent = os.fork()
    if parent == 0:
        parent = os.getpid()
        monkeypatch.setattr(sharing.ctypes, "CDLL", load_library_late)
        sharing.start_fork(work)
        time.sleep(60)
        os._exit(0)
    sender.close()
    if parent_ends.startswith("while"):
        assert receiver.poll(10)
        assert receiver.recv() == "works"
    else:
        time.sleep(0.2)
    os.kill(parent, signal.SIGKILL)
    os.waitpid(parent, 0)
    # The pipe ends once nobody has it open.
    assert receiver.poll(10)
    with pytest.raises(EOFError):
        receiver.recv()


def test_the_session_maps_in_order_and_counts_all_iterations(session):
    starts = [START + 0.1 * k for k in range(6)]

    def solve(start):
        return session.solve(rosenbrock(), start, "search", objective_unit=1.0)

    alone = [solve(start) for start in starts]
    counted = session.iterations
    shared = session.map(solve, starts)
    assert session.iterations == 2 * counted
    for one, other in zip(alone, shared, strict=True):
        assert one.status is other.status is Status.SOLVED
        np.testing.assert_array_equal(one.x, other.x)


def test_what_a_lost_fork_had_is_done_again(session):
    own = os.getpid()

    def work(number):
        time.sleep(0.05)
        if os.getpid() != own:
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    assert session.map(work, range(6)) == list(range(6))


def test_what_a_fork_had_that_is_lost_while_it_sends_is_done_again(session, monkeypatch):
    def cut_off(connection, _results):
        header = (1000).to_bytes(4, "big")  # of a message of which ten bytes follow
        os.write(connection.fileno(), header + bytes(10))
        os.kill(os.getpid(), signal.SIGKILL)

    monkeypatch.setattr(multiprocessing.connection.Connection, "send", cut_off)
    assert session.map(lambda number: time.sleep(0.02) or number, range(6)) == list(range(6))


def test_an_error_in_a_fork_is_raised_here(session):
    own = os.getpid()

    def work(number):
        time.sleep(0.05)
        if number == 3:
            raise ValueError("number three")
        return os.getpid() == own

    with pytest.raises(ValueError, match="number three"):
        session.map(work, range(6))
    assert running_children() == []


def test_a_cancel_while_forks_work_ends_the_map(monkeypatch):
    monkeypatch.setattr(session_module, "processor_count", lambda: 2)
    own, told = os.getpid(), []

    def progress(one):
        told.append(one)
        return False

    session = SolveSession(solver_settings(), 60.0, progress)

    def work(start):
        if os.getpid() != own:
            time.sleep(60)
        return session.solve(rosenbrock(), start, "search", objective_unit=1.0)

    begin = time.monotonic()
    session.map(work, [START, START, START])
    assert time.monotonic() - begin < 10
    assert session.verdict is Status.CANCELLED
    assert told
    assert session.map(work, [START]) == [], "nothing more is tried"


def test_the_time_limit_ends_the_map(monkeypatch):
    monkeypatch.setattr(session_module, "processor_count", lambda: 2)
    session = SolveSession(solver_settings(), 0.3, None)
    own = os.getpid()

    def work(start):
        time.sleep(0.1 if os.getpid() == own else 60)
        return session.solve(rosenbrock(), start, "search", objective_unit=1.0)

    begin = time.monotonic()
    session.map(work, [START] * 100)
    assert time.monotonic() - begin < 10
    assert session.verdict is Status.TIME_LIMIT


def test_the_time_limit_counts_while_it_waits_for_others(monkeypatch):
    monkeypatch.setattr(session_module, "processor_count", lambda: 2)
    session = SolveSession(solver_settings(), 0.5, None)
    own = os.getpid()

    def work(number):
        time.sleep(0.1 if os.getpid() == own else 60)
        return number

    begin = time.monotonic()
    session.map(work, range(2))
    assert time.monotonic() - begin < 10
    assert session.verdict is Status.TIME_LIMIT
