"""The library serves what is whole, says what is not, and never invents an answer."""

import errno
import math
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from library.made_up_gait import all_modes, made_up_gait, with_refinement

from walk_optimizer.errors import GaitFileError, GaitNotFoundError, GaitNotWritableError, InvalidRequestError
from walk_optimizer.gait_files import gait_file_name, write_gait_file
from walk_optimizer.library import GaitLibrary, Source, cache_folder
from walk_optimizer.library import gait_library as library_module
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.transition.table import TransitionTable

WALKER = WalkerParameters()
SLOW, FAST = 0.20 / 0.85, 0.25 / 0.785


@pytest.fixture
def table(tmp_path, monkeypatch):
    """An empty folder in place of the packaged table."""
    folder = tmp_path / "table"
    folder.mkdir()
    monkeypatch.setattr(library_module, "table_folder", lambda: folder)
    return folder


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "gaits"
    place.mkdir()
    return place


def put(folder: Path, **what) -> Path:
    gait = made_up_gait(**what)
    path = folder / gait_file_name(gait)
    write_gait_file(gait, path)
    return path


def test_exact_takes_a_speed_as_the_report_prints_it(table, folder):
    put(table, speed=FAST, mode="stiffness")
    gait, source = GaitLibrary(WALKER, folder).find(1.15 / 3.6, "stiffness")
    assert gait.request.speed == pytest.approx(FAST)
    assert source is Source.TABLE


def test_exact_refuses_a_speed_in_between_and_lists_what_there_is(table, folder):
    put(table, speed=SLOW)
    put(table, speed=FAST)
    with pytest.raises(GaitNotFoundError) as error:
        GaitLibrary(WALKER, folder).find(0.28, SpringMode.NONE)
    assert str(error.value) == (
        "no gait of 0.2800 m/s (1.01 km/h) with springs none; speeds in [m/s] of that mode in the "
        "library: 0.2353 (0.85 km/h), 0.3185 (1.15 km/h)"
    )


def test_nearest_takes_the_closest_speed_of_the_mode(table, folder):
    put(table, speed=SLOW)
    put(table, speed=FAST)
    put(table, speed=0.29, mode="stiffness")
    library = GaitLibrary(WALKER, folder)
    assert library.find(0.29, "none", "nearest")[0].request.speed == pytest.approx(FAST)
    assert library.find(0.01, "none", "nearest")[0].request.speed == pytest.approx(SLOW)
    with pytest.raises(GaitNotFoundError, match="in the library: none"):
        library.find(0.29, "stiffness_and_equilibrium", "nearest")


@pytest.mark.parametrize(
    ("speed", "mode", "selection", "message"),
    [
        (math.nan, "none", "exact", "speed is nan m/s, expected a finite number"),
        (math.inf, "none", "nearest", "speed is inf m/s"),
        pytest.param(10**400, "none", "exact", "speed is inf m/s", id="huge"),
        ("0.4", "none", "exact", "speed is '0.4', expected a number, in m/s"),
        (None, "none", "nearest", "speed is None, expected a number"),
        (True, "none", "nearest", "speed is True, expected a number"),
        (0.3, "rubber", "exact", "unknown spring mode 'rubber'; allowed are none, stiffness"),
        (0.3, "none", "best", "unknown selection 'best'; allowed are exact, interpolated, nearest"),
    ],
)
def test_a_bad_question_is_refused(table, folder, speed, mode, selection, message):
    with pytest.raises(InvalidRequestError, match=message):
        GaitLibrary(WALKER, folder).find(speed, mode, selection)


def test_the_default_grid_goes_first(table, folder):
    put(folder, points=40, torque=0.1)
    put(folder, points=200, torque=1.0)
    assert GaitLibrary(WALKER, folder).find(FAST, "none")[0].request.points == 200


