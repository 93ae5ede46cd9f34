"""The tools of the benchmarks: processes of their own, and pages that are renewed in parts."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
SPEED = BENCHMARKS / "speed.py"


def test_a_measurement_past_its_time_limit_is_killed_and_says_so():
    from isolation import run_isolated

    began = time.monotonic()
    measured = run_isolated(time.sleep, 600.0, time_limit=1.0)
    assert measured.value is None
    assert measured.error == "not done after 1 s"
    assert time.monotonic() - began < 60


def test_a_measurement_that_fails_says_why():
    import os

    from isolation import run_isolated

    assert run_isolated(int, "twelve", time_limit=60.0).error.startswith("ValueError: invalid literal")
    assert run_isolated(os._exit, 3, time_limit=60.0).error == "process ended with code 3"


def test_memory_is_that_of_the_measurement_alone():
    from isolation import peak_memory, run_isolated

    ballast = bytearray(b"x") * 400_000_000
    measured = run_isolated(peak_memory, time_limit=60.0)
    assert peak_memory() > 380
    assert 5 < measured.value <= measured.peak_memory < 300
    assert ballast[-1] == ord("x")


def test_a_section_is_renewed_without_touching_the_others(tmp_path):
    from report import save_section

    page, order = tmp_path / "page.md", ["First", "Second"]
    for heading, text in (("Second", "two"), ("First", "one"), ("Second", "another two")):
        save_section(page, "# Title\n\nIntroduction.", order, heading, text)
    assert page.read_text() == "# Title\n\nIntroduction.\n\n## First\n\none\n\n## Second\n\nanother two\n"


def test_goals_are_judged_by_the_geometric_mean():
    from bench import verdict

    assert verdict("10 times", [5.0, 45.0], 10) == "Goal: 10 times. Measured: 15 times (from 5 to 45), met."
    assert verdict("10 times", [9.9], 10).endswith("Measured: 9.9 times, **missed**.")
    assert verdict("10 times", [float("nan")], 10) == "Goal: 10 times. Nothing could be compared."


def test_an_unknown_part_is_refused_with_the_parts_that_there_are():
    run = subprocess.run(
        [sys.executable, SPEED, "--only", "cold,colder"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 2
    assert "unknown part colder; there are cold,table,resolve,growth,startup" in run.stderr


@pytest.mark.parametrize("name", ["blended_speeds", "joining_subscribers", "linear_solvers"])
def test_a_benchmark_without_options_does_not_begin_when_one_is_given(name):
    if name == "joining_subscribers":
        pytest.importorskip("rclpy")
    for argument, code, told in (("--help", 0, "usage: "), ("--quick", 2, "unrecognized arguments: --quick")):
        command = [sys.executable, BENCHMARKS / f"{name}.py", argument]
        run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
        assert (run.returncode, told in run.stdout + run.stderr) == (code, True)


def test_a_random_request_without_a_gait_stays_in_the_table_with_the_reason():
    from random_requests import Trial, summary

    from walk_optimizer.optimizer import Outcome
    from walk_optimizer.request import GaitRequest
    from walk_optimizer.solve.status import SolveReport, Status

    report = SolveReport(Status.INFEASIBLE, "dynamics is off", "ipopt", solve_time=1.5)
    page = summary([Trial(7, GaitRequest.for_step(0.25, 0.785, "stiffness", 40), Outcome(None, report))])
    assert "- certified gaits: 0 of 1 (0.0 %)" in page
    assert page.endswith("| 7 | 0.250 | 0.785 | stiffness | 40 | dynamics is off |\n")
