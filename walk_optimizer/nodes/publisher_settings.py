"""The parameters of the node `reference_publisher`."""

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.nodes.parameters import NodeParameters, Setting
from walk_optimizer.recording import Compression, RecorderSettings
from walk_optimizer.request import GaitRequest

TORQUES = ("u1", "u2", "u3")


def _check_speed(speed: float) -> None:
    if speed != 0:
        GaitRequest.for_speed(speed)


def _check_torque_order(order: list[str]) -> None:
    if sorted(order) != sorted(TORQUES):
        raise ConfigurationError(f"{list(order)} is no order of {', '.join(TORQUES)}")


def _check_compression(name: str) -> None:
    allowed = [entry.value for entry in Compression]
    if name not in allowed:
        raise ConfigurationError(f"{name!r} is none of {', '.join(allowed)}")


SETTINGS = [
    Setting("rate", 500.0, "References per second [Hz].", 1.0, 1000.0),
    Setting("streaming", True, "Whether references are published; the walk stands still while not."),
    Setting(
        "initial_speed",
        0.0,
        "Walk at this speed from the start; 0 waits for a command [m/s].",
        check=_check_speed,
    ),
    Setting(
        "spring_mode",
        SpringMode.STIFFNESS_AND_EQUILIBRIUM.value,
        f"Knee springs of the gaits for ~/target_speed: {', '.join(SpringMode)}.",
        check=SpringMode.parse,
    ),
    Setting("longest_gap", 0.1, "A clock that moves further than this at once has jumped [s].", 0.002, 10.0),
    Setting(
        "torque_order",
        list(TORQUES),
        "Order of ~/feedforward_torques: u1 hip (on the left, its opposite on the right), u2 left knee, "
        "u3 right knee.",
        check=_check_torque_order,
    ),
    Setting("frame_id", "base_link", "Frame in the header of ~/joint_reference."),
    Setting(
        "library_service",
        "gait_library/get_gait",
        "Service that gaits are taken from.",
        read_only=True,
    ),
    Setting(
        "library_timeout", 1000.0, "Longest wait for a gait, which may have to be solved [s].", 1.0, 86_400.0
    ),
    Setting("record", False, "Whether a bag is being recorded; set it to start and stop."),
    Setting("recording_folder", "", "Folder of new bags; empty for ~/.ros/walk_optimizer."),
    Setting("recording_compression", "none", "none, zstd or lz4.", check=_check_compression),
    Setting("recording_file_bytes", 0, "A further file is begun at this size; 0 never [byte].", 0, 1 << 62),
    Setting(
        "recording_file_duration", 0.0, "A further file is begun after this time; 0 never [s].", 0.0, 1e9
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
