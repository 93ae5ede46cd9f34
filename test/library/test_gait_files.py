"""A gait file gives back what was written, and nothing else is taken for one."""

import io
import json
import os
import pickle
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Gait, RefinedGait, Trajectory
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.gait_files import gait_file_name, read_gait_file, write_gait_file
from walk_optimizer.gait_files.codec import decode, encode
from walk_optimizer.gait_files.container import LARGEST_FILE
from walk_optimizer.model.parameters import WalkerParameters


def assert_same(found: Gait, expected: Gait) -> None:
    for name in ("walker", "request", "spring", "certificate", "step_length"):
        assert getattr(found, name) == getattr(expected, name)
    for name in (entry.name for entry in fields(Trajectory)):
        np.testing.assert_array_equal(getattr(found.trajectory, name), getattr(expected.trajectory, name))
    # NaN is not equal to itself.
    assert repr(found.report) == repr(expected.report)
    assert (found.refined is None) == (expected.refined is None)
    if found.refined is not None and expected.refined is not None:
        assert_same_refinement(found.refined, expected.refined)


def assert_same_refinement(found: RefinedGait, expected: RefinedGait) -> None:
    for name in ("spring", "step_length", "certificate"):
        assert getattr(found, name) == getattr(expected, name)
    for name in (entry.name for entry in fields(RefinedTrajectory)):
        np.testing.assert_array_equal(getattr(found.trajectory, name), getattr(expected.trajectory, name))


def arrays_of(data: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(data)) as archive:
        return dict(archive)


def packed(arrays: dict[str, np.ndarray], compressed: bool = False) -> bytes:
    buffer = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(buffer, **arrays)
    return buffer.getvalue()


def with_header(data: bytes, change) -> bytes:
    """Return the file with a changed header, and a checksum that fits it."""
    from walk_optimizer.gait_files.container import _checksum

    arrays = arrays_of(data)
    header = json.loads(arrays.pop("header").tobytes())
    change(header)
    header["checksum"] = _checksum(header, arrays)
    return packed({"header": np.frombuffer(json.dumps(header).encode(), np.uint8), **arrays})


def with_arrays(data: bytes, change) -> bytes:
    """Return the file with changed arrays, and a checksum that fits them."""
    arrays = arrays_of(data)
    change(arrays)
    return with_header(packed(arrays), lambda _: None)


@pytest.mark.parametrize("mode", ["none", "stiffness", "stiffness_and_equilibrium"])
def test_what_is_written_is_read(tmp_path, mode):
    gait = made_up_gait(mode=mode)
    path = tmp_path / gait_file_name(gait)
    write_gait_file(gait, path)
    found = read_gait_file(path, WalkerParameters())
    assert_same(found, gait)
    assert not found.trajectory.q.flags.writeable
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_the_refined_part_travels_along(tmp_path):
    gait = with_refinement(made_up_gait(mode="stiffness"))
    path = tmp_path / "gait.npz"
    write_gait_file(gait, path)
    assert_same(read_gait_file(path), gait)


def test_files_of_version_1_without_a_refined_part_are_read():
    def as_before(header):
        header["refined"] = {}

    assert decode(with_header(encode(made_up_gait()), as_before)).refined is None


def test_equal_gaits_give_equal_bytes():
    assert encode(made_up_gait()) == encode(made_up_gait())


def test_the_name_tells_requests_and_walkers_apart():
    gaits = [
        made_up_gait(),
        made_up_gait(mode="stiffness"),
        made_up_gait(points=40),
        made_up_gait(speed=0.5),
        made_up_gait(walker=WalkerParameters(hip_mass=40.0)),
    ]
    assert len({gait_file_name(gait) for gait in gaits}) == 5
    assert gait_file_name(gaits[0]).startswith("none_0.2500m_0.7850s_n20_")


# ---------------------------------------------------------------- damage


WHOLE = encode(with_refinement(made_up_gait()))


@settings(deadline=None, max_examples=150)
@given(st.integers(0, len(WHOLE) - 1))
def test_a_file_truncated_anywhere_is_refused(size):
    with pytest.raises(GaitFileError):
        decode(WHOLE[:size])


def test_a_file_truncated_at_the_start_or_the_end_is_refused():
    for size in [*range(200), *range(len(WHOLE) - 400, len(WHOLE))]:
        with pytest.raises(GaitFileError):
            decode(WHOLE[:size])


