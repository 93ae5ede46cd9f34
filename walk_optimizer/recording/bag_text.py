"""The description of a bag as a text for people."""

from datetime import UTC, datetime

from walk_optimizer.recording.info import BagInfo
from walk_optimizer.recording.records import DamageKind
from walk_optimizer.recording.topics import NANOSECONDS_PER_SECOND


def format_bag(info: BagInfo) -> str:
    """Return the description of a bag as a text for people."""
    lines = [
        f"Bag:         {info.path}",
        f"State:       {_state(info)}",
        f"Size:        {info.size_bytes / 1e6:.3f} MB in {len(info.files)} file(s)",
        f"Compression: {', '.join(name or 'none' for name in info.compressions) or 'none'}",
        f"Distro:      {info.ros_distro or 'unknown'}",
        f"Start:       {_date(info.start_time_ns)}",
        f"Duration:    {info.duration_ns / NANOSECONDS_PER_SECOND:.6f} s",
        f"Messages:    {info.message_count}",
        "Topics:",
    ]
    counts = info.counts
    lines += [f"  {name}  {', '.join(types)}  {counts[name]}" for name, types in info.types.items()]
    lines += [f"{key}: {value}" for key, value in info.custom_data]
    for file in info.files:
        lines += [f"  {file.path.name}, byte {item.offset}: {item.reason}" for item in file.damage]
    lines += [f"  {fault}" for fault in info.metadata_faults]
    return "\n".join(lines)


def _state(info: BagInfo) -> str:
    if info.is_whole:
        return "whole, all checksums right"
    found = [f"{info.count_damage(kind)} x {kind.value}" for kind in DamageKind if info.count_damage(kind)]
    found += ["metadata.yaml"] * bool(info.metadata_faults)
    saved = "`bag repair` writes a whole bag from what is left"
    rest = saved if info.message_count else "nothing was recorded that could be saved"
    return f"damaged ({', '.join(found)}); {rest}"


def _date(time_ns: int | None) -> str:
    if time_ns is None:
        return "no messages"
    seconds = time_ns / NANOSECONDS_PER_SECOND
    date = datetime.fromtimestamp(seconds, tz=UTC).isoformat(sep=" ")
    return f"{date} ({time_ns} ns)"
