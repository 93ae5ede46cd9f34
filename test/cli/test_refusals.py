"""Bad input is refused before any work, in one line that says what is allowed."""

import time

import pytest
from cli.console import walk_optimizer

from walk_optimizer.cli import main as main_module
from walk_optimizer.cli.main import join_negative_values, main

LIMITS = "allowed is 0.15 to 1.2 m/s (0.54 to 4.32 km/h)"

BAD = [
    (["--speed", "nan"], f"speed is nan m/s, {LIMITS}"),
    (["--speed", "inf"], f"speed is inf m/s, {LIMITS}"),
    (["--speed", "-inf"], f"speed is -inf m/s, {LIMITS}"),
    (["--speed", "0"], f"speed is 0 m/s, {LIMITS}"),
    (["--speed", "-0.3"], f"speed is -0.3 m/s, {LIMITS}"),
    (["--speed", "-1.15km/h"], f"speed is -0.31944444 m/s, {LIMITS}"),
    (["--speed", "40km/h"], f"speed is 11.111111 m/s, {LIMITS}"),
    (["--speed", "fast"], "speed 'fast' not understood; write 0.3185, 0.3185m/s or 1.15km/h"),
    (["--speed", "0.7mph"], "speed '0.7mph' not understood"),
    (["--speed", ""], "speed '' not understood"),
    (["--speed", "0.3", "--spring", "rubber"], "unknown spring mode 'rubber'; allowed are none, stiffness, "),
    (["--speed", "0.3", "--points", "0"], "N is 0 grid points, allowed is 20 to 2000"),
    (["--speed", "0.3", "--points", "-5"], "N is -5 grid points, allowed is 20 to 2000"),
    (["--speed", "0.3", "--points", "10000000"], "N is 10000000 grid points (about 400 GB), allowed is 20"),
    (["--speed", "0.3", "--points", "2.5"], "N is '2.5' grid points, allowed is 20 to 2000"),
    (["--speed", "0.3", "--time-limit", "0"], "time limit is '0', allowed are finite numbers above 0, in s"),
    (["--speed", "0.3", "--time-limit", "soon"], "time limit is 'soon', allowed"),
    (
        ["--speed", "0.3", "--walker", "/nowhere/walker.yaml"],
        "/nowhere/walker.yaml: can't be read: No such file",
    ),
    (
        ["--speed", "0.3", "--export", "/nowhere/gait.csv"],
        "/nowhere/gait.csv: the folder /nowhere is missing",
    ),
    (["--speed", "0.3", "--save", "--library", "/nowhere"], "/nowhere: the folder is missing"),
    ([], "the following arguments are required: --speed"),
    (["--speed"], "argument --speed: expected one argument"),
    (["--speed", "0.3", "--sprin", "none"], "unrecognized arguments: --sprin none"),
]


@pytest.fixture
def no_work(monkeypatch):
    """Fail the test if a solve begins."""
    from walk_optimizer.cli import gaits

    def never(*arguments, **options):
        raise AssertionError("a solve began")

    monkeypatch.setattr(gaits, "optimize", never)


