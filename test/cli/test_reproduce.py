"""The report again: every figure is drawn, every sentence comes from the gaits at hand."""

from dataclasses import replace

import numpy as np
import pytest
from cli.console import walk_optimizer
from library.made_up_gait import all_modes, made_up_gait, with_refinement

from walk_optimizer.cli import table_text
from walk_optimizer.errors import ConfigurationError
from walk_optimizer.figures import reproduction
from walk_optimizer.figures.report_figures import HIP_ROWS
from walk_optimizer.figures.reproduction import count_dents, report_speeds, rotation, sparsity
from walk_optimizer.gait_files import gait_file_name, write_gait_file
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.request import gait_table_settings

WALKER = WalkerParameters()


@pytest.fixture
def folder(tmp_path):
    """A library of a whole made-up table, of so little torque that it is preferred to any other."""
    place = tmp_path / "gaits"
    place.mkdir()
    for mode, torque in zip(all_modes(), (1e-3, 8e-4, 5e-4), strict=True):
        for speed in gait_table_settings().table_speeds():
            gait = with_refinement(made_up_gait(speed=speed, mode=mode, points=200, torque=torque))
            write_gait_file(gait, place / gait_file_name(gait))
    return place


def test_page_and_figures_are_written(tmp_path, folder):
    output = tmp_path / "report"
    done = walk_optimizer("reproduce", "--library", folder, "--output", output, home=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (output / "reproduction.md").read_text()
    for number in range(1, 6):
        assert f"(figure_{number}.png)" in page
        assert (output / f"figure_{number}.png").stat().st_size > 10_000
    assert "The rotation of the hip grows with speed: " in page
    assert "from slow to fast, 1, 1, 1, 1, 1, 1, 1 (counted" in page
    assert "11 of 14 of our F% are at or below" in page
    assert "Agrees: knee springs also lower the largest torque at the hip" in page


def test_a_library_with_a_gap_is_refused(tmp_path, folder):
    moon = tmp_path / "moon.yaml"
    moon.write_text("gravity: 1.62\n")
    arguments = ["--library", folder, "--walker", moon, "--output", tmp_path / "report"]
    done = walk_optimizer("reproduce", *arguments, home=tmp_path)
    assert done.returncode == 2
    assert "no gait of 0.2353 m/s (0.85 km/h) with springs none" in done.stderr
    assert "for another walker: gravity is 9.81, expected 1.62" in done.stderr


@pytest.mark.parametrize(
    ("gaits", "common"),
    [
        (5, ["0.84", "-", "1.92", "-", "3.92"]),
        (13, ["0.84", "-", "1.15", "-", "1.50", "-", "1.92", "-", "2.44", "-", "3.09", "-", "3.92"]),
    ],
)
def test_a_table_of_other_speeds_is_shown_beside_the_rows_of_the_report_that_it_shares(
    monkeypatch, tmp_path, gaits, common
):
    settings = replace(gait_table_settings(), gaits=gaits)
    monkeypatch.setattr(table_text, "gait_table_settings", lambda: settings)
    library = GaitLibrary(WALKER, tmp_path)
    rows = [line.split("|") for line in table_text.table_text(library).splitlines()[3:-2]]
    assert [row[0].split()[2] for row in rows] == common
    assert [row[3].split()[0] == "-" for row in rows] == [speed == "-" for speed in common]
    assert [row[5].split() for row in rows][-1] == ["0.73", "0.00", "9"]
    assert len(table_text.markdown_table(library).splitlines()) == gaits + 2


def test_the_figures_take_the_speeds_of_the_report_or_say_which_the_table_lacks(monkeypatch):
    seven = gait_table_settings()
    for gaits in (7, 13, 1201):
        monkeypatch.setattr(
            reproduction, "gait_table_settings", lambda many=gaits: replace(seven, gaits=many)
        )
        assert report_speeds() == pytest.approx(seven.table_speeds(), abs=0.005)
    monkeypatch.setattr(reproduction, "gait_table_settings", lambda: replace(seven, gaits=5))
    with pytest.raises(ConfigurationError, match=r"with 5 gaits, lacks 1\.15, 1\.50, 2\.44, 3\.09 km/h"):
        report_speeds()


def test_sparsity_is_that_of_the_report():
    points = 20
    pattern = sparsity(WALKER, points)
    assert pattern.shape == (20 * points + 1, 23 * points + 2)
    # Report section 3.3.1: at most 23 + 12 + 2 variables take part in a constraint.
    assert pattern[:-1].sum(axis=1).max() <= 37
    # Only the momenta of the knees feel the springs.
    felt = pattern[:, -2:].any(axis=1).reshape(-1)[: 12 * points].reshape(12, points)
    assert np.flatnonzero(felt.all(axis=1)).tolist() == [9, 11]


@pytest.mark.parametrize(
    ("bends", "dents"),
    [((), 0), ((0.4,), 0), ((10,), 1), ((10, 20), 2), ((3, 2, 1), 3)],
)
def test_dents_are_counted_where_the_knee_stretches_again(bends, dents):
    gait = made_up_gait(points=200)
    q = gait.trajectory.q.copy()
    phase = np.linspace(0, max(len(bends), 1), 200, endpoint=False)
    depth = np.array([*bends, 0])[np.minimum(phase.astype(int), len(bends))]
    q[5] = np.pi - np.radians(depth) * np.sin(np.pi * (phase % 1)) ** 2
    assert count_dents(replace(gait, trajectory=replace(gait.trajectory, q=q))) == dents


def test_a_knee_that_begins_its_swing_by_stretching_has_no_dent_there():
    gait = made_up_gait(points=200)
    q = gait.trajectory.q.copy()
    # It leaves the ground bent by 10 degrees, stretches, and bends once by 60 degrees.
    depth = np.interp(np.linspace(0, 1, 200), (0, 0.2, 0.6, 1), (10, 0, 60, 10))
    q[5] = np.pi - np.radians(depth)
    assert count_dents(replace(gait, trajectory=replace(gait.trajectory, q=q))) == 1


def test_the_largest_rotation_is_told_with_its_speed_where_it_is_not_the_last():
    gaits = [made_up_gait(speed=speed, points=200) for speed in gait_table_settings().table_speeds()]
    turned = gaits[4].trajectory.q.copy()
    turned[2, 0] += np.radians(40)
    gaits[4] = replace(gaits[4], trajectory=replace(gaits[4].trajectory, q=turned))
    hip = rotation(gaits, HIP_ROWS)
    assert hip.startswith("does not always grow with speed: ")
    assert hip.endswith("° (2.44 km/h)")
