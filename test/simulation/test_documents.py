"""docs/walking.md says what the program measures."""

from itertools import takewhile
from pathlib import Path

import pytest

from walk_optimizer.cli.text import markdown_line
from walk_optimizer.errors import ConfigurationError
from walk_optimizer.simulation import settings as module
from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.settings import SimulationSettings, simulation_settings
from walk_optimizer.simulation.table import HEADINGS, orbit_cells

PAGE = Path(__file__).parents[2] / "docs" / "walking.md"


def documented_rows(number: int) -> dict[tuple[str, ...], tuple[str, ...]]:
    """Cells after speed and springs of a table of walks on the page, by speed and springs."""
    _, *after = PAGE.read_text().split(markdown_line(HEADINGS))
    lines = takewhile(lambda line: line.startswith("| "), after[number].splitlines()[2:])
    rows = [tuple(cell.strip() for cell in line.strip("| \n").split("|")) for line in lines]
    return {row[:2]: row[2:] for row in rows}


def test_the_table_holds_every_gait_and_what_is_measured_now(loop):
    rows = documented_rows(0)
    assert len(rows) == 21
    row = rows["1.50", "stiffness_and_equilibrium"]
    assert row[:3] == orbit_cells(loop)
    assert (row[3] == "yes") is (loop.walk(5).ending is Ending.LANDED)
    fatal = loop.disturbance(push=float(row[4]) + 1.0)
    assert loop.walk(loop.settings.disturbed_step + 8, fatal).ending.is_fall


def test_with_margins_every_gait_of_the_table_walks():
    without, within = documented_rows(0), documented_rows(1)
    assert set(within) == set(without)
    assert {cells[3] for cells in within.values()} == {"yes"}
    assert "slipped" in {cells[3] for cells in without.values()}


def test_impossible_settings_are_refused_with_their_name(tmp_path, monkeypatch):
    packaged = module.config_file("simulation.yaml").read_text()
    wrong = tmp_path / "simulation.yaml"
    monkeypatch.setattr(module, "config_file", lambda _: wrong)
    for text, named in (
        (packaged.replace("steps: 20", "steps: 0"), "steps"),
        (packaged.replace("  damping: 1.0", "  bounce: 1.0"), "knee_stop: .*entries: bounce, damping"),
        (packaged.split("weights:")[0] + "weights: 3\n", "weights is 3, expected entries angle, speed"),
        (packaged.replace("  angle: 0.05", "  angle: 0.0"), "angle is 0.0"),
        (packaged.replace("lowest_hip: 0.6", "lowest_hip: 1.5"), "lowest_hip"),
        (packaged + "more: 1\n", "more"),
    ):
        wrong.write_text(text)
        with pytest.raises(ConfigurationError, match=named):
            simulation_settings.__wrapped__()


def test_the_packaged_settings_are_read():
    assert isinstance(simulation_settings(), SimulationSettings)
