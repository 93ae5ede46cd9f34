"""The exit codes are those that the help tells of."""

import pytest

from walk_optimizer.cli import gaits
from walk_optimizer.cli.main import main
from walk_optimizer.optimizer import Outcome
from walk_optimizer.solve.status import SolveReport, Status


@pytest.fixture
def infeasible(monkeypatch):
    """Have every solve end without a gait."""
    report = SolveReport(Status.INFEASIBLE, "worst is dynamics: 3 N", "ipopt")
    monkeypatch.setattr(gaits, "optimize_from", lambda *_, **__: Outcome(None, report))


@pytest.mark.parametrize("verb", ["solve", "export", "picture", "simulate"])
def test_whoever_asks_for_a_gait_that_there_is_not_is_told_with_1(infeasible, tmp_path, capsys, verb):
    output = ["--output", str(tmp_path / "gait.png")] if verb == "picture" else []
    assert main([verb, "--speed", "0.45", "--points", "20", "--library", str(tmp_path), *output]) == 1
    printed = capsys.readouterr()
    assert "worst is dynamics: 3 N" in printed.out + printed.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", ["solve", "export", "picture", "simulate"])
def test_a_refusal_is_told_with_2(infeasible, capsys, verb):
    assert main([verb, "--speed", "9"]) == 2
    assert capsys.readouterr().out == ""
