"""Requests are refused before any work, in words that say what is allowed."""

import math
import tracemalloc
from dataclasses import asdict

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from walk_optimizer.errors import ConfigurationError, InvalidRequestError, quoted
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import GaitRequest, GaitTableSettings, gait_table_settings, parse_speed
from walk_optimizer.resources import settings_from_yaml

SETTINGS = gait_table_settings()
# Beyond all floats; the larger one is beyond what Python writes.
HUGE = pytest.mark.parametrize("value", [10**400, 10**5000], ids=["huge", "unwritten"])


def refusal(make, *arguments, **keywords):
    with pytest.raises(InvalidRequestError) as caught:
        make(*arguments, **keywords)
    return str(caught.value)


@pytest.mark.parametrize(
    ("speed", "got"),
    [
        (math.nan, "nan"),
        (math.inf, "inf"),
        (-math.inf, "-inf"),
        pytest.param(10**400, "inf", id="huge"),
        pytest.param(-(10**5000), "-inf", id="negative"),
        (-0.3, "-0.3"),
        (0.0, "0"),
        (1.3, "1.3"),
    ],
)
def test_impossible_speeds(speed, got):
    allowed = "allowed is 0.15 to 1.2 m/s (0.54 to 4.32 km/h)"
    assert refusal(GaitRequest.for_speed, speed) == f"speed is {got} m/s, {allowed}"


@pytest.mark.parametrize("points", [0, -5, 1, 19, 25.0, "25", True])
def test_impossible_numbers_of_points(points):
    message = refusal(GaitRequest.for_speed, 0.4, "none", points)
    assert message == f"N is {points!r} grid points, allowed is 20 to 2000"


def test_a_huge_number_of_points_is_refused_before_memory_is_taken():
    tracemalloc.start()
    try:
        message = refusal(GaitRequest.for_speed, 0.4, "none", 10**7)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert message == "N is 10000000 grid points (about 400 GB), allowed is 20 to 2000"
    assert peak < 1e6


@HUGE
def test_a_number_of_points_beyond_all_floats_is_refused_in_a_line(value):
    message = refusal(GaitRequest.for_speed, 0.4, "none", value)
    assert "grid points (about inf GB), allowed is 20 to 2000" in message
    assert len(message) < 250


def test_whole_numbers_of_numpy_are_as_good():
    points = GaitRequest.for_speed(np.float32(0.5), "none", np.int64(25)).points
    assert points == 25
    assert type(points) is int


@pytest.mark.parametrize("speed", [True, "0.4", None])
def test_speeds_that_are_no_numbers(speed):
    assert refusal(GaitRequest.for_speed, speed) == f"speed is {speed!r}, expected a number, in m/s"


def test_unknown_modes():
    message = refusal(GaitRequest.for_speed, 0.4, "springs")
    allowed = "none, stiffness, stiffness_and_equilibrium"
    assert message == f"unknown spring mode 'springs'; allowed are {allowed}"
    assert refusal(GaitRequest.for_step, 0.3, 0.7, "springs") == message


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -0.3, True, "0.3"])
def test_impossible_steps(value):
    allowed = "allowed are finite numbers above 0"
    assert refusal(GaitRequest.for_step, value, 0.7) == f"step length is {value!r}, {allowed}"
    assert refusal(GaitRequest.for_step, 0.3, value) == f"step time is {value!r}, {allowed}"


@HUGE
def test_a_step_beyond_all_floats_is_refused_in_a_line(value):
    for name, step in (("step length", (value, 1.0)), ("step time", (1.0, value))):
        message = refusal(GaitRequest.for_step, *step)
        assert message.startswith(f"{name} is ")
        assert message.endswith(", allowed are finite numbers above 0")
        assert len(message) < 250


def test_a_step_of_impossible_speed():
    assert refusal(GaitRequest.for_step, 3.0, 0.7).startswith("speed is 4.2857143 m/s, allowed is 0.15")