def test_a_number_of_points_can_be_asked_for(table, folder):
    put(folder, points=40)
    put(folder, points=200)
    library = GaitLibrary(WALKER, folder)
    assert library.find(FAST, "none", points=40)[0].request.points == 40
    with pytest.raises(GaitNotFoundError):
        library.find(FAST, "none", points=50)


def test_within_the_tolerance_the_closest_speed_of_the_default_grid_goes_first(table, folder):
    put(folder, speed=FAST, points=200, torque=1.0)
    put(folder, speed=1.15 / 3.6, points=200, torque=2.0)
    put(folder, speed=1.15 / 3.6 + 1e-5, points=40, torque=0.5)
    library = GaitLibrary(WALKER, folder)
    for selection in ("exact", "nearest"):
        for speed in (FAST, 1.15 / 3.6):
            found = library.find(speed, "none", selection)[0].request
            assert (found.speed, found.points) == (pytest.approx(speed, abs=1e-9), 200)


def test_of_the_same_request_the_smaller_objective_is_served(table, folder):
    put(table, torque=2.0)
    library = GaitLibrary(WALKER, folder)
    library.store(made_up_gait(torque=3.0))
    assert library.find(FAST, "none")[1] is Source.TABLE
    library.store(made_up_gait(torque=1.0))
    for each in (library, GaitLibrary(WALKER, folder)):
        assert each.find(FAST, "none")[1] is Source.CACHE
        assert len(each.gaits()) == 1


def test_a_gait_that_is_not_refined_hides_none_that_is(table, folder):
    refined = with_refinement(made_up_gait(torque=2.0))
    write_gait_file(refined, table / gait_file_name(refined))
    library = GaitLibrary(WALKER, folder)
    library.store(made_up_gait(torque=1.0))
    assert library.find(FAST, "none")[1] is Source.TABLE
    library.store(with_refinement(made_up_gait(torque=1.0)))
    assert library.find(FAST, "none")[1] is Source.CACHE


def test_a_refinement_is_not_lost_to_a_gait_without_one(table, folder):
    library = GaitLibrary(WALKER, folder)
    refined = with_refinement(made_up_gait(torque=2.0))
    library.store(refined)
    for torque in (3.0, 1.0):
        library.store(made_up_gait(torque=torque))
        gait = GaitLibrary(WALKER, folder).find(FAST, "none")[0]
        assert gait.objective == pytest.approx(made_up_gait(torque=min(torque, 2.0)).objective)
        np.testing.assert_array_equal(gait.refined.trajectory.torques, refined.refined.trajectory.torques)


def test_summaries_relate_the_modes_of_a_speed(table, folder):
    put(table, torque=2.0)
    put(table, mode="stiffness", torque=1.0)
    put(table, mode="stiffness_and_equilibrium", speed=SLOW)
    rows = GaitLibrary(WALKER, folder).summaries()
    assert [row.spring_mode for row in rows] == all_modes()
    assert [row.relative_objective for row in rows[:2]] == pytest.approx([100.0, 25.0])
    assert math.isnan(rows[2].relative_objective)
    assert (rows[1].stiffness, rows[2].equilibrium) == (12.5, 3.11)
    assert all(row.certified and row.source is Source.TABLE for row in rows)


# ---------------------------------------------------------------- storing


def test_a_stored_gait_is_served_at_once_and_again_later(table, folder):
    library = GaitLibrary(WALKER, folder, writable=True)
    path = library.store(made_up_gait())
    assert path.parent == folder
    for each in (library, GaitLibrary(WALKER, folder)):
        assert each.find(FAST, "none")[1] is Source.CACHE


def test_the_packaged_gait_is_served_until_a_better_one_is_stored(table, folder):
    put(table, torque=2.0)
    library = GaitLibrary(WALKER, folder)
    for torque, source in ((1.5, Source.CACHE), (4.0, Source.TABLE), (1.0, Source.CACHE)):
        library.store(made_up_gait(torque=torque))
        for each in (library, GaitLibrary(WALKER, folder)):
            gait, found = each.find(FAST, "none")
            assert found is source
            assert gait.objective == pytest.approx(made_up_gait(torque=min(torque, 2.0)).objective)