@pytest.mark.parametrize(("arguments", "message"), BAD)
def test_bad_input_of_solve_is_refused_in_one_line(no_work, capsys, arguments, message):
    try:
        code = main(["solve", *arguments])
    except SystemExit as exit_:
        code = exit_.code
    printed = capsys.readouterr()
    assert code == 2
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["export"], "say which gait: --speed SPEED [--spring MODE], or --file GAIT"),
        (["export", "--speed", "9"], LIMITS),
        (["export", "--speed", "0.3", "--grid", "coarse"], "invalid choice: 'coarse'"),
        (["export", "--speed", "0.3", "--format", "csv"], "unrecognized arguments: --format csv"),
        (["export", "--file", "/nowhere/gait.npz"], "/nowhere/gait.npz: can't be read: No such file"),
        (["picture", "--speed", "0.3", "--output", "gait.doc"], "a picture's name ends in .png, .pdf, .svg"),
        (["picture", "--speed", "0.3", "--output", "/nowhere/gait.png"], "the folder /nowhere is missing"),
        (
            ["picture", "--file", "gait.npz", "--speed", "0.3", "--spring", "none", "--output", "gait.png"],
            "--file can't be combined with --speed, --spring; leave out the one or the other",
        ),
        *[
            ([*command, "/nowhere"], "/nowhere: the folder is missing; create it or name another")
            for command in (
                ["table", "--library"],
                ["library", "list", "--library"],
                ["solve", "--speed", "0.3", "--library"],
                ["export", "--speed", "0.3", "--library"],
                ["simulate", "--table", "--library"],
                ["transitions", "list", "--folder"],
                ["transitions", "verify", "--folder"],
            )
        ],
        (["library", "verify", "--folder", "/nowhere"], "/nowhere: no gait files"),
        (
            ["urdf", "--equilibrium", "3"],
            "--equilibrium is that of springs: give their --stiffness too, or leave it out",
        ),
        (["demo", "--seconds", "0"], "seconds is '0', allowed are finite numbers above 0, in s"),
        *[
            ([verb, "--output", __file__], f"{__file__}: the folder is a file; name another")
            for verb in ("reproduce", "demo")
        ],
        (["library", "build", "--output", "/nowhere"], "/nowhere: the folder is missing"),
        (["library", "build", "--jobs", "0"], "jobs is '0', allowed are whole numbers from 1 to 256"),
        (["library", "build", "--jobs", "two"], "jobs is 'two', allowed are whole numbers from 1 to 256"),
        (["library", "build", "--jobs", f"1{24 * '0'}"], "allowed are whole numbers from 1 to 256"),
        (["library", "build", "--points", "3"], "N is 3 grid points, allowed is 20 to 2000"),
        (["bag", "info", "/nowhere"], "/nowhere"),
        (["fly"], "invalid choice: 'fly'"),
        ([], "the following arguments are required: VERB"),
    ],
)
def test_the_other_verbs_refuse_too(no_work, capsys, arguments, message):
    try:
        code = main(arguments)
    except SystemExit as exit_:
        code = exit_.code
    printed = capsys.readouterr()
    assert code == 2
    assert message in printed.err
    assert printed.err.count("\n") == 1


@pytest.mark.parametrize("action", ["list", "verify", "build"])
def test_transitions_on_a_slope_are_refused(capsys, tmp_path, action):
    walker = tmp_path / "uphill.yaml"
    walker.write_text("terrain: {slope: 0.05}\n")
    assert main(["transitions", action, "--folder", str(tmp_path), "--walker", str(walker)]) == 2
    printed = capsys.readouterr()
    assert "stands and transitions are for level ground, the walker's terrain is not level" in printed.err
    assert (printed.err.count("\n"), printed.out) == (1, "")


@pytest.mark.parametrize("verb", [["solve", "--speed", "0.3"], ["urdf"]])
@pytest.mark.parametrize("entry", ["hip_mass: 1{}", "terrain: {{slope: 1{}}}"])
def test_a_walker_of_numbers_beyond_all_floats_is_refused(no_work, tmp_path, capsys, verb, entry):
    walker = tmp_path / "walker.yaml"
    walker.write_text(entry.format(309 * "0"))
    assert main([*verb, "--walker", str(walker)]) == 2
    printed = capsys.readouterr()
    assert " is inf, allowed are finite numbers" in printed.err
    assert (printed.out, printed.err.count("\n")) == ("", 1)


def test_the_script_refuses_without_a_traceback_and_at_once(tmp_path):
    begin = time.monotonic()
    done = walk_optimizer("solve", "--speed", "-1km/h", home=tmp_path)
    assert time.monotonic() - begin < 5
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"walk-optimizer: speed is -0.27777778 m/s, {LIMITS}\n"
    assert list(tmp_path.rglob("*.npz")) == []


@pytest.mark.parametrize(
    ("given", "joined"),
    [
        (["solve", "--speed", "-1km/h"], ["solve", "--speed=-1km/h"]),
        (["solve", "--speed", "-nan"], ["solve", "--speed=-nan"]),
        (["solve", "--speed=1", "--save"], ["solve", "--speed=1", "--save"]),
        (["-h"], ["-h"]),
        (["solve", "--speed", "-h"], ["solve", "--speed", "-h"]),
    ],
)
def test_negative_values_reach_the_core(given, joined):
    assert join_negative_values(given) == joined


def test_missing_matplotlib_is_named_with_its_remedy(capsys, monkeypatch, tmp_path):
    import sys

    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["picture", "--speed", "0.3", "--output", str(tmp_path / "gait.png")]) == 2
    assert "pip install 'walk-optimizer[figures]'" in capsys.readouterr().err


def test_an_error_of_several_lines_is_printed_as_one(capsys, monkeypatch):
    from walk_optimizer.errors import ConfigurationError

    def fail(arguments):
        raise ConfigurationError("one\n  two\nthree")

    parser = main_module.build_parser()
    monkeypatch.setattr(parser, "parse_args", lambda _: type("Args", (), {"run": staticmethod(fail)})())
    monkeypatch.setattr(main_module, "build_parser", lambda: parser)
    assert main(["table"]) == 2
    assert capsys.readouterr().err == "walk-optimizer: one two three\n"
