"""What `make` does beside calling the tools."""

import shutil
import subprocess
from pathlib import Path

import pytest

MAKEFILE = Path(__file__).parents[1] / "Makefile"


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_clean_leaves_recordings(tmp_path):
    bag = tmp_path / "log" / "demo_2026_01_31-12_00_00" / "bag" / "bag_0.mcap"
    built = [tmp_path / name for name in (".venv", "build", "install", "dist")]
    for folder in (bag.parent, *built):
        folder.mkdir(parents=True)
    bag.write_bytes(b"recorded")
    shutil.copy(MAKEFILE, tmp_path)
    subprocess.run(["make", "clean"], cwd=tmp_path, check=True, capture_output=True)
    assert bag.read_bytes() == b"recorded"
    assert not any(folder.exists() for folder in built)
