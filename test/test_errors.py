"""Messages show what they got, but never a whole book."""

import pytest

from walk_optimizer.cli.main import main
from walk_optimizer.errors import InvalidRequestError, WalkOptimizerError, quoted
from walk_optimizer.library import parse_selection
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import parse_speed

HUGE = "beginning" + 100_000 * "x" + "end"


def test_a_short_value_is_quoted_as_it_is():
    assert quoted("it's 1 m/s") == '"it\'s 1 m/s"'
    assert quoted(["u1", "u2"]) == "['u1', 'u2']"


def test_of_a_long_one_both_ends_are_left():
    text = quoted(HUGE)
    assert text.startswith("'beginning")
    assert text.endswith("end'")
    assert "... 99914 characters ..." in text
    assert len(text) < 150


def test_a_number_that_python_does_not_write_is_told():
    assert quoted(10**5000) == "a number of too many digits"


@pytest.mark.parametrize("refuse", [SpringMode.parse, parse_selection, parse_speed])
def test_refusals_of_requests_are_short(refuse):
    with pytest.raises(InvalidRequestError) as refusal:
        refuse(HUGE)
    assert len(str(refusal.value)) < 300


@pytest.mark.parametrize(
    "arguments", [["--points", HUGE], ["--points", "9" * 400], ["--speed", HUGE], ["--spring", HUGE]]
)
def test_refusals_of_the_command_line_are_short(arguments, capsys):
    code = main(["solve", "--speed", "0.3", *arguments])
    assert code == 2
    assert len(capsys.readouterr().err) < 400


def test_refusals_of_parameters_are_short():
    parameters = pytest.importorskip("walk_optimizer.nodes.parameters")
    with pytest.raises(WalkOptimizerError) as refusal:
        parameters.require_name(HUGE + " ")
    assert len(str(refusal.value)) < 400
