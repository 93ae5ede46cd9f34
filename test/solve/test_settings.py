"""Settings of the search and of the solvers: what is refused, and in which words."""

import math
from dataclasses import asdict, replace

import pytest
import yaml

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.resources import settings_from_yaml
from walk_optimizer.solve.settings import SolverSettings, solver_settings, table_solver_settings

NUMBERS = [name for name in asdict(solver_settings()) if name != "back_end"]


def written(folder, **changes):
    """A settings file with entries changed, or left out where they are None."""
    entries = asdict(solver_settings()) | changes
    path = folder / "solver.yaml"
    path.write_text(yaml.safe_dump({name: value for name, value in entries.items() if value is not None}))
    return path


def test_the_packaged_settings_are_those_of_the_design():
    settings = solver_settings()
    assert settings.back_end == "ipopt"
    assert settings.relaxation <= 1e-7
    assert settings is solver_settings()


def test_the_table_is_searched_for_longer_than_a_single_request():
    settings, request = table_solver_settings(), solver_settings()
    assert settings.freed_optima > request.freed_optima
    assert settings.contact_rounds > request.contact_rounds
    assert settings.tolerance == request.tolerance


def test_a_file_is_read_as_it_is_written(tmp_path):
    path = written(tmp_path, coarse_points=40, time_limit=12.5)
    assert settings_from_yaml(SolverSettings, path) == replace(
        solver_settings(), coarse_points=40, time_limit=12.5
    )


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [0, -1, math.nan, True, "many", [1]])
def test_impossible_values_are_refused_by_name(name, value):
    with pytest.raises(ConfigurationError) as refusal:
        replace(solver_settings(), **{name: value})
    whole = "whole " if isinstance(getattr(solver_settings(), name), int) else ""
    assert str(refusal.value) == f"solver setting {name} is {value!r}, expected a positive {whole}number"


def test_unknown_back_ends_are_refused_with_the_known_ones():
    with pytest.raises(ConfigurationError) as refusal:
        replace(solver_settings(), back_end="knitro")
    assert str(refusal.value).startswith("unknown back_end 'knitro'; known are ipopt (interior point")
    assert all(f"{name} (" in str(refusal.value) for name in ("ipopt", "uno", "fatrop", "snopt"))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"tolerance": None}, "missing or unknown entries: tolerance"),
        ({"tolerence": 1e-9, "tolerance": None}, "missing or unknown entries: tolerance, tolerence"),
        ({"time_limit": -1.0}, "solver setting time_limit is -1.0, expected a positive number"),
    ],
)
def test_wrong_files_are_refused(tmp_path, changes, expected):
    path = written(tmp_path, **changes)
    with pytest.raises(ConfigurationError) as refusal:
        settings_from_yaml(SolverSettings, path)
    assert str(refusal.value) == f"{path}: {expected}"


def test_a_number_that_yaml_takes_for_a_text_is_explained(tmp_path):
    path = written(tmp_path)
    path.write_text(path.read_text().replace("1.0e-09", "1e-9"))
    with pytest.raises(ConfigurationError, match=r"tolerance is '1e-9', .* write .* 1e-8 as 1\.0e-8"):
        settings_from_yaml(SolverSettings, path)


@pytest.mark.parametrize(
    ("name", "value"),
    [("maximum_iterations", 10.5), ("coarse_points", 0.5), ("kept_starts", 1.5), ("tolerance", math.inf)],
)
def test_counts_are_whole_and_tolerances_finite(name, value):
    with pytest.raises(ConfigurationError, match=name):
        replace(solver_settings(), **{name: value})
