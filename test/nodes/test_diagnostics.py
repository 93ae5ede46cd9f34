"""Diagnostics without ROS: what checks find, also when they fail, and how numbers are told."""

from walk_optimizer.nodes.diagnostics import Diagnostics, Finding, Level
from walk_optimizer.nodes.log_text import with_fields
from walk_optimizer.nodes.optimizer_health import OptimizerHealth
from walk_optimizer.solve.status import SolveReport, Status
from walk_optimizer.solve.worker import PoolState


def test_checks_are_asked_anew_each_time_and_can_be_taken_away():
    levels = iter(Level)
    diagnostics = Diagnostics()
    diagnostics.add("one", lambda: Finding(next(levels), "well"))
    assert [diagnostics.findings()["one"].level for _ in range(2)] == [Level.OK, Level.WARN]
    diagnostics.remove("one")
    diagnostics.remove("never there")
    assert diagnostics.findings() == {}


def test_a_check_that_fails_is_an_error_and_hides_no_other():
    def broken():
        raise RuntimeError("no such thing")

    diagnostics = Diagnostics()
    diagnostics.add("broken", broken)
    diagnostics.add("whole", lambda: Finding(Level.OK, "well"))
    findings = diagnostics.findings()
    assert findings["broken"].level is Level.ERROR
    assert "no such thing" in findings["broken"].message
    assert findings["whole"] == Finding(Level.OK, "well")


def test_log_lines_tell_numbers_as_fields():
    assert with_fields("ready", gaits=21) == "ready gaits=21"
    line = with_fields("asking", speed=1.15 / 3.6, spring_mode="none")
    assert line == "asking speed=0.319444 spring_mode=none"


IDLE = PoolState(workers=2, running=0, waiting=0)


def health(*statuses, state=IDLE):
    health = OptimizerHealth(lambda: state, workers=2, queue_limit=3)
    for status in statuses:
        health.note(SolveReport(status, status.sentence, back_end="ipopt", solve_time=1.5))
    return health


def test_the_optimizer_tells_how_requests_ended():
    assert health().solves().level is Level.OK
    found = health(Status.SOLVED, Status.SOLVED, Status.CANCELLED, Status.TIME_LIMIT).solves()
    assert found.level is Level.WARN
    assert "stopped at the time limit" in found.message
    assert dict(found.values) == {
        "solved": 2,
        "cancelled": 1,
        "failed": 1,
        "last_status": "time_limit",
        "last_solve_time": 1.5,
    }
    assert health(Status.INFEASIBLE, Status.SOLVED).solves().level is Level.OK


def test_the_optimizer_tells_of_lost_workers_and_of_a_full_queue():
    assert health().workers().level is Level.OK
    lost = health(state=PoolState(workers=1, running=0, waiting=0)).workers()
    assert (lost.level, "1 of 2 workers have ended" in lost.message) == (Level.WARN, True)
    full = health(state=PoolState(workers=2, running=2, waiting=3)).workers()
    assert (full.level, "further requests are told busy" in full.message) == (Level.WARN, True)
