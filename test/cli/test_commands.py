"""The console script does what its help says, in processes of its own."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cli.console import command, environment, walk_optimizer
from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.gait_files import gait_file_name, write_gait_file
from walk_optimizer.gait_files.gait_csv import COLUMNS, gait_csv
from walk_optimizer.library import cache_folder
from walk_optimizer.model.parameters import WalkerParameters

# A speed that the packaged table lacks, so that the user's cache or a solve has to answer.
OFF_TABLE = "0.28"


def best_of(count, *arguments, home):
    times = []
    for _ in range(count):
        begin = time.monotonic()
        assert walk_optimizer(*arguments, home=home).returncode == 0
        times.append(time.monotonic() - begin)
    return min(times)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        *([verb] for verb in ("solve", "table", "library", "export", "picture", "bag")),
        ["library", "verify"],
    ],
)
def test_help_teaches_every_verb(tmp_path, arguments):
    done = walk_optimizer(*arguments, "--help", home=tmp_path)
    assert done.returncode == 0
    assert "usage: walk-optimizer" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 110


def test_help_and_import_answer_at_once(tmp_path):
    assert best_of(3, "--help", home=tmp_path) < 0.5


def test_the_parser_loads_nothing_heavy():
    code = (
        "import sys; from walk_optimizer.cli.main import build_parser; build_parser(); "
        "print([m for m in ('casadi', 'numpy', 'scipy', 'matplotlib', 'rclpy') if m in sys.modules])"
    )
    import sys

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_solve_prints_stores_and_exports(tmp_path, compiled):
    csv = tmp_path / "gait.csv"
    arguments = ["solve", "--speed", "1.0km/h", "--points", "40", "--save", "--export", csv]
    done = walk_optimizer(*arguments, home=tmp_path)
    assert done.returncode == 0, done.stderr
    for text in (
        "0.2778 m/s (1.00 km/h)",
        "status         solved",
        "dynamics",
        "refined        ",
        "stored as",
        "exported to",
    ):
        assert text in done.stdout
    assert "FAILED" not in done.stdout
    assert "complementarity" in done.stderr
    listed = walk_optimizer("library", "list", home=tmp_path)
    row = next(line for line in listed.stdout.splitlines() if line.split()[1] == "1.00")
    assert row.split()[2:4] == ["none", "40"]
    assert row.split()[-1] == "cache"
    # The same gait again, from the library.
    again = walk_optimizer("export", "--speed", "1.0km/h", "--points", "40", home=tmp_path)
    assert again.stdout == csv.read_text()


def test_a_time_limit_is_a_status_and_nothing_is_stored(tmp_path, compiled):
    done = walk_optimizer("solve", "--speed", OFF_TABLE, "--time-limit", "0.001", "--save", home=tmp_path)
    assert done.returncode == 1
    assert "status         time_limit: stopped at the time limit" in done.stdout
    assert list(tmp_path.rglob("*.npz")) == []


def test_interrupt_ends_a_solve_with_130(tmp_path, compiled):
    arguments = ["solve", "--speed", OFF_TABLE, "--points", "2000", "--save"]
    with subprocess.Popen(
        command(*arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(tmp_path),
    ) as process:
        line = process.stderr.readline()
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=60)
    assert "continuation" in line
    assert process.returncode == 130
    assert error.splitlines()[-1] == "walk-optimizer: interrupted"
    assert "Traceback" not in error
    assert time.monotonic() - begin < 5
    assert list(tmp_path.rglob("*.npz")) == []


def test_interrupt_ends_a_build_and_keeps_what_it_found(tmp_path, compiled):
    folder = tmp_path / "table"
    folder.mkdir()
    with subprocess.Popen(
        command("library", "build", "--points", "20", "--jobs", "2", "--output", folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(tmp_path),
        start_new_session=True,
    ) as process:
        line = process.stderr.readline()
        begin = time.monotonic()
        # To all processes of the group, as a terminal does it.
        os.killpg(process.pid, signal.SIGINT)
        _, error = process.communicate(timeout=60)
    assert line.startswith("search 1/21  ")
    assert line.endswith(", stored\n")
    assert time.monotonic() - begin < 10
    assert process.returncode == 130
    assert error.splitlines()[-1] == "walk-optimizer: interrupted"
    assert walk_optimizer("library", "verify", "--folder", folder, home=tmp_path).returncode == 0


def test_a_closed_pipe_is_no_error(tmp_path):
    shell = f"{' '.join(command('table'))} | head -1"
    done = subprocess.run(
        ["bash", "-c", shell], capture_output=True, text=True, env=environment(tmp_path), check=True
    )
    assert done.stderr == ""


# ---------------------------------------------------------------- the library's gaits


@pytest.fixture
def cached(tmp_path, monkeypatch):
    """A user's cache with one made-up gait; returns the gait."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    gait = made_up_gait(speed=float(OFF_TABLE), mode="stiffness", points=200)
    folder = cache_folder(WalkerParameters())
    folder.mkdir(parents=True)
    write_gait_file(gait, folder / gait_file_name(gait))
    return gait