@settings(deadline=None, max_examples=400)
@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_a_flipped_byte_is_refused_or_harmless(place, flip):
    damaged = bytearray(WHOLE)
    damaged[place] ^= flip
    try:
        found = decode(bytes(damaged))
    except GaitFileError:
        return
    # Some bytes of the archive format carry nothing, e.g. dates.
    assert_same(found, with_refinement(made_up_gait()))


@settings(deadline=None, max_examples=100)
@given(st.binary(max_size=300))
def test_noise_is_refused(noise):
    for data in (noise, WHOLE[:1000] + noise, noise + WHOLE[-600:]):
        with pytest.raises(GaitFileError):
            decode(data)


# ---------------------------------------------------------------- files that are whole but wrong


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h.update(version=2), "format version is 2, this program reads 1"),
        (lambda h: h.update(format="other"), "does not name the format walk_optimizer.gait"),
        (lambda h: h.update(colour="red"), "missing or unknown entries: colour"),
        (lambda h: h.pop("spring"), "missing or unknown entries: spring"),
        (lambda h: h["walker"].update(tail=1.0), "walker has unknown entries: tail"),
        (lambda h: h["walker"].update(hip_mass=-1.0), "hip_mass is -1.0"),
        (lambda h: h["walker"].update(hip_mass="45"), "walker.hip_mass is '45', expected a finite number"),
        (lambda h: h["spring"].update(stiffness=1e400), "spring.stiffness is inf"),
        (lambda h: h["spring"].update(stiffness=None), "spring.stiffness is None"),
        (lambda h: h["spring"].update(stiffness=10**400), "spring.stiffness is inf"),
        (lambda h: h["request"].update(points=True), "request.points is True, expected int"),
        (lambda h: h["request"].update(points=10**7), "N is 10000000 grid points"),
        (lambda h: h["request"].pop("points"), "request has no entry points"),
        (lambda h: h["request"].update(spring_mode="rubber"), "request.spring_mode is 'rubber', allowed are"),
        (lambda h: h["request"].update(step_time=0.0), "step time is 0.0"),
        (lambda h: h["report"].update(status="great"), "report.status is 'great'"),
        (lambda h: h["certificate"].update(entries=3), "certificate.entries is 3, expected a list"),
        (lambda h: h["certificate"]["entries"][0].pop("unit"), "certificate.entries[0] has no entry unit"),
        (lambda h: h.update(step_length=0), "step_length is 0"),
        (lambda h: h.update(refined=[]), "refined is [], expected a mapping"),
        (lambda h: h.update(refined=None), "unknown arrays: refined_breaks, refined_forces"),
        (lambda h: h["refined"].update(colour="red"), "refined has unknown entries: colour"),
        (lambda h: h["refined"].update(step_length=0.0), "refined.step_length is 0.0, expected a finite"),
        (lambda h: h["refined"]["certificate"].pop("entries"), "refined.certificate has no entry entries"),
        (lambda h: h.update(walker=[]), "walker is [], expected a mapping"),
    ],
)
def test_a_wrong_header_is_refused_by_name(change, message):
    with pytest.raises(GaitFileError) as error:
        decode(with_header(WHOLE, change))
    assert message in str(error.value)


def not_a_number(arrays):
    arrays["q"] = arrays["q"].copy()
    arrays["q"][2, 5] = np.nan


def refined_times(change):
    """Return what changes the breaks of the refined part."""

    def changed(arrays):
        arrays["refined_breaks"] = change(arrays["refined_breaks"].copy())

    return changed


def standing_clock(arrays):
    arrays["time"] = arrays["time"].copy()
    arrays["time"][3] = arrays["time"][2]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (not_a_number, "array q has 1 values that are not finite"),
        (standing_clock, "array time does not increase"),
        (lambda a: a.pop("u"), "missing or unknown arrays: u"),
        (lambda a: a.update(extra=np.zeros(3)), "missing or unknown arrays: extra"),
        (lambda a: a.update(u=a["u"][:, :-1]), "array u has the shape (3, 19), expected (3, 20)"),
        (lambda a: a.update(u=a["u"].astype(np.float32)), "u.npy holds float32"),
        (lambda a: a.pop("refined_forces"), "missing or unknown arrays: refined_forces"),
        (lambda a: a.update(refined_q=np.zeros(3)), "missing or unknown arrays: refined_q"),
        (
            lambda a: a.update(refined_states=a["refined_states"][:-1]),
            "array refined_states has the shape (4, 4, 12), expected (5, 4, 12)",
        ),
        (
            lambda a: a.update(refined_impulses=np.full((5, 4), np.inf)),
            "array refined_impulses has 20 values that are not finite",
        ),
        (refined_times(lambda t: t[::-1]), "array refined_breaks does not increase"),
        (refined_times(lambda t: t[:1]), "array refined_breaks has the shape (1,), expected (2,)"),
        (refined_times(lambda t: 2 * t), "refined_breaks leads from 0 s to 1.57 s, expected 0 to 0.785 s"),
        (refined_times(lambda t: t[:, None]), "array refined_breaks has the shape (6, 1), expected (6,)"),
        (lambda a: a.update({f"refined_{i}": np.zeros(1) for i in range(80)}), "arrays, allowed are 64"),
    ],
)
def test_wrong_arrays_are_refused_by_name(change, message):
    with pytest.raises(GaitFileError) as error:
        decode(with_arrays(WHOLE, change))
    assert message in str(error.value)


