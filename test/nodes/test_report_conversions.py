"""Reports, rows of the table and progress survive being messages."""

import math
import re
from dataclasses import fields
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from library.made_up_gait import made_up_gait

from walk_optimizer.errors import GaitFileError
from walk_optimizer.library.entries import LibraryEntry, Source, summarize
from walk_optimizer.nodes.conversions import (
    REFUSED,
    progress_to_message,
    report_from_message,
    report_to_message,
    summary_to_message,
)
from walk_optimizer.solve.status import FamilyViolation, Progress, SolveReport, Status


def test_a_report_survives_the_message():
    violations = (FamilyViolation("dynamics", 2.5, "N"), FamilyViolation("speed", 0.1, "m/s"))
    report = SolveReport(Status.INFEASIBLE, "no", "ipopt", "kinematic", 3, 41, 1.25, 7.5, violations)
    assert report_from_message(report_to_message(report)) == report


@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("status", "optimal", "no status 'optimal'; there are solved, "),
        ("unit", ["N", "N"], "columns of its violations are not equally long"),
    ],
)
def test_a_report_that_makes_no_sense_is_refused(name, value, fault):
    message = report_to_message(SolveReport(Status.INFEASIBLE, "no", "ipopt"))
    setattr(message, name, value)
    with pytest.raises(GaitFileError, match=fault):
        report_from_message(message)


def test_the_message_documents_every_word_for_how_a_solve_ended():
    source = Path(__file__).resolve().parents[2] / "walk_optimizer_interfaces" / "msg" / "SolverReport.msg"
    words = re.search(r"# status: (.*?) when", source.read_text(), re.DOTALL)[1]
    assert set(re.findall(r"\w+", words)) == {*map(str, Status), REFUSED}


def test_a_row_of_the_table_keeps_every_value(tmp_path):
    (row,) = summarize([LibraryEntry(made_up_gait(mode="none"), Source.CACHE, tmp_path)])
    message = summary_to_message(row)
    kept = {one.name for one in fields(row)} - {"source"}
    assert kept == set(message.get_fields_and_field_types())
    assert {name: getattr(message, name) for name in kept} == {name: getattr(row, name) for name in kept}


def test_progress_tells_the_time_that_is_left_and_never_less_than_none():
    progress = Progress("fixed_schedule", 4, 2.0, math.nan, elapsed=3.0)
    message = progress_to_message(progress, 10.0)
    assert (message.stage, message.iteration, message.objective, message.time_left) == (
        "fixed_schedule",
        4,
        2.0,
        7.0,
    )
    assert progress_to_message(progress, 2.0).time_left == 0.0
