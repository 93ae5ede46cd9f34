"""Messages of the real rclpy: definitions, hashes, serialised bytes, quality of service."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording.samples import START_NS, STORE
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from rosbags.typesys import get_types_from_msg

import walk_optimizer
from walk_optimizer.recording import QosProfile, Recorder, RecorderSettings, read_messages
from walk_optimizer.recording.definitions import message_definition, type_hash
from walk_optimizer.recording.errors import MessageDefinitionError
from walk_optimizer.recording.topics import INFINITE_NS, qos_from_yaml, qos_to_yaml

TYPES = [
    "builtin_interfaces/msg/Time",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "rcl_interfaces/msg/ParameterEvent",
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Empty",
    "std_msgs/msg/Float64",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/String",
    "trajectory_msgs/msg/JointTrajectory",
]


def needs_ros():
    return pytest.importorskip("rclpy"), pytest.importorskip("walk_optimizer.recording.ros_messages")


def installed(name: str) -> bool:
    try:
        type_hash(name)
    except MessageDefinitionError:
        return False
    return True


@pytest.mark.parametrize("name", TYPES)
def test_hash_and_definition_agree_with_an_independent_source(name):
    if not installed(name):
        pytest.skip(f"{name} is not installed")
    assert type_hash(name) == STORE.hash_rihs01(name)
    store = type(STORE)()
    store.register(get_types_from_msg(message_definition(name), name))
    assert store.hash_rihs01(name) == type_hash(name)


@pytest.mark.parametrize("name", ["Gait", "GaitTable", "SolverReport", "Certificate", "GaitSummary"])
def test_hash_of_our_own_types_follows_from_their_definitions(name):
    full_name = f"walk_optimizer_interfaces/msg/{name}"
    if not installed(full_name):
        pytest.skip("walk_optimizer_interfaces is not built")
    store = type(STORE)()
    store.register(get_types_from_msg(message_definition(full_name), full_name))
    assert store.hash_rihs01(full_name) == type_hash(full_name)


@pytest.fixture
def share(tmp_path, monkeypatch):
    """A prefix with made-up message packages."""

    def add(package: str, name: str, text: str) -> None:
        folder = tmp_path / "share" / package / "msg"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.msg").write_text(text)

    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    return add


def test_dependencies_come_depth_first_sorted_and_once(share):
    share(
        "a_msgs",
        "Top",
        "b_msgs/Zoo zoo\nOwn[<=3] own  # other_msgs/Comment\n# b_msgs/No no\nstring<=5 text\n",
    )
    share("a_msgs", "Own", "uint8 LIMIT=3\nb_msgs/msg/Leaf[2] leaves\nwstring wide\n")
    share("b_msgs", "Zoo", "Leaf leaf\nfloat64[] values 0.0\n")
    share("b_msgs", "Leaf", "bool yes true\n")
    line = "=" * 80
    zoo, own, leaf = "Leaf leaf\nfloat64[] values 0.0\n", "uint8 LIMIT=3\n", "bool yes true\n"
    assert message_definition("a_msgs/msg/Top").split(f"\n{line}\n")[1:] == [
        f"MSG: a_msgs/Own\n{own}b_msgs/msg/Leaf[2] leaves\nwstring wide\n",
        f"MSG: b_msgs/Leaf\n{leaf}",
        f"MSG: b_msgs/Zoo\n{zoo}",
    ]


def test_a_missing_definition_names_where_it_was_looked_for(share, tmp_path):
    with pytest.raises(
        MessageDefinitionError, match=r"share/no_msgs/msg/Thing\.msg below .*AMENT_PREFIX_PATH"
    ):
        message_definition("no_msgs/msg/Thing")
    with pytest.raises(MessageDefinitionError, match="'nonsense' is no message type"):
        message_definition("nonsense")
    share("a_msgs", "Top", "")
    (tmp_path / "share" / "a_msgs" / "msg" / "Top.json").write_text("{}")
    with pytest.raises(MessageDefinitionError, match=r"Top.json holds no hash of a_msgs/msg/Top"):
        type_hash("a_msgs/msg/Top")


def test_profiles_survive_yaml():
    profiles = (QosProfile(), QosProfile("keep_all", 0, "best_effort", "transient_local", 5, 10**9 + 7))
    assert qos_from_yaml(qos_to_yaml(profiles)) == profiles
    assert (
        qos_from_yaml("") == qos_from_yaml("[1, 2]") == qos_from_yaml("{") == qos_from_yaml("[" * 1000) == ()
    )
    assert qos_from_yaml(qos_to_yaml(profiles).replace("depth: 0", "depth: .inf")) == ()


def test_profiles_of_old_bags_have_numbers():
    text = (
        "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n  deadline: {sec: 9223372036,"
        " nsec: 854775807}\n  lifespan: {sec: 10, nsec: 0}\n  liveliness: 1\n"
        "  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}\n"
        "  avoid_ros_namespace_conventions: false"
    )
    (profile,) = qos_from_yaml(text)
    assert profile == QosProfile("unknown", 0, "reliable", "volatile", lifespan_ns=10**10)


def test_real_messages_round_trip_field_by_field(tmp_path):
    needs_ros()
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray, MultiArrayDimension, String

    from walk_optimizer.recording.ros_messages import deserialize, serialize, topic_info

    messages = []
    for number in range(50):
        state = JointState(name=["left_hip", "left_knee"], position=[0.1 * number, 2.0])
        state.header.stamp.sec = number
        torques = Float64MultiArray(data=[1.0, 2.0, float(number)])
        torques.layout.dim = [MultiArrayDimension(label="u", size=3, stride=3)]
        messages += [("/joints", state), ("/torques", torques)]
    messages.append(("/gait", String(data="η = 0.3")))
    recorder = Recorder(tmp_path / "walk", RecorderSettings(min_free_bytes=0))
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    recorder.add_topic(topic_info("/joints", JointState, QoSProfile(depth=10)))
    recorder.add_topic(topic_info("/torques", Float64MultiArray, QoSProfile(depth=10)))
    recorder.add_topic(topic_info("/gait", String, latched))
    with recorder:
        for number, (topic, message) in enumerate(messages):
            recorder.write(topic, serialize(message), START_NS + number)
    assert [deserialize(item) for item in read_messages(tmp_path / "walk")] == [m for _, m in messages]
    with AnyReader([tmp_path / "walk"]) as reader:
        read = [(c.topic, reader.deserialize(raw, c.msgtype)) for c, _, raw in reader.messages()]
        profiles = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
    assert profiles["/gait"].durability is QosDurability.TRANSIENT_LOCAL
    assert profiles["/gait"].depth == 1
    assert profiles["/joints"].deadline == (9223372036, 854775807)
    assert [topic for topic, _ in read] == [topic for topic, _ in messages]
    for (_, theirs), (_, ours) in zip(read, messages, strict=True):
        assert_same(theirs, ours)


def assert_same(theirs, ours):
    """Compare a message as rosbags and as rclpy have it."""
    if hasattr(ours, "get_fields_and_field_types"):
        for name in ours.get_fields_and_field_types():
            assert_same(getattr(theirs, name), getattr(ours, name))
    elif isinstance(ours, (str, int, float, bool)):
        assert theirs == ours
    else:
        assert len(theirs) == len(ours)
        for left, right in zip(theirs, ours, strict=True):
            assert_same(left, right)


def test_a_message_of_our_own_round_trips(tmp_path):
    needs_ros()
    interfaces = pytest.importorskip("walk_optimizer_interfaces.msg")
    from rclpy.qos import QoSProfile

    from walk_optimizer.recording.ros_messages import deserialize, serialize, topic_info

    table = interfaces.GaitTable(walker="w", gaits=[interfaces.GaitSummary(speed=0.4, certified=True)])
    gait = interfaces.Gait(spring_mode="none", points=2, q=[0.5] * 12)
    gait.certificate.family = ["dynamics"]
    recorder = Recorder(tmp_path / "walk", RecorderSettings(min_free_bytes=0))
    recorder.add_topic(topic_info("/table", interfaces.GaitTable, QoSProfile(depth=1)))
    recorder.add_topic(topic_info("/gait", interfaces.Gait, QoSProfile(depth=1)))
    with recorder:
        recorder.write("/table", serialize(table), START_NS)
        recorder.write("/gait", serialize(gait), START_NS + 1)
    assert [deserialize(item) for item in read_messages(tmp_path / "walk")] == [table, gait]
    with AnyReader([tmp_path / "walk"]) as reader:
        theirs = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()]
    assert_same(theirs[0], table)
    assert_same(theirs[1], gait)


NUMBERS = st.lists(st.floats(allow_nan=False), max_size=3)


@settings(max_examples=200, deadline=None)
@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")), NUMBERS, NUMBERS, NUMBERS)
def test_serialised_messages_end_where_their_last_field_does(text, position, velocity, effort):
    """rosbags refuses bytes behind a message, so it tells the length independently."""
    needs_ros()
    from sensor_msgs.msg import JointState

    from walk_optimizer.recording.ros_messages import serialize

    message = JointState(name=[text, "b"], position=position, velocity=velocity, effort=effort)
    message.header.frame_id = text
    data = serialize(message)
    theirs = STORE.deserialize_cdr(data, "sensor_msgs/msg/JointState")
    assert_same(theirs, message)
    assert len(data) == len(STORE.serialize_cdr(theirs, "sensor_msgs/msg/JointState"))


@pytest.mark.parametrize("name", [name for name in TYPES if not name.startswith("rcl")])
def test_lengths_of_default_messages_are_exact(name):
    needs_ros()
    pytest.importorskip(name.split("/")[0])
    from walk_optimizer.recording.ros_messages import message_class, serialize, type_name

    kind = message_class(name)
    assert type_name(kind) == name
    data = serialize(kind())
    assert len(data) == len(STORE.serialize_cdr(STORE.deserialize_cdr(data, name), name))


def test_a_type_that_is_not_installed_is_named():
    needs_ros()
    from walk_optimizer.recording.ros_messages import message_class

    for name in ("no_msgs/msg/Thing", "std_msgs/msg/Thing", "nonsense"):
        with pytest.raises(MessageDefinitionError, match=name):
            message_class(name)


def test_durations_left_to_the_middleware_are_infinite():
    needs_ros()
    from rclpy.duration import Duration
    from rclpy.qos import QoSProfile

    from walk_optimizer.recording.ros_messages import qos_profile

    profile = qos_profile(QoSProfile(depth=3, deadline=Duration(nanoseconds=1_500_000_000)))
    assert (profile.deadline_ns, profile.lifespan_ns) == (1_500_000_000, INFINITE_NS)
    assert (profile.history, profile.depth, profile.reliability) == ("keep_last", 3, "reliable")


def test_bags_need_no_ros():
    code = (
        "import sys\n"
        "for name in ('rclpy', 'rosidl_parser', 'std_msgs', 'ament_index_python'): sys.modules[name] = None\n"
        "import walk_optimizer.recording\n"
        "from walk_optimizer.recording import definitions\n"
    )
    root = Path(walk_optimizer.__file__).parent.parent
    subprocess.run([sys.executable, "-c", code], check=True, cwd=root)
    assert import_module("walk_optimizer.recording").describe_bag