def test_a_gait_with_a_number_that_is_none_changes_nothing(table, folder, monkeypatch):
    library = GaitLibrary(WALKER, folder)
    library.store(made_up_gait(torque=2.0))
    gait = made_up_gait()
    q = gait.trajectory.q.copy()
    q[3, 4] = math.nan
    broken = replace(gait, trajectory=replace(gait.trajectory, q=q))
    for place in (folder, folder / "missing"):
        monkeypatch.setattr(library, "folder", place)
        with pytest.raises(GaitFileError, match="not finite") as error:
            library.store(broken)
        assert not isinstance(error.value, GaitNotWritableError)
        assert library.unsaved() == []
        assert np.isfinite(library.find(FAST, "none")[0].trajectory.q).all()


def test_only_certified_gaits_of_this_walker_are_stored(table, folder):
    library = GaitLibrary(WALKER, folder)
    with pytest.raises(GaitFileError, match="only certified gaits are stored; this one fails: dynamics"):
        library.store(made_up_gait(certified=False))
    with pytest.raises(GaitFileError, match="for another walker than the library"):
        library.store(made_up_gait(walker=WalkerParameters(gravity=1.62)))
    assert list(folder.iterdir()) == []


def test_the_default_folder_is_the_users_cache(table, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = GaitLibrary(WALKER).store(made_up_gait())
    assert path.parent == tmp_path / "cache" / "walk_optimizer" / "gaits" / WALKER.fingerprint()
    monkeypatch.setenv("XDG_CACHE_HOME", "relative/path")
    assert cache_folder(WALKER).is_relative_to(Path.home() / ".cache")


def test_walkers_do_not_meet_in_the_cache(table, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    moon = WalkerParameters(gravity=1.62)
    GaitLibrary(moon).store(made_up_gait(walker=moon))
    library = GaitLibrary(WALKER)
    assert (library.gaits(), library.problems()) == ([], [])


# ---------------------------------------------------------------- faults


def test_bad_files_are_set_aside_and_the_rest_is_served(table, folder):
    whole = put(folder, speed=SLOW)
    torn = put(folder, speed=FAST)
    torn.write_bytes(torn.read_bytes()[:-100])
    (folder / "noise.npz").write_bytes(os.urandom(5000))
    (folder / "empty.npz").touch()
    (folder / "link.npz").symlink_to(whole)
    (folder / ".draft.npz.new").write_bytes(b"half")
    put(folder, walker=WalkerParameters(gravity=1.62))
    put(folder, mode="stiffness", certified=False)
    library = GaitLibrary(WALKER, folder)
    assert len(library.gaits()) == 1
    problems = "\n".join(library.problems())
    assert len(library.problems()) == 6
    assert f"{torn}: truncated or damaged" in problems
    assert "link.npz: a symbolic link" in problems
    assert "for another walker: gravity is 1.62, expected 9.81" in problems
    assert "the gait is not certified" in problems
    with pytest.raises(GaitNotFoundError, match=r"files set aside: .*truncated or damaged"):
        library.find(FAST, "none")


def test_storing_again_mends_a_torn_file(table, folder):
    torn = put(folder)
    torn.write_bytes(torn.read_bytes()[:1000])
    library = GaitLibrary(WALKER, folder)
    assert len(library.problems()) == 1
    library.store(made_up_gait())
    assert library.problems() == []
    assert GaitLibrary(WALKER, folder).problems() == []


def test_an_unusable_folder_is_named_when_writing_is_wanted(table, tmp_path):
    missing, link, file = tmp_path / "missing", tmp_path / "link", tmp_path / "file"
    (tmp_path / "real").mkdir()
    link.symlink_to(tmp_path / "real")
    file.touch()
    for place, message in (
        (missing, "the folder is missing"),
        (link, "is a symbolic link"),
        (file, "the folder is a file; name another"),
        (file / "below", "the folder is missing|not writable"),
        (Path("/proc/1"), "the folder is not writable"),
    ):
        with pytest.raises(GaitFileError, match=message) as error:
            GaitLibrary(WALKER, place, writable=True)
        assert str(error.value).startswith(f"{place}:")


def test_a_folder_that_is_named_has_to_exist_for_reading_too(table, tmp_path):
    (tmp_path / "file").touch()
    for place, message in (
        (tmp_path / "missing", "the folder is missing; create it or name another"),
        (tmp_path / "file", "the folder is a file; name another"),
    ):
        for kind in (GaitLibrary, TransitionTable):
            with pytest.raises(GaitFileError) as error:
                kind(WALKER, place)
            assert str(error.value) == f"{place}: {message}"


def test_a_cache_that_is_not_there_yet_is_no_fault(table, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "missing"))
    assert GaitLibrary(WALKER).gaits() == []
    assert TransitionTable(WALKER).names()
    assert not (tmp_path / "missing").exists()


def test_a_cache_below_a_file_is_refused(table, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(GaitFileError, match="the folder is not writable: Not a directory"):
        GaitLibrary(WALKER, writable=True)


def test_a_gait_that_the_disk_has_no_space_for_is_served_from_memory(table, folder, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    library = GaitLibrary(WALKER, folder)
    gait = made_up_gait(speed=0.6)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(GaitNotWritableError, match=r"in memory only, .*: .*No space left"):
            library.store(gait)
    assert library.find(0.6, "none") == (gait, Source.CACHE)
    (unsaved,) = library.unsaved()
    assert "can't be written: No space left on device" in unsaved
    assert not list(folder.glob("*0.6*"))
    path = library.store(gait)
    assert path.is_file()
    assert library.unsaved() == []


WRITER = """
import sys
from pathlib import Path
from library.made_up_gait import made_up_gait
from walk_optimizer.gait_files import gait_file_name, write_gait_file
gait = made_up_gait(points=200)
print("go", flush=True)
while True:
    write_gait_file(gait, Path(sys.argv[1]) / gait_file_name(gait))
"""


def test_a_writer_killed_at_any_moment_leaves_a_whole_file(table, folder):
    path = put(folder, points=200)
    for _ in range(5):
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
        command = [sys.executable, "-c", WRITER, str(folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment) as writer:
            writer.stdout.readline()
            # Readers at the same time see whole files only.
            for _ in range(10):
                assert GaitLibrary(WALKER, folder).problems() == []
            writer.send_signal(signal.SIGKILL)
        library = GaitLibrary(WALKER, folder)
        assert (library.problems(), len(library.gaits())) == ([], 1)
    assert path.exists()


def test_threads_that_store_and_find_do_not_disturb_each_other(table, folder):
    library = GaitLibrary(WALKER, folder)
    library.store(made_up_gait())
    failures = []

    def look_up():
        try:
            for _ in range(200):
                library.find(FAST, "none")
        except Exception as error:  # noqa: BLE001 - a thread's failure is shown below
            failures.append(error)

    threads = [threading.Thread(target=look_up) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(20):
        library.store(made_up_gait())
    for thread in threads:
        thread.join()
    assert failures == []


@pytest.mark.parametrize(("kind", "count"), [(GaitLibrary, 21), (TransitionTable, 78)])
def test_a_cache_that_can_not_be_read_is_told_and_the_packaged_files_are_served(
    tmp_path, monkeypatch, kind, count
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a file"))
    (tmp_path / "a file").touch()
    found = kind(WalkerParameters.from_yaml())
    (problem,) = found.problems()
    assert problem == f"{found.folder}: the folder can't be read: Not a directory"
    assert len(found.gaits() if kind is GaitLibrary else found.names()) == count
