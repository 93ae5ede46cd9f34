"""Fixtures of the command line's tests."""

import pytest
from cli.console import walk_optimizer


@pytest.fixture(scope="session")
def compiled():
    """Have the model compiled into the real cache, once for all tests that solve."""
    done = walk_optimizer("solve", "--speed", "0.28", "--points", "20", home=None, timeout=300)
    assert done.returncode == 0, done.stderr
