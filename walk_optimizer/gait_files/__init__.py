"""Gait files: one gait a file, versioned, checked, written atomically (docs/gait_format.md).

Owns the bytes of a file and how they reach the disk. Does not own which folder they lie in or which
gait answers a request: that is the library's.
"""

from walk_optimizer.gait_files.files import (
    SUFFIX,
    gait_file_name,
    read_gait_file,
    transition_name_parts,
    write_gait_file,
)

__all__ = ["SUFFIX", "gait_file_name", "read_gait_file", "transition_name_parts", "write_gait_file"]
