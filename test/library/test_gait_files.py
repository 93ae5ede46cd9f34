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
from library.made_up_gait import made_up_gait

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Gait, Trajectory
from walk_optimizer.gait_files import GaitFile, gait_file_name, read_gait_file, write_gait_file
from walk_optimizer.gait_files.codec import LARGEST_FILE, decode, encode
from walk_optimizer.model.parameters import WalkerParameters


def assert_same(found: Gait, expected: Gait) -> None:
    for name in ("walker", "request", "spring", "certificate", "step_length"):
        assert getattr(found, name) == getattr(expected, name)
    for name in (entry.name for entry in fields(Trajectory)):
        np.testing.assert_array_equal(getattr(found.trajectory, name), getattr(expected.trajectory, name))
    # NaN is not equal to itself.
    assert repr(found.report) == repr(expected.report)


def arrays_of(data: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(data)) as archive:
        return dict(archive)


def packed(arrays: dict[str, np.ndarray], compressed: bool = False) -> bytes:
    buffer = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(buffer, **arrays)
    return buffer.getvalue()


def with_header(data: bytes, change) -> bytes:
    """Return the file with a changed header, and a checksum that fits it."""
    from walk_optimizer.gait_files.codec import _checksum

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
    write_gait_file(GaitFile(gait), path)
    found = read_gait_file(path, WalkerParameters()).gait
    assert_same(found, gait)
    assert not found.trajectory.q.flags.writeable
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_a_second_representation_travels_along(tmp_path):
    refined = {"time": np.linspace(0, 1, 7), "q": np.ones((6, 7))}
    path = tmp_path / "gait.npz"
    write_gait_file(GaitFile(made_up_gait(), refined, {"method": "radau", "intervals": 3}), path)
    found = read_gait_file(path)
    assert set(found.refined) == {"time", "q"}
    np.testing.assert_array_equal(found.refined["q"], refined["q"])
    assert found.refined_header == {"method": "radau", "intervals": 3}


def test_equal_gaits_give_equal_bytes():
    assert encode(GaitFile(made_up_gait())) == encode(GaitFile(made_up_gait()))


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


WHOLE = encode(GaitFile(made_up_gait(), {"time": np.linspace(0, 1, 5)}))


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
    assert_same(found.gait, made_up_gait())
    np.testing.assert_array_equal(found.refined["time"], np.linspace(0, 1, 5))


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
        (lambda h: h.update(refined=[]), "refined is no mapping"),
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
        (
            lambda a: a.update(refined_q=np.array([np.inf])),
            "array refined_q has 1 values",
        ),
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
    write_gait_file(GaitFile(made_up_gait()), path)
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
        write_gait_file(GaitFile(replace(gait, trajectory=trajectory)), path)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_former_file(tmp_path, monkeypatch):
    path = tmp_path / "gait.npz"
    write_gait_file(GaitFile(made_up_gait()), path)

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(GaitFileError, match="can't be written: No space left on device"):
        write_gait_file(GaitFile(made_up_gait(torque=2.0)), path)
    monkeypatch.undo()
    assert_same(read_gait_file(path).gait, made_up_gait())
    assert [entry.name for entry in tmp_path.iterdir()] == ["gait.npz"]


def test_an_entry_that_is_newer_than_the_file_takes_its_default():
    def forget(header):
        header["report"].pop("starts")

    assert decode(with_header(WHOLE, forget)).gait.report.starts == 0
