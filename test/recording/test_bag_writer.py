"""Bags are read back by rosbags, an independent implementation of rosbag2 in Python."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from recording.samples import (
    GAIT,
    JOINTS,
    PERIOD_NS,
    START_NS,
    STORE,
    TORQUES,
    joint_state,
    number_of,
    string,
    write_bag,
)
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Reader

from walk_optimizer.recording import BagWriter, Compression, RecorderSettings, TopicInfo, describe_bag
from walk_optimizer.recording import metadata as metadata_module
from walk_optimizer.recording.errors import (
    BagExistsError,
    BagNotWritableError,
    MessageError,
    RecordingSettingsError,
    TopicError,
)

FIELDS = {
    "version",
    "storage_identifier",
    "duration",
    "starting_time",
    "message_count",
    "topics_with_message_count",
    "compression_format",
    "compression_mode",
    "relative_file_paths",
    "files",
    "custom_data",
    "ros_distro",
}


def metadata_of(directory: Path) -> dict:
    return yaml.safe_load((directory / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


@pytest.mark.parametrize("compression", list(Compression))
def test_rosbags_reads_every_field_of_every_message(tmp_path, compression):
    bag = write_bag(tmp_path / "walk", range(1000), RecorderSettings(compression=compression))
    # Without a typestore of its own the reader can only use the definitions in the bag.
    with AnyReader([bag]) as reader:
        texts = [raw for connection, _, raw in reader.messages() if connection.topic == GAIT.name]
        states = [
            (time, reader.deserialize(raw, connection.msgtype))
            for connection, time, raw in reader.messages()
            if connection.topic == JOINTS.name
        ]
    assert [bytes(raw) for raw in texts] == [string("gait")]
    assert [time for time, _ in states] == [START_NS + n * PERIOD_NS for n in range(1000)]
    for number, (time, state) in enumerate(states):
        stamp = state.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == time
        assert state.header.frame_id == f"frame {number}"
        assert state.name == ["a", "b", "c", "d"]
        assert list(state.position) == [number, number + 1, number + 2, number + 3]
        assert list(state.velocity) == [value + 0.25 for value in state.position]
        assert list(state.effort) == [value + 0.5 for value in state.position]


def test_metadata_has_all_fields_of_version_9(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    bag = write_bag(tmp_path / "walk", range(10))
    metadata = metadata_of(bag)
    assert set(metadata) == FIELDS
    assert metadata["version"] == 9
    assert metadata["storage_identifier"] == "mcap"
    assert metadata["ros_distro"] == "jazzy"
    assert metadata["relative_file_paths"] == ["walk_0.mcap"]
    assert metadata["message_count"] == 11
    assert metadata["starting_time"] == {"nanoseconds_since_epoch": START_NS}
    assert metadata["duration"] == {"nanoseconds": 9 * PERIOD_NS}
    joints = metadata["topics_with_message_count"][0]
    assert joints["message_count"] == 10
    assert set(joints["topic_metadata"]) == {
        "name",
        "type",
        "serialization_format",
        "offered_qos_profiles",
        "type_description_hash",
    }
    infinite = {"sec": 9223372036, "nsec": 854775807}
    assert joints["topic_metadata"]["offered_qos_profiles"] == [
        {
            "history": "keep_last",
            "depth": 10,
            "reliability": "reliable",
            "durability": "volatile",
            "deadline": infinite,
            "lifespan": infinite,
            "liveliness": "automatic",
            "liveliness_lease_duration": infinite,
            "avoid_ros_namespace_conventions": False,
        }
    ]


def test_rosbags_accepts_the_metadata(tmp_path):
    bag = write_bag(tmp_path / "walk", range(10))
    with Reader(bag) as reader:
        by_topic = {connection.topic: connection for connection in reader.connections}
        assert reader.message_count == 11
        assert reader.start_time == START_NS
        assert reader.duration == 9 * PERIOD_NS + 1
        assert by_topic[JOINTS.name].msgcount == 10
        assert by_topic[JOINTS.name].digest == STORE.hash_rihs01("sensor_msgs/msg/JointState")
        assert by_topic[GAIT.name].ext.offered_qos_profiles[0].durability is QosDurability.TRANSIENT_LOCAL


def test_mcap_file_is_laid_out_as_rosbag2_does(tmp_path):
    bag = write_bag(tmp_path / "walk", range(2000))
    with (bag / "walk_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        header = reader.get_header()
        summary = reader.get_summary()
        descriptions = [record for record in reader.iter_metadata() if record.name == "rosbag2"]
    assert header.profile == "ros2"
    assert header.library.startswith("walk_optimizer")
    assert {(schema.name, schema.encoding) for schema in summary.schemas.values()} == {
        ("sensor_msgs/msg/JointState", "ros2msg"),
        ("std_msgs/msg/String", "ros2msg"),
    }
    channel = next(item for item in summary.channels.values() if item.topic == JOINTS.name)
    assert channel.message_encoding == "cdr"
    assert channel.metadata["topic_type_hash"] == JOINTS.type_hash
    assert yaml.safe_load(channel.metadata["offered_qos_profiles"]) == [JOINTS.qos[0].to_mapping()]
    assert set(yaml.safe_load(descriptions[-1].metadata["serialized_metadata"])) == FIELDS
    assert yaml.safe_load(descriptions[-1].metadata["serialized_metadata"]) == metadata_of(bag)
    # One message may stand beyond the limit, since it is what reaches it.
    assert max(index.uncompressed_size for index in summary.chunk_indexes) < 64 * 1024 + 1024


def test_topics_of_one_type_share_a_schema(tmp_path):
    with BagWriter(tmp_path / "walk") as writer:
        writer.add_topic(JOINTS)
        writer.add_topic(JOINTS)
        writer.add_topic(
            TopicInfo("/measured", JOINTS.type_name, JOINTS.definition, JOINTS.type_hash, JOINTS.qos)
        )
        writer.write("/measured", joint_state(0), START_NS)
    with (tmp_path / "walk" / "walk_0.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert len(summary.schemas) == 1
    assert len(summary.channels) == 2


def test_an_empty_bag_is_a_bag(tmp_path):
    with BagWriter(tmp_path / "walk") as writer:
        writer.add_topic(JOINTS)
    with Reader(tmp_path / "walk") as reader:
        assert reader.message_count == 0
        assert [connection.topic for connection in reader.connections] == [JOINTS.name]
    assert describe_bag(tmp_path / "walk").is_whole


@pytest.mark.parametrize(
    "settings",
    [
        RecorderSettings(max_file_bytes=100_000),
        RecorderSettings(max_file_duration=0.5),
        RecorderSettings(max_file_bytes=1, chunk_bytes=100_000, compression=Compression.ZSTD),
    ],
    ids=["size", "duration", "smaller than a chunk"],
)
def test_split_bags_are_read_as_one(tmp_path, settings):
    bag = write_bag(tmp_path / "walk", range(2000), settings)
    metadata = metadata_of(bag)
    names = metadata["relative_file_paths"]
    assert len(names) > 1
    assert names == [f"walk_{number}.mcap" for number in range(len(names))]
    assert names == [entry["path"] for entry in metadata["files"]]
    assert sum(entry["message_count"] for entry in metadata["files"]) == metadata["message_count"] == 2001
    with AnyReader([bag]) as reader:
        numbers = [number_of(raw) for c, _, raw in reader.messages() if c.topic == JOINTS.name]
    assert numbers == list(range(2000))
    assert [file.path.name for file in describe_bag(bag).files] == names


def test_files_split_by_duration_span_no_longer(tmp_path):
    bag = write_bag(tmp_path / "walk", range(2000), RecorderSettings(max_file_duration=0.5))
    durations = [entry["duration"]["nanoseconds"] for entry in metadata_of(bag)["files"]]
    assert max(durations) == 500 * PERIOD_NS


def test_metadata_exists_from_the_start_and_is_renewed_at_splits(tmp_path):
    writer = BagWriter(tmp_path / "walk")
    assert metadata_of(tmp_path / "walk")["relative_file_paths"] == ["walk_0.mcap"]
    writer.add_topic(JOINTS)
    assert len(metadata_of(tmp_path / "walk")["topics_with_message_count"]) == 1
    writer.write(JOINTS.name, joint_state(0), START_NS)
    writer.split()
    metadata = metadata_of(tmp_path / "walk")
    assert metadata["relative_file_paths"] == ["walk_0.mcap", "walk_1.mcap"]
    assert metadata["message_count"] == 1
    writer.close()
    writer.close()


def test_each_split_costs_as_much_as_the_one_before(tmp_path, monkeypatch):
    """Of the files that are finished nothing is worked out again, however many there are."""
    described = []

    def describe(entry):
        described.append(entry.path)
        return describe_file(entry)

    describe_file = metadata_module._file
    monkeypatch.setattr(metadata_module, "_file", describe)
    writer = BagWriter(tmp_path / "1e5: #walk", topics=[JOINTS])
    costs = []
    for number in range(20):
        described.clear()
        writer.write(JOINTS.name, joint_state(number), START_NS + number * PERIOD_NS)
        writer.split()
        costs.append(len(described))
    writer.close()
    assert max(costs[2:]) == costs[2] < 10
    metadata = metadata_of(tmp_path / "1e5: #walk")
    assert metadata["relative_file_paths"] == [f"1e5: #walk_{number}.mcap" for number in range(21)]
    assert [entry["path"] for entry in metadata["files"]] == metadata["relative_file_paths"]
    assert [entry["message_count"] for entry in metadata["files"]] == [1] * 20 + [0]
    assert describe_bag(tmp_path / "1e5: #walk").is_whole


def test_times_may_be_zero_and_out_of_order(tmp_path):
    with BagWriter(tmp_path / "walk") as writer:
        writer.add_topic(JOINTS)
        for time_ns in (5, 0, 9, 3):
            writer.write(JOINTS.name, joint_state(time_ns), time_ns)
    metadata = metadata_of(tmp_path / "walk")
    assert metadata["starting_time"]["nanoseconds_since_epoch"] == 0
    assert metadata["duration"]["nanoseconds"] == 9


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "walk").mkdir()
    with pytest.raises(BagExistsError, match="walk exists already"):
        BagWriter(tmp_path / "walk")
    assert list((tmp_path / "walk").iterdir()) == []


def test_a_place_that_is_no_directory_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BagNotWritableError, match="file/walk: Not a directory"):
        BagWriter(tmp_path / "file" / "walk")


def test_an_unwritable_folder_is_named(tmp_path, monkeypatch):
    # Root may write anywhere, so the operating system is made to refuse.
    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(BagNotWritableError, match="walk: Permission denied"):
        BagWriter(tmp_path / "walk")


def refuse(*_: object, **__: object) -> None:
    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def test_unannounced_topics_and_impossible_messages_are_refused(tmp_path):
    with BagWriter(tmp_path / "walk") as writer:
        writer.add_topic(JOINTS)
        with pytest.raises(TopicError, match=f"/other was not announced.*{JOINTS.name}"):
            writer.write("/other", b"", 0)
        with pytest.raises(TopicError, match=r"sensor_msgs/msg/JointState.*not std_msgs/msg/String"):
            writer.add_topic(TopicInfo(JOINTS.name, "std_msgs/msg/String", "", ""))
        with pytest.raises(MessageError, match="is -1, must be in"):
            writer.write(JOINTS.name, b"", -1)
        with pytest.raises(MessageError, match="is a str, must be bytes"):
            writer.write(JOINTS.name, "text", 0)  # type: ignore[arg-type]
    with pytest.raises(BagNotWritableError, match="is closed"):
        writer.write(JOINTS.name, b"", 0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("chunk_bytes", 0),
        ("max_file_bytes", -1),
        ("max_file_duration", float("nan")),
        ("flush_period", 0.0),
        ("min_free_bytes", -1),
        ("queue_messages", 0),
        ("compression", "zip"),
    ],
)
def test_settings_out_of_range_are_named(name, value):
    with pytest.raises(RecordingSettingsError, match=f"{name} is .*{value}"):
        RecorderSettings(**{name: value})


def test_multi_array_round_trip(tmp_path):
    types = STORE.types
    layout = types["std_msgs/msg/MultiArrayLayout"](
        [types["std_msgs/msg/MultiArrayDimension"]("torque", 3, 3)], 0
    )
    message = types["std_msgs/msg/Float64MultiArray"](layout, np.array([1.5, -2.5, 3.5]))
    with BagWriter(tmp_path / "walk") as writer:
        writer.add_topic(TORQUES)
        writer.write(TORQUES.name, bytes(STORE.serialize_cdr(message, TORQUES.type_name)), START_NS)
    with AnyReader([tmp_path / "walk"]) as reader:
        ((connection, _, raw),) = reader.messages()
        read = reader.deserialize(raw, connection.msgtype)
    assert read.layout.dim[0].label == "torque"
    assert list(read.data) == [1.5, -2.5, 3.5]
