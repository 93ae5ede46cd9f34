"""The gaits that ship, whatever is in the user's cache."""

import tempfile
from pathlib import Path

from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters


def packaged_library() -> GaitLibrary:
    """Return the library of the packaged table alone, to read."""
    with tempfile.TemporaryDirectory() as empty:
        return GaitLibrary(WalkerParameters.from_yaml(), Path(empty))
