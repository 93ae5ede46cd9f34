"""Definitions and hashes of message types, from where ROS installs them. No ROS is imported."""

import json
import os
import re
import sys
from pathlib import Path

from walk_optimizer.recording.errors import MessageDefinitionError

_SEPARATOR = "=" * 80

_TYPE_NAME = re.compile(r"^(?P<package>[a-z]\w*)/(?:msg/)?(?P<name>[A-Z]\w*)$")

# A field: type, perhaps with the bound of a string, perhaps an array, then its name. Comments
# and blank lines do not match, nor does anything else that names no type.
_FIELD = re.compile(r"^\s*(?P<type>[A-Za-z]\w*(?:/\w+)*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]", re.MULTILINE)

_PRIMITIVES = frozenset(
    {"bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16"}
    | {"uint16", "int32", "uint32", "int64", "uint64", "string", "wstring"}
)


def message_definition(type_name: str) -> str:
    """Return the definition of a type followed by those of all types it uses.

    The layout is that of rosbag2: dependencies depth-first, sorted, each once, each after a line
    of 80 equals signs and a line with its name.

    Args:
        type_name: Such as sensor_msgs/msg/JointState.

    Raises:
        MessageDefinitionError: If a definition is not installed.
    """
    package, name = _split(type_name)
    return _with_dependencies(package, name, set())


def type_hash(type_name: str) -> str:
    """Return the RIHS01 hash of a type.

    Args:
        type_name: Such as sensor_msgs/msg/JointState.

    Raises:
        MessageDefinitionError: If the hash is not installed.
    """
    package, name = _split(type_name)
    path = _share_file(package, f"{name}.json")
    try:
        hashes = json.loads(path.read_text(encoding="utf-8"))["type_hashes"]
        return next(
            str(item["hash_string"]) for item in hashes if item["type_name"] == f"{package}/msg/{name}"
        )
    except (OSError, ValueError, KeyError, TypeError, StopIteration) as error:
        raise MessageDefinitionError(f"{path} holds no hash of {type_name}") from error


def _with_dependencies(package: str, name: str, seen: set[str]) -> str:
    text = _share_file(package, f"{name}.msg").read_text(encoding="utf-8")
    for dependency in _dependencies(text, package):
        if dependency in seen:
            continue
        seen.add(dependency)
        below = _with_dependencies(*_split(dependency), seen)
        text += f"\n{_SEPARATOR}\nMSG: {dependency}\n{below}"
    return text


def _dependencies(text: str, package: str) -> list[str]:
    """Return the types that a definition uses, as package/Type, sorted."""
    types = {match["type"] for match in _FIELD.finditer(text)} - _PRIMITIVES
    full = (used if "/" in used else f"{package}/{used}" for used in types)
    return sorted({"/".join(_split(used)) for used in full})


def _split(type_name: str) -> tuple[str, str]:
    match = _TYPE_NAME.match(type_name)
    if match is None:
        raise MessageDefinitionError(f"{type_name!r} is no message type such as std_msgs/msg/String")
    return match["package"], match["name"]


def _share_file(package: str, file: str) -> Path:
    # Wheels of ROS install into the environment of Python itself.
    prefixes = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        path = Path(prefix) / "share" / package / "msg" / file
        if path.is_file():
            return path
    places = ", ".join(filter(None, prefixes))
    raise MessageDefinitionError(
        f"There is no share/{package}/msg/{file} below {places}; is the package installed, and"
        " AMENT_PREFIX_PATH set?"
    )
