"""Gaits that are there already: the packaged table, a user's cache, and what lies between their speeds."""

from walk_optimizer.library.gait_library import (
    EXACT_SPEED_TOLERANCE,
    GaitLibrary,
    Selection,
    Source,
    cache_folder,
    existing_folder,
    parse_selection,
    table_folder,
)

__all__ = [
    "EXACT_SPEED_TOLERANCE",
    "GaitLibrary",
    "Selection",
    "Source",
    "cache_folder",
    "existing_folder",
    "parse_selection",
    "table_folder",
]