def test_csv_reads_back_exactly(tmp_path, cached):
    done = walk_optimizer("export", "--speed", OFF_TABLE, "--spring", "stiffness", home=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    header = dict(line[2:].split(": ") for line in lines if line.startswith("#"))
    assert list(header) == [
        "speed",
        "step_length",
        "step_time",
        "N",
        "spring mode",
        "K",
        "q_eq",
        "friction",
        "F",
    ]
    assert header["spring mode"] == "stiffness"
    assert int(header["N"]) == 200
    assert float(header["K"]) == cached.spring.stiffness
    assert float(header["F"]) == cached.objective
    assert float(header["speed"]) == cached.speed
    assert lines[len(header)] == (
        "time,q1,q2,q3,q4,q5,q6,p1,p2,p3,p4,p5,p6,u1,u2,u3,"
        "lambda1_xp,lambda1_xm,lambda1_y,lambda2_xp,lambda2_xm,lambda2_y,gamma1,gamma2"
    )
    assert lines[len(header)] == ",".join(COLUMNS)
    table = np.array([[float(text) for text in line.split(",")] for line in lines[len(header) + 1 :]]).T
    t = cached.trajectory
    np.testing.assert_array_equal(table, np.vstack([t.time, t.q, t.p, t.u, t.reaction, t.slip_speed]))


def test_a_file_can_be_named_instead(tmp_path, cached):
    path = tmp_path / "gait.npz"
    write_gait_file(cached, path)
    output = tmp_path / "gait.csv"
    done = walk_optimizer("export", "--file", path, "--output", output, home=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"exported to {output}\n")
    assert output.read_text() == gait_csv(cached)


def test_the_pipe_of_the_help_reads_as_many_rows_as_there_are_points(tmp_path, cached):
    program = re.search(r'python3 -c \\\n *"(.*)"', walk_optimizer("export", "--help", home=tmp_path).stdout)
    exported = walk_optimizer("export", "--speed", OFF_TABLE, "--spring", "stiffness", home=tmp_path).stdout
    read = subprocess.run(
        [sys.executable, "-c", program[1]], input=exported, capture_output=True, text=True, check=True
    )
    assert read.stdout == "(200, 24)\n"


def test_the_refined_part_is_exported_at_its_nodes(tmp_path, cached):
    path = tmp_path / "gait.npz"
    gait = with_refinement(cached)
    write_gait_file(gait, path)
    done = walk_optimizer("export", "--file", path, "--grid", "refined", home=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[9:11] == [
        "# grid: radau",
        "time,q1,q2,q3,q4,q5,q6,p1,p2,p3,p4,p5,p6,u1,u2,u3,lambda1_x,lambda1_y,lambda2_x,lambda2_y",
    ]
    table = np.array([[float(text) for text in line.split(",")] for line in lines[11:]])
    trajectory = gait.refined.trajectory
    np.testing.assert_array_equal(table[:, 1:13], trajectory.states[:, 1:].reshape(-1, 12))
    np.testing.assert_array_equal(table[:, 13:16], trajectory.torques.reshape(-1, 3))
    np.testing.assert_array_equal(table[:, 16:], trajectory.forces.reshape(-1, 4))
    np.testing.assert_allclose(table[2::3, 0], trajectory.breaks[1:], rtol=1e-15)
    write_gait_file(cached, path)
    none = walk_optimizer("export", "--file", path, "--grid", "refined", home=tmp_path)
    assert (none.returncode, "has no refined part" in none.stderr) == (2, True)


@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_picture_is_drawn_and_the_same_each_time(tmp_path, cached, ending):
    paths = [tmp_path / f"{name}.{ending}" for name in "ab"]
    for path in paths:
        arguments = ["picture", "--speed", OFF_TABLE, "--spring", "stiffness", "--output", path]
        done = walk_optimizer(*arguments, home=tmp_path)
        assert done.returncode == 0, done.stderr
    assert paths[0].stat().st_size > 20_000
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_what_the_library_lacks_is_solved(tmp_path, cached, compiled):
    done = walk_optimizer("export", "--speed", OFF_TABLE, "--points", "30", home=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "no gait of 0.2800 m/s (1.01 km/h) with springs none" in done.stderr
    assert "# N: 30" in done.stdout


def test_verify_finds_a_gait_that_only_claims_to_be_one(tmp_path, cached):
    folder = cache_folder(WalkerParameters())
    (folder / "torn.npz").write_bytes(b"PK\x03\x04")
    done = walk_optimizer("library", "verify", "--folder", folder, home=tmp_path)
    assert done.returncode == 1
    assert "FAILED" in done.stdout
    assert "2 files, 0 certified, 2 failed" in done.stdout
    assert "torn.npz: truncated or damaged" in done.stderr
    assert "dynamics is" in done.stderr


def test_a_torn_file_is_named_and_the_rest_is_listed(tmp_path, cached):
    (cache_folder(WalkerParameters()) / "torn.npz").write_bytes(b"")
    for verb in (["library", "list"], ["table"]):
        done = walk_optimizer(*verb, home=tmp_path)
        assert done.returncode == 0
        assert "set aside: " in done.stderr
        assert "torn.npz" in done.stderr
    assert "0.2800" in walk_optimizer("library", "list", home=tmp_path).stdout


def test_table_shows_the_report_beside_ours(tmp_path):
    done = walk_optimizer("table", home=tmp_path)
    lines = done.stdout.splitlines()
    assert "stiffness_and_equilibrium" in lines[0]
    slow = [cell.split() for cell in lines[3].split("|")]
    assert slow[0] == ["0.2353", "0.85", "0.84"]
    assert slow[3] == ["7.98", "93"]
    assert slow[5] == ["8.00", "3.09", "64"]


@pytest.mark.parametrize("grid", ["report", "refined"])
def test_the_readme_shows_the_table_that_ships(tmp_path, grid):
    printed = walk_optimizer("table", "--format", "markdown", "--grid", grid, home=tmp_path).stdout
    readme = Path(__file__).parents[2] / "README.md"
    assert printed in readme.read_text(), "README.md: replace its table by what `table` prints now"


def test_the_readme_names_only_verbs_that_exist(tmp_path):
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    named = set(re.findall(r"`walk-optimizer ([a-z]+)", readme))
    assert named >= {"solve", "table", "export", "picture", "library", "reproduce", "bag"}
    for verb in sorted(named):
        assert walk_optimizer(verb, "--help", home=tmp_path).returncode == 0