def test_a_changed_number_is_found_by_the_checksum():
    arrays = arrays_of(WHOLE)
    arrays["q"] = arrays["q"] + 1e-12
    with pytest.raises(GaitFileError, match="checksum does not fit"):
        decode(packed(arrays))


class Bomb:
    """Leaves a mark when it is unpickled."""

    fired = False

    def __reduce__(self):
        return (setattr, (Bomb, "fired", True))


def test_nothing_is_unpickled():
    arrays = arrays_of(WHOLE)
    arrays["q"] = np.array([Bomb()], dtype=object)
    with pytest.raises(GaitFileError, match="nothing is unpickled"):
        decode(packed(arrays))
    with pytest.raises(GaitFileError):
        decode(pickle.dumps(Bomb()))
    assert not Bomb.fired


def test_a_compressed_archive_is_refused_before_it_unfolds():
    with pytest.raises(GaitFileError, match="is compressed"):
        decode(packed({"header": np.zeros(10_000_000, np.uint8)}, compressed=True))


def test_a_declared_size_is_not_believed():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        whole = io.BytesIO()
        np.save(whole, np.zeros(4, np.uint8))
        archive.writestr("header.npy", whole.getvalue().replace(b"(4,)", b"(400000000000,)", 1))
    with pytest.raises(GaitFileError, match=r"header\.npy has|damaged"):
        decode(buffer.getvalue())


# ---------------------------------------------------------------- files and folders


def test_messages_begin_with_the_path(tmp_path):
    missing = tmp_path / "missing.npz"
    with pytest.raises(GaitFileError, match=r"missing\.npz: can't be read: No such file"):
        read_gait_file(missing)
    torn = tmp_path / "torn.npz"
    torn.write_bytes(WHOLE[:-30])
    with pytest.raises(GaitFileError, match=r"torn\.npz: truncated or damaged"):
        read_gait_file(torn)


def test_another_walker_is_named_by_its_differences(tmp_path):
    path = tmp_path / "gait.npz"
    write_gait_file(made_up_gait(), path)
    with pytest.raises(GaitFileError, match=r"for another walker: hip_mass is 45\.0, expected 40\.0"):
        read_gait_file(path, WalkerParameters(hip_mass=40.0))


def test_links_devices_and_giants_are_refused(tmp_path):
    target = tmp_path / "gait.npz"
    target.write_bytes(WHOLE)
    link, pipe, giant = tmp_path / "link.npz", tmp_path / "pipe.npz", tmp_path / "giant.npz"
    link.symlink_to(target)
    os.mkfifo(pipe)
    with giant.open("wb") as stream:
        stream.truncate(LARGEST_FILE + 1)
    for path, message in ((link, "symbolic link"), (pipe, "no regular file"), (giant, "at most 16777216")):
        with pytest.raises(GaitFileError, match=message):
            read_gait_file(path)


def test_a_number_that_is_not_finite_is_not_written(tmp_path):
    gait = made_up_gait()
    path = tmp_path / "gait.npz"
    trajectory = replace(gait.trajectory, u=np.full_like(gait.trajectory.u, np.nan))
    with pytest.raises(GaitFileError, match=r"gait\.npz: array u has 60 values"):
        write_gait_file(replace(gait, trajectory=trajectory), path)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_former_file(tmp_path, monkeypatch):
    path = tmp_path / "gait.npz"
    write_gait_file(made_up_gait(), path)

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(GaitFileError, match="can't be written: No space left on device"):
        write_gait_file(made_up_gait(torque=2.0), path)
    monkeypatch.undo()
    assert_same(read_gait_file(path), made_up_gait())
    assert [entry.name for entry in tmp_path.iterdir()] == ["gait.npz"]


def test_an_entry_that_is_newer_than_the_file_takes_its_default():
    def forget(header):
        header["report"].pop("starts")

    assert decode(with_header(WHOLE, forget)).report.starts == 0
