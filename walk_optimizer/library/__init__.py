"""Gaits that are there already: the packaged table, a user's cache, and what lies between their speeds."""

from walk_optimizer.library.entries import Source
from walk_optimizer.library.gait_library import GaitLibrary, cache_folder, existing_folder, table_folder
from walk_optimizer.library.selection import EXACT_SPEED_TOLERANCE, Selection, parse_selection

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