def test_what_is_allowed_is_accepted():
    request = GaitRequest.for_step(0.3, 0.75, "stiffness", 20)
    assert request == GaitRequest(0.3, 0.75, SpringMode.STIFFNESS, 20)
    assert request.speed == pytest.approx(0.4)
    assert request.interval == pytest.approx(0.0375)
    assert GaitRequest.for_speed(0.4).points == SETTINGS.points == 200
    for speed in (SETTINGS.minimum_speed, SETTINGS.maximum_speed):
        request = GaitRequest.for_speed(speed)
        assert request.speed == pytest.approx(speed)
        # It is asked for again, by neighbours, files and messages.
        assert GaitRequest.for_step(request.step_length, request.step_time) == request
        assert GaitRequest.for_speed(request.speed).speed == pytest.approx(speed)


@given(st.floats(0.15, 1.2))
def test_a_speed_is_met_by_a_step_on_the_line_of_the_table(speed):
    request = GaitRequest.for_speed(speed)
    assert request.speed == pytest.approx(speed, rel=1e-12)
    along = (request.step_length - 0.20) / (0.50 - 0.20)
    assert request.step_time == pytest.approx(0.85 + along * (0.46 - 0.85), abs=1e-12)


def test_the_seven_gaits_of_the_report():
    speeds = [round(3.6 * speed, 2) for speed in SETTINGS.table_speeds()]
    reported = [0.84, 1.15, 1.50, 1.92, 2.44, 3.09, 3.92]
    # The report's figures are cut off after two decimals, or rounded.
    assert all(abs(speed - shown) <= 0.0101 for speed, shown in zip(speeds, reported, strict=True))
    assert SETTINGS.table_steps()[0] == pytest.approx((0.20, 0.85))
    assert SETTINGS.table_steps()[-1] == pytest.approx((0.50, 0.46))
    for length, time in SETTINGS.table_steps():
        assert SETTINGS.step_for_speed(length / time) == pytest.approx((length, time))


@pytest.mark.parametrize(
    ("text", "speed"),
    [
        ("0.3185", 0.3185),
        ("0.3185m/s", 0.3185),
        (" 0.3185 m/s ", 0.3185),
        ("1.15km/h", 1.15 / 3.6),
        ("1.15 km/h", 1.15 / 3.6),
        ("4e-1", 0.4),
        ("-1", -1.0),
    ],
)
def test_speeds_as_text(text, speed):
    assert parse_speed(text) == pytest.approx(speed, rel=1e-15)


@pytest.mark.parametrize(
    "text", ["", " ", "fast", "1.15mph", "1,15", "km/h", "1.15 km/h m/s", "0.3.1", "--1"]
)
def test_texts_that_are_no_speed(text):
    expected = f"speed {text!r} not understood; write 0.3185, 0.3185m/s or 1.15km/h"
    assert refusal(parse_speed, text) == expected


@pytest.mark.parametrize("text", ["nan", "inf", "1e999", "-0.4km/h"])
def test_texts_that_are_numbers_but_no_possible_speed(text):
    assert "allowed is 0.15 to 1.2 m/s" in refusal(GaitRequest.for_speed, parse_speed(text))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"gaits": None}, "missing or unknown entries: gaits"),
        ({"gait": 7}, "missing or unknown entries: gait"),
        ({"points": 0}, "points is 0, expected a positive whole number"),
        ({"maximum_speed": math.inf}, "maximum_speed is inf, expected a positive number"),
        ({"maximum_speed": "fast"}, "maximum_speed is 'fast', expected a positive number"),
        ({"gaits": 10**320}, f"gaits is {quoted(10**320)}, expected a positive whole number"),
    ],
)
def test_wrong_tables_are_refused_with_the_name_of_the_file(tmp_path, changes, expected):
    entries = {name: value for name, value in (asdict(SETTINGS) | changes).items() if value is not None}
    path = tmp_path / "table.yaml"
    path.write_text(yaml.safe_dump(entries))
    with pytest.raises(ConfigurationError) as caught:
        settings_from_yaml(GaitTableSettings, path)
    assert str(caught.value) == f"{path}: {expected}"


@pytest.mark.parametrize(
    "changes",
    [
        {"gaits": 1},
        {"gaits": 6.5},
        {"minimum_speed": 2.0},
        {"minimum_points": 4000},
        {"points": 5},
        {"points": 5000},
    ],
)
def test_tables_that_make_no_sense_are_refused(tmp_path, changes):
    path = tmp_path / "table.yaml"
    path.write_text(yaml.safe_dump(asdict(SETTINGS) | changes))
    with pytest.raises(ConfigurationError, match=next(iter(changes))):
        settings_from_yaml(GaitTableSettings, path)
