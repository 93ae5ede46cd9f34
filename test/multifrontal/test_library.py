"""The factorisation's library is compiled once, and IPOPT does without it where it must."""

import logging
import shutil
import subprocess
import sys

import numpy as np
import pytest
from solve.small_programs import START, rosenbrock

from walk_optimizer.compiler import COMPILER_VARIABLE, cache_folder
from walk_optimizer.multifrontal.library import factorization_library
from walk_optimizer.solve import ipopt
from walk_optimizer.solve.ipopt import IpoptOptions
from walk_optimizer.solve.status import Status

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
# Without the answer in memory: as a new process would do it.
library_anew = factorization_library.__wrapped__
# IPOPT's other way to the same solution.
MUMPS = (("linear_solver", "mumps"),)


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(COMPILER_VARIABLE, raising=False)


@needs_compiler
def test_it_is_compiled_once_and_made_again_when_damaged(empty_cache):
    library = library_anew()
    made = library.stat().st_mtime_ns
    assert library_anew() == library
    assert library.stat().st_mtime_ns == made
    assert [path.suffix for path in cache_folder().iterdir()] == [".so"], "no scratch is left behind"
    damaged = library.with_suffix(".damaged")
    damaged.write_bytes(library.read_bytes()[:100])
    damaged.replace(library)
    # In a new process: this one has the library loaded.
    code = "from walk_optimizer.multifrontal.library import factorization_library as f; print(f())"
    again = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert again.stdout.strip() == str(library)
    assert "is damaged and is compiled again" in again.stderr
    assert library.stat().st_size > 1000


@pytest.mark.parametrize("compiler", ["", "no-such-compiler-anywhere", "false"])
def test_without_a_compiler_mumps_does_the_work(empty_cache, monkeypatch, caplog, compiler):
    monkeypatch.setenv(COMPILER_VARIABLE, compiler)
    with caplog.at_level(logging.WARNING):
        assert library_anew() is None
    assert ("MUMPS is used" in caplog.text) == bool(compiler)
    monkeypatch.setattr(ipopt, "factorization_library", lambda: None)
    solution = ipopt.solve(rosenbrock(), START, IpoptOptions())
    assert solution.status is Status.SOLVED


@needs_compiler
def test_ipopt_takes_the_same_steps_with_it_as_with_mumps():
    ours = ipopt.solve(rosenbrock(), START, IpoptOptions())
    theirs = ipopt.solve(rosenbrock(), START, IpoptOptions(further=MUMPS))
    assert ours.status is theirs.status is Status.SOLVED
    assert ours.iterations == theirs.iterations
    np.testing.assert_allclose(ours.x, theirs.x, rtol=1e-9)


@needs_compiler
def test_ipopt_says_that_it_runs_with_the_library(capfd):
    ipopt.solve(rosenbrock(), START, IpoptOptions(further=(("print_level", 5),)))
    assert "linear solver ma97" in capfd.readouterr().out
