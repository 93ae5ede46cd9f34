"""`walk-optimizer simulate` in processes of its own."""

import pytest
from cli.console import walk_optimizer

from walk_optimizer.cli.main import main

GAIT = ("--speed", "1.5km/h", "--spring", "stiffness_and_equilibrium")


def test_it_says_how_the_walk_went_and_draws_it(tmp_path):
    picture = tmp_path / "walk.png"
    done = walk_optimizer(
        "simulate", *GAIT, "--steps", "3", "--push", "2", "--picture", picture, home=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "3 of 3, still walking" in done.stdout
    assert "eigenvalue" in done.stdout
    assert picture.stat().st_size > 10_000


def test_a_fall_is_told_with_its_step_and_reason(tmp_path):
    done = walk_optimizer("simulate", *GAIT, "--push", "90", home=tmp_path)
    assert done.returncode == 1
    assert "fell in step " in done.stdout
    assert "foot" in done.stdout


@pytest.mark.parametrize(
    ("option", "value", "named"),
    [
        ("--steps", "0", "steps is '0', allowed are whole numbers from 1 to 1000"),
        ("--push", "nan", "push is 'nan', allowed are finite numbers above -10000 up to 10000, in N s"),
        ("--push", "1e308", "push is '1e308', allowed are finite numbers above -10000 up to 10000, in N s"),
        ("--heavier", "-100", "heavier is '-100', allowed are finite numbers above -100 up to 1000, in %"),
        ("--heavier", "1e308", "heavier is '1e308', allowed are finite numbers above -100 up to 1000, in %"),
        ("--friction", "0", "friction is '0', allowed are finite numbers above 0 up to 10, without unit"),
        (
            "--friction",
            "1e308",
            "friction is '1e308', allowed are finite numbers above 0 up to 10, without unit",
        ),
    ],
)
def test_impossible_numbers_are_refused(option, value, named, tmp_path):
    done = walk_optimizer("simulate", *GAIT, option, value, home=tmp_path)
    assert done.returncode == 2
    assert named in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--table", *GAIT], "--table can't be combined with --speed, --spring;"),
        (["--table", "--spring", "none"], "--table can't be combined with --spring;"),
        (["--table", "--push", "0", "--steps", "3"], "--table can't be combined with --steps, --push;"),
        (["--table", "--step-down", "0.01"], "--table can't be combined with --step-down;"),
        (["--table", "--heavier", "5"], "--table can't be combined with --heavier;"),
        (["--table", "--points", "100"], "--table can't be combined with --points;"),
        (["--table", "--file", "gait.npz"], "--table can't be combined with --file;"),
        (["--table", "--without-feedback"], "--table can't be combined with --without-feedback;"),
        (["--table", "--picture", "walk.png"], "--table can't be combined with --picture;"),
        ([*GAIT, "--without-feedback", "--push", "5"], "--without-feedback can't be combined with --push;"),
        (
            [*GAIT, "--steps", "2", "--push", "50"],
            "--push would disturb step 3, the walk has 2; allowed are ",
        ),
        ([*GAIT, "--steps", "1", "--step-down", "0.01"], "--step-down would disturb step 3, the walk has 1;"),
        (
            [*GAIT, "--steps", "2", "--push", "5", "--step-down", "0.01"],
            "--push and --step-down would disturb step 3, the walk has 2; allowed are at least 3 steps",
        ),
    ],
)
def test_options_that_would_be_ignored_are_refused(options, named, capsys):
    assert main(["simulate", *options]) == 2
    printed = capsys.readouterr()
    assert named in printed.err
    assert (printed.out, len(printed.err.splitlines())) == ("", 1)


def test_a_table_takes_a_library_and_friction(tmp_path, capsys, monkeypatch):
    from walk_optimizer.simulation import table

    asked = []
    monkeypatch.setattr(table, "table_rows", lambda *given: asked.append(given) or iter(()))
    main(["simulate", "--table", "--library", str(tmp_path), "--friction", "0.7"])
    ((_, _, friction),) = asked
    assert friction == 0.7
    assert capsys.readouterr().out.startswith("| km/h | springs |")


def test_a_walker_whose_table_is_not_solved_is_refused(tmp_path, capsys):
    walker = tmp_path / "walker.yaml"
    walker.write_text("hip_mass: 50.0\n")
    assert main(["simulate", "--table", "--walker", str(walker), "--library", str(tmp_path)]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith(f"walk-optimizer: {tmp_path}: no gaits of the table for this walker; ")
    assert (printed.out, len(printed.err.splitlines())) == ("", 1)
