"""Places that a user names are looked at before any work, and what is wrong with them is one sentence."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait_files.access import read_limited, writable_folder, writable_target

USES = {
    "target": writable_target,
    "folder": lambda path: writable_folder(path, create=False),
    "new folder": lambda path: writable_folder(path, create=True),
    "file": lambda path: read_limited(path, 100),
}
NOBODY = 65534


@pytest.mark.parametrize("use", USES.values(), ids=USES)
def test_a_name_that_no_file_can_have_is_refused(tmp_path, use):
    with pytest.raises(GaitFileError, match="File name too long"):
        use(tmp_path / ("gait" * 100))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may become somebody else")
@pytest.mark.parametrize("use", USES)
def test_a_folder_that_may_not_be_entered_is_refused(tmp_path, use):
    code = (
        "import os; from pathlib import Path\n"
        "from library.test_access import USES\n"
        f"os.setuid({NOBODY})\n"
        "from walk_optimizer.errors import GaitFileError\n"
        f"try: USES[{use!r}](Path('private/gait.npz'))\n"
        "except GaitFileError as error: print(error)\n"
    )
    (tmp_path / "private").mkdir(0o700)
    # The working folder stays reachable, whatever lies above it.
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert "private/gait.npz: " in done.stdout
    assert "Permission denied" in done.stdout


def test_a_link_is_not_followed(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path)
    for use in ("file", "folder"):
        with pytest.raises(GaitFileError, match="a symbolic link, which is not"):
            USES[use](tmp_path / "link")
