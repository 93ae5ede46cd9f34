import threading
import time

import pytest

pytest.importorskip("rclpy")

from walk_optimizer.nodes.pacer import Pacer, Schedule
from walk_optimizer.walk.tick_statistics import TickStatistics

PERIOD = 0.002


def test_ticks_never_come_in_a_burst_and_what_was_late_is_counted():
    times, enough = [], threading.Event()

    def tick():
        times.append(time.monotonic())
        if len(times) == 20:
            time.sleep(0.2)  # A stall of a hundred periods.
        if len(times) == 60:
            enough.set()

    pacer = Pacer(PERIOD, tick)
    assert enough.wait(60)
    pacer.stop()
    # However late a tick was, those after it keep to the schedule: each begins at its own multiple.
    for first in range(len(times)):
        for second in range(first + 1, len(times)):
            assert times[second] - times[first] > (second - first - 1) * PERIOD - 1e-4
    assert pacer.missed >= 99


@pytest.mark.parametrize(
    ("began", "ended", "following"),
    [
        (5.0, 5.3, 6),
        (5.0, 6.4, 6),  # Made up for at once.
        (5.0, 6.6, 7),  # Too late: dropped.
        (7.2, 7.3, 8),  # Never two ticks within one period.
        (5.0, 105.6, 106),
    ],
)
def test_a_tick_is_made_up_for_only_where_it_is_little_late(began, ended, following):
    schedule = Schedule(begin=100.0, period=PERIOD, statistics=TickStatistics(PERIOD))
    times = [schedule.begin + periods * PERIOD for periods in (began, ended)]
    assert schedule.next_number(5, *times) == following


class MadeUpTime:
    """Time that only passes where somebody sleeps or works."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def test_ticks_do_not_drift_however_long_they_take(monkeypatch):
    clock, times, enough = MadeUpTime(), [], threading.Event()
    monkeypatch.setattr("walk_optimizer.nodes.pacer.time", clock)

    def tick():
        times.append(clock.now)
        clock.sleep(PERIOD / 5)
        if len(times) == 1000:
            enough.set()

    pacer = Pacer(PERIOD, tick)
    assert enough.wait(60)
    pacer.stop()
    assert times[:1000] == pytest.approx([100.0 + number * PERIOD for number in range(1000)], abs=1e-9)


def test_stop_waits_for_the_last_tick():
    ticked = threading.Event()
    pacer = Pacer(0.001, ticked.set)
    assert ticked.wait(60)
    pacer.period = 0.01
    pacer.stop()
    ticked.clear()
    time.sleep(0.05)
    assert not ticked.is_set()
