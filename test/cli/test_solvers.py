"""The choice of a solver and of the report's formulation on the command line."""

import pytest

from walk_optimizer.cli import gaits
from walk_optimizer.cli.main import main
from walk_optimizer.gait import Certificate, CertificateEntry
from walk_optimizer.optimizer import Outcome
from walk_optimizer.optimizer.reference_solve import ReferenceOutcome
from walk_optimizer.solve import registry
from walk_optimizer.solve.status import SolveReport, Status


@pytest.fixture
def no_work(monkeypatch):
    """Fail the test if a solve begins."""

    def never(*arguments, **options):
        raise AssertionError("a solve began")

    monkeypatch.setattr(gaits, "optimize", never)
    monkeypatch.setattr(gaits, "optimize_from", never)
    monkeypatch.setattr("walk_optimizer.optimizer.reference_solve.solve_reference", never)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--solver", "knitro"], "unknown solver 'knitro'; allowed are ipopt, uno, fatrop, snopt"),
        (["--formulation", "report", "--solver", "uno"], "--formulation report is IPOPT's"),
        *[
            (
                ["--formulation", "report", *option],
                f"--formulation report can't be combined with {option[0]};",
            )
            for option in (["--save"], ["--export", "gait.csv"], ["--from-scratch"], ["--library", "gaits"])
        ],
        (
            ["--from-scratch", "--library", "gaits"],
            "--from-scratch without --save can't be combined with --library;",
        ),
    ],
)
def test_impossible_choices_are_refused_before_any_work(no_work, capsys, arguments, message):
    assert main(["solve", "--speed", "0.42", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_missing_solver_says_what_to_install(no_work, capsys, monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda _: None)
    assert main(["solve", "--speed", "0.42", "--solver", "snopt"]) == 2
    assert "pip install 'walk-optimizer[snopt]'" in capsys.readouterr().err


def test_the_choice_reaches_the_optimiser(monkeypatch, capsys):
    asked = []

    def solving(name):
        def optimize(*arguments, settings, **options):
            asked.append((name, settings.back_end))
            return Outcome(None, SolveReport(Status.INFEASIBLE, "none", settings.back_end))

        return optimize

    monkeypatch.setattr(gaits, "optimize_from", solving("neighbours"))
    monkeypatch.setattr(gaits, "optimize", solving("scratch"))
    assert main(["solve", "--speed", "0.42", "--solver", "uno"]) == 1
    assert main(["solve", "--speed", "0.42"]) == 1
    assert main(["solve", "--speed", "0.42", "--from-scratch"]) == 1
    assert asked == [("neighbours", "uno"), ("neighbours", "ipopt"), ("scratch", "ipopt")]


def test_the_reports_formulation_prints_residuals(monkeypatch, capsys):
    certificate = Certificate((CertificateEntry("dynamics", 3.0, "N", 1e-3),))

    def solve_reference(request, walker, **options):
        report = SolveReport(Status.ITERATION_LIMIT, "stopped; dynamics is off", "ipopt", iterations=3000)
        return ReferenceOutcome(None, report, certificate)

    monkeypatch.setattr("walk_optimizer.optimizer.reference_solve.solve_reference", solve_reference)
    assert main(["solve", "--speed", "0.42", "--formulation", "report"]) == 1
    shown = capsys.readouterr().out
    assert "iteration_limit: stopped; dynamics is off" in shown
    assert "3000 iterations" in shown
    assert "dynamics     3.00e+00  1.00e-03  N     FAILED" in shown
