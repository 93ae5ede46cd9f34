"""The parameters of the node `reference_publisher`."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.library import Selection
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.nodes.parameters import NodeParameters, Setting, require_frame, require_name
from walk_optimizer.nodes.stream_messages import INTERFACES, TORQUES, StreamFormat
from walk_optimizer.nodes.walker_setting import WALKER_FILE
from walk_optimizer.recording import Compression, RecorderSettings
from walk_optimizer.references import JOINTS
from walk_optimizer.request import GaitRequest
from walk_optimizer.walk.joint_limits import JointLimits, limits_of

CERTIFIED, BLENDED = "certified", "blended"


# A gap of fewer periods of the references than this would be exceeded in the ordinary run.
LEAST_PERIODS = 2.0
# Each file of a bag has an end of its own and is brought to the disk: smaller ones cost more than what is in
# them. In [byte] and [s].
_LEAST_FILE_BYTES, _LEAST_FILE_DURATION = 1 << 20, 1.0


def _check_speed(speed: float) -> None:
    if speed != 0:
        GaitRequest.for_speed(speed)


def _check_names(names: Sequence[str]) -> None:
    for name in names:
        require_name(name)


def _check_file_limit(least: float, unit: str) -> Callable[[float], None]:
    """Return what refuses a size or a duration of files that is less than the least, but not 0."""

    def check(value: float) -> None:
        if 0 < value < least:
            raise ConfigurationError(
                f"{value} {unit} is too little for a file; give {least} {unit} or more, or 0 for one file"
            )

    return check


SETTINGS = [
    Setting("rate", 500.0, "References per second [Hz].", 1.0, 1000.0),
    Setting("streaming", True, "Whether references are published; the walk holds while not."),
    Setting(
        "initial_speed",
        0.0,
        "Walk at this speed from activation on; 0 stands until a command comes. It can't be changed while "
        "the node is active [m/s].",
        check=_check_speed,
    ),
    Setting(
        "spring_mode",
        SpringMode.STIFFNESS_AND_EQUILIBRIUM.value,
        f"Knee springs of the gaits for ~/target_speed and ~/cmd_vel: {', '.join(SpringMode)}.",
        choices=list(SpringMode),
    ),
    Setting(
        "selection",
        Selection.EXACT.value,
        "Which gait of the library a speed is walked with: exact, interpolated or nearest (see GetGait).",
        choices=list(Selection),
    ),
    Setting(
        "command_timeout",
        0.5,
        "A stream of speeds on ~/cmd_vel that is silent for longer than this, by the node's clock, ends in a "
        "stop, as with any drive controller; 0 never. Speeds of ~/target_speed and ~/set_gait are "
        "set-points: sent once, they hold until the next command [s].",
        0.0,
        3600.0,
    ),
    Setting(
        "pause_time",
        0.3,
        "Time in which ~/pause brings the references to rest, and ~/resume back to the walk [s].",
        0.01,
        10.0,
    ),
    Setting(
        "joint_torque_limits",
        [0.0],
        "Largest torque of each joint, left_hip, left_knee, right_hip, right_knee, or one number for all; "
        "0 for none. A gait that needs more, or the steps to it or from it to a stand, is refused [N m].",
        check=limits_of,
    ),
    Setting(
        "joint_speed_limits",
        [0.0],
        "Largest speed of each joint, in the same order, or one number for all; 0 for none. A gait that "
        "needs more, or the steps to it or from it to a stand, is refused [rad/s].",
        check=limits_of,
    ),
    Setting(
        "longest_gap",
        0.1,
        "A clock that moves further than this between two references has jumped, and the walk holds; "
        f"{LEAST_PERIODS:g} periods of `rate` at least [s].",
        0.002,
        10.0,
    ),
    Setting(
        "joint_names",
        list(JOINTS),
        "Order of the joints in all messages.",
        choices=JOINTS,
    ),
    Setting(
        "command_interface",
        "position",
        f"What ~/commands holds for each joint: {', '.join(INTERFACES)}.",
        choices=INTERFACES,
    ),
    Setting(
        "trajectory_effort",
        True,
        "Whether ~/joint_trajectory holds feed-forward torques; joint_trajectory_controller refuses them "
        "unless it has an effort command interface.",
    ),
    Setting(
        "torque_order",
        list(TORQUES),
        "Order of ~/feedforward_torques: u1 hip (on the left, its opposite on the right), u2 left knee, "
        "u3 right knee.",
        choices=TORQUES,
    ),
    Setting("frame_id", "base_link", "Frame in the header of ~/joint_reference.", check=require_frame),
    WALKER_FILE,
    Setting(
        "transitions",
        CERTIFIED,
        f"{CERTIFIED}: speeds change by steps that are solved for and certified, or not at all. {BLENDED}: "
        "by one step that blends the references, at once; smooth, but no walker can follow it exactly.",
        choices=(CERTIFIED, BLENDED),
    ),
    Setting(
        "transition_time_limit", 120.0, "Longest solve for the steps between two gaits [s].", 1.0, 3600.0
    ),
    Setting(
        "cache_folder",
        "",
        "Folder for steps between gaits that were solved; empty for the user's cache.",
        read_only=True,
    ),
    Setting(
        "library_service",
        "gait_library/get_gait",
        "Service that gaits are taken from.",
        check=require_name,
        read_only=True,
    ),
    Setting(
        "library_timeout", 1000.0, "Longest wait for a gait, which may have to be solved [s].", 1.0, 86_400.0
    ),
    Setting("record", False, "Whether a bag is being recorded; set it to start and stop."),
    Setting(
        "recording_topics",
        [
            "gait_library/table",
            "robot_description",
            "tf",
            "tf_static",
            "walker_visualizer/markers",
            "/diagnostics",
        ],
        "Topics of other nodes that are recorded beside the publisher's own, as soon as they are there.",
        check=_check_names,
    ),
    Setting("recording_folder", "", "Folder of new bags; empty for ~/.ros/walk_optimizer."),
    Setting(
        "recording_compression",
        "none",
        "none, zstd or lz4.",
        choices=[entry.value for entry in Compression],
    ),
    Setting(
        "recording_file_bytes",
        0,
        f"A further file is begun at this size, {_LEAST_FILE_BYTES} or more; 0 never [byte].",
        0,
        1 << 62,
        check=_check_file_limit(_LEAST_FILE_BYTES, "byte"),
    ),
    Setting(
        "recording_file_duration",
        0.0,
        f"A further file is begun after this time, {_LEAST_FILE_DURATION:g} or more; 0 never [s].",
        0.0,
        1e9,
        check=_check_file_limit(_LEAST_FILE_DURATION, "s"),
    ),
    Setting(
        "recording_free_bytes",
        256 * 1024 * 1024,
        "Recording stops when less of the disk is free [byte].",
        0,
        1 << 62,
    ),
]


def recorder_settings(parameters: NodeParameters) -> RecorderSettings:
    """Return the settings of a bag that begins now."""
    return RecorderSettings(
        compression=Compression(parameters["recording_compression"]),
        max_file_bytes=parameters["recording_file_bytes"],
        max_file_duration=parameters["recording_file_duration"],
        min_free_bytes=parameters["recording_free_bytes"],
    )


FORMAT_SETTINGS = {"joint_names", "torque_order", "command_interface", "frame_id"}


def stream_format(parameters: NodeParameters) -> StreamFormat:
    """Return what the streamed messages look like from now on."""
    return StreamFormat(
        joint_names=tuple(parameters["joint_names"]),
        torque_order=tuple(parameters["torque_order"]),
        command_interface=parameters["command_interface"],
        frame_id=parameters["frame_id"],
    )


LIMIT_SETTINGS = {"joint_torque_limits", "joint_speed_limits"}


def joint_limits(parameters: NodeParameters, changes: Mapping[str, Any] | None = None) -> JointLimits:
    """Return what the joints can do.

    Args:
        parameters: Of the node.
        changes: Values that count instead of the parameters.
    """
    torque, speed = (
        limits_of((changes or {}).get(name, parameters[name]))
        for name in ("joint_torque_limits", "joint_speed_limits")
    )
    return JointLimits(torque, speed)
