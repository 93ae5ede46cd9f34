"""A bag as it lies on the disk: its files, and what it says about itself, read with distrust."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

import yaml

from walk_optimizer.errors import quoted, shortened
from walk_optimizer.recording.errors import CompressedBagError, NotABagError
from walk_optimizer.recording.metadata import METADATA_FILE, STORAGE_IDENTIFIER, TOP_LEVEL_KEY

# Compression that chunks don't tell: of whole files, or of each message. A third one, storage, is theirs.
_HIDDEN_COMPRESSIONS = ("FILE", "MESSAGE")

# In characters: of a bag of some 20 000 files, which takes half a minute to parse.
_LONGEST_DESCRIPTION = 1 << 22


@dataclass(frozen=True)
class Description:
    """What a bag says about itself; what makes no sense is as if it were not there.

    Attributes:
        storage: Name of the storage format; empty when unknown.
        compression_mode: In capitals, such as MESSAGE; empty for none.
        ros_distro: ROS distribution that recorded the bag; empty when unknown.
        custom_data: Free texts.
        file_names: Its files, without folders.
        message_count: Messages in all of them; 0 when unknown.
    """

    storage: str = ""
    compression_mode: str = ""
    ros_distro: str = ""
    custom_data: tuple[tuple[str, str], ...] = ()
    file_names: tuple[str, ...] = ()
    message_count: int = 0

    @classmethod
    def from_mapping(cls, content: Mapping[str, Any]) -> "Description":
        """Read a description of any version."""
        custom = content.get("custom_data")
        files, count = content.get("relative_file_paths"), content.get("message_count")
        return cls(
            storage=_text(content, "storage_identifier"),
            compression_mode=_text(content, "compression_mode").upper(),
            ros_distro=_text(content, "ros_distro"),
            custom_data=tuple(
                (str(key), str(value))
                for key, value in (custom.items() if isinstance(custom, Mapping) else ())
                if isinstance(key, str | int) and isinstance(value, str | int | float)
            ),
            # Bags of version 3 and before name their folder too.
            file_names=tuple(
                PurePath(name).name
                for name in (files if isinstance(files, list) else ())
                if isinstance(name, str)
            ),
            message_count=count if isinstance(count, int) else 0,
        )


def read_description(directory: Path) -> Description | None:
    """Return what the metadata.yaml of a bag directory says; None when there is none that can be read.

    What is in the files counts, so a bag stays a bag without its metadata.yaml.
    """
    path = directory / METADATA_FILE
    try:
        # A named pipe would wait for a writer forever.
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
    except (OSError, UnicodeDecodeError):
        return None
    content = _load(text)
    return _described(content.get(TOP_LEVEL_KEY)) if isinstance(content, Mapping) else None


def parse_description(text: str) -> Description | None:
    """Return what the description within an .mcap file says; None when it can't be read."""
    return _described(_load(text))


def metadata_faults(
    description: Description | None, files: Sequence[Path], messages: int | None
) -> tuple[str, ...]:
    """Return what other readers, which believe metadata.yaml, miss for it: a sentence each.

    Args:
        description: What it says; None when it can't be read.
        files: The files of the bag.
        messages: How many they hold; None when damage leaves that open.
    """
    if description is None:
        return (f"{METADATA_FILE} is missing or can't be read",)
    names = [path.name for path in files]
    listed = set(description.file_names)
    lacking = ", ".join(name for name in names if name not in listed)
    gone = ", ".join(name for name in description.file_names if name not in names)
    faults = []
    if lacking:
        faults.append(f"{METADATA_FILE} lacks files: {shortened(lacking)}")
    if gone:
        faults.append(f"{METADATA_FILE} names files that are not there: {shortened(gone)}")
    if messages not in (None, description.message_count):
        told = f"it tells of {description.message_count} messages, the files hold {messages}"
        faults.append(f"{METADATA_FILE} is out of date: {told}")
    return tuple(faults)


def require_readable(path: Path, description: Description | None) -> None:
    """Refuse a bag whose messages are not what its chunks hold.

    Raises:
        CompressedBagError: rosbag2 has compressed its files or messages.
    """
    if description is not None and description.compression_mode in _HIDDEN_COMPRESSIONS:
        raise CompressedBagError(
            f"{path} was compressed by rosbag2 in mode {description.compression_mode}, allowed are "
            "compressed chunks; `ros2 bag convert` it first, with compression_mode left empty"
        )


def bag_files(path: Path) -> tuple[Path, ...]:
    """Return the files of a bag in the order of recording.

    Args:
        path: A bag directory, or a single .mcap file.

    Raises:
        NotABagError: If there is nothing that could be a bag, or it can't be looked at.
        CompressedBagError: If rosbag2 has compressed its files or messages.
    """
    try:
        if not path.exists():
            raise NotABagError(f"There is no {path}")
        return _files_of(path) if path.is_dir() else (path,)
    except OSError as error:
        raise NotABagError(f"Cannot read {shortened(str(path))}: {error.strerror}") from error


def _files_of(directory: Path) -> tuple[Path, ...]:
    description = read_description(directory)
    require_readable(directory, description)
    # Not the list in metadata.yaml: a killed recording may have begun a file that is not in it.
    # Not glob, to which a folder that can't be read is an empty one.
    files = sorted((path for path in directory.iterdir() if path.suffix == ".mcap"), key=_recording_order)
    if not files:
        storage = description.storage if description else ""
        other = storage not in ("", STORAGE_IDENTIFIER)
        reason = f": its storage is {quoted(storage)}, not {STORAGE_IDENTIFIER!r}" if other else ""
        advice = "; `ros2 bag convert` it first" if other else "; name a bag directory or an .mcap file"
        raise NotABagError(f"{directory} holds no .mcap file{reason}{advice}")
    return tuple(files)


def _recording_order(path: Path) -> tuple[int, str]:
    number = re.search(r"_(\d+)$", path.stem)
    return (int(number.group(1)) if number else 0, path.name)


def _load(text: str) -> object:
    if len(text) > _LONGEST_DESCRIPTION:
        return None
    try:
        content: object = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError):
        return None
    return content


def _described(content: object) -> Description | None:
    return Description.from_mapping(content) if isinstance(content, Mapping) else None


def _text(content: Mapping[str, Any], key: str) -> str:
    value = content.get(key)
    return value if isinstance(value, str) else ""
