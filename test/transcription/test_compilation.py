"""Compiled code gives what the interpreter gives, is kept, and is done without when it must be."""

import logging
import shutil

import casadi as ca
import numpy as np
import pytest

from walk_optimizer.compiler import COMPILER_VARIABLE, cache_folder
from walk_optimizer.transcription import compilation
from walk_optimizer.transcription.boundary import periodic_functions
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.euler_stage import euler_functions

COMPILER = shutil.which("cc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")
# Without the cache in memory: as a new process would do it.
compiled_anew = compiled.__wrapped__


def tiny():
    x = ca.SX.sym("x")
    return [ca.Function("tiny_square", [x], [x**2]), ca.Function("tiny_sine", [x], [ca.sin(x)])]


def assert_works(functions):
    assert float(functions["tiny_square"](3.0)) == 9.0
    assert float(functions["tiny_sine"](0.5)) == pytest.approx(np.sin(0.5), rel=1e-15)


def is_compiled(functions):
    return all(function.class_name().endswith("External") for function in functions.values())


def libraries():
    return sorted(cache_folder().glob("*.so"))


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(COMPILER_VARIABLE, raising=False)


@pytest.fixture
def compiler(tmp_path, monkeypatch):
    """Makes a shell script the compiler, which also counts its runs."""

    def install(script):
        path, runs = tmp_path / "compiler", tmp_path / "runs"
        path.write_text(f"#!/bin/sh\necho run >> {runs}\n{script}\n")
        path.chmod(0o755)
        monkeypatch.setenv(COMPILER_VARIABLE, str(path))
        return lambda: len(runs.read_text().splitlines()) if runs.exists() else 0

    return install


@needs_compiler
@pytest.mark.parametrize("build", [euler_functions, periodic_functions])
def test_compiled_functions_equal_the_interpreters(build, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME")
    machine_code, generator = compiled(build), np.random.default_rng(4)
    monkeypatch.setenv(COMPILER_VARIABLE, "")
    interpreted = compiled_anew(build)
    assert set(machine_code) == set(interpreted)
    for name, function in interpreted.items():
        for _ in range(5):
            inputs = [generator.uniform(0.5, 1.5, function.size1_in(i)) for i in range(function.n_in())]
            for ours, theirs in zip(machine_code[name].call(inputs), function.call(inputs), strict=True):
                np.testing.assert_allclose(np.asarray(ours), np.asarray(theirs), rtol=1e-12, atol=1e-12)


@needs_compiler
def test_what_was_compiled_is_used_the_second_time(compiler):
    runs = compiler(f'exec {COMPILER} "$@"')
    first = compiled_anew(tiny)
    assert is_compiled(first)
    assert_works(first)
    second = compiled_anew(tiny)
    assert is_compiled(second)
    assert_works(second)
    assert runs() == 1
    assert sorted(path.suffix for path in cache_folder().iterdir()) == [".json", ".so"], "no scratch is left"


def power(exponent):
    builds.append(exponent)
    x = ca.SX.sym("x")
    return [ca.Function("power", [x], [x**exponent])]


builds = []


@needs_compiler
def test_a_second_process_need_not_build_the_expressions():
    builds.clear()
    for _ in range(2):
        assert float(compiled_anew(power, 2)["power"](3.0)) == 9.0
        assert float(compiled_anew(power, 3)["power"](3.0)) == 27.0
    assert builds == [2, 3]


@needs_compiler
@pytest.mark.parametrize("damage", ["{", "[]", '{"library": "none.so", "functions": ["power"]}', "\0"])
def test_a_damaged_note_is_written_anew(damage):
    compiled_anew(power, 2)
    (note,) = cache_folder().glob("*.json")
    whole = note.read_text()
    note.write_text(damage)
    functions = compiled_anew(power, 2)
    assert is_compiled(functions)
    assert float(functions["power"](3.0)) == 9.0
    assert note.read_text() == whole
    assert len(libraries()) == 1


@needs_compiler
def test_machine_code_is_the_library_only_where_that_is_used(compiler, monkeypatch):
    monkeypatch.setattr(compilation, "compiled", compiled_anew)
    compiler(f'exec {COMPILER} "$@"')
    library = compilation.machine_code(tiny)
    assert [library] == libraries()
    # A library that is damaged and can't be compiled again: the note still names it.
    library.unlink()
    compiler("exit 1")
    assert compilation.machine_code(tiny) is None
    monkeypatch.setenv(COMPILER_VARIABLE, "")
    assert compilation.machine_code(tiny) is None


@needs_compiler
def test_other_sources_are_built_anew(tmp_path, monkeypatch):
    builds.clear()
    compiled_anew(power, 2)
    source = tmp_path / "dynamics.py"
    source.write_text("before")
    monkeypatch.setattr(compilation, "_SOURCES", (tmp_path,))
    compiled_anew(power, 2)
    source.write_text("after")
    compiled_anew(power, 2)
    compiled_anew(power, 2)
    assert builds == [2, 2, 2]
    assert len(libraries()) == 1, "what they compute did not change"


@needs_compiler
def test_other_code_is_another_library():
    compiled_anew(tiny)
    x = ca.SX.sym("x")
    cube = compiled_anew(lambda: [ca.Function("tiny_square", [x], [x**3])])
    assert float(cube["tiny_square"](3.0)) == 27.0
    assert len(libraries()) == 2


@pytest.mark.parametrize("name", ["", "no-such-compiler-anywhere"])
def test_the_interpreter_is_used_on_request_and_without_a_compiler(monkeypatch, caplog, name):
    monkeypatch.setenv(COMPILER_VARIABLE, name)
    functions = compiled_anew(tiny)
    assert not is_compiled(functions)
    assert_works(functions)
    assert libraries() == []
    # A compiler that was named and is missing is a mistake; none named is a wish.
    assert (f"{COMPILER_VARIABLE} is {name!r}, which is no program" in caplog.text) == bool(name)


@pytest.mark.parametrize("script", ["echo broken >&2; exit 1", "exit 0"])
def test_a_compiler_that_makes_nothing_falls_back_with_a_warning(script, compiler, caplog):
    runs = compiler(script)
    with caplog.at_level(logging.WARNING):
        functions = compiled_anew(tiny)
    assert runs() == 1
    assert not is_compiled(functions)
    assert_works(functions)
    assert "C code can't be compiled" in caplog.text
    assert "slower interpreter is used" in caplog.text
    assert libraries() == []


@needs_compiler
def test_a_cache_that_can_not_be_written_falls_back_with_a_warning(tmp_path, monkeypatch, caplog):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    functions = compiled_anew(tiny)
    assert not is_compiled(functions)
    assert_works(functions)
    assert "C code can't be compiled" in caplog.text


@needs_compiler
def test_a_damaged_library_is_made_again():
    compiled_anew(tiny)
    for library in libraries():
        # A new file: the old one stays mapped in this process.
        damaged = library.with_suffix(".damaged")
        damaged.write_bytes(library.read_bytes()[:100])
        damaged.replace(library)
    again = compiled_anew(tiny)
    assert is_compiled(again)
    assert_works(again)


@needs_compiler
def test_a_compiler_of_another_machine_falls_back_with_a_warning(compiler, caplog):
    runs = compiler('while [ "$1" != -o ]; do shift; done; echo "no library" > "$2"')
    functions = compiled_anew(tiny)
    assert runs() == 1
    assert not is_compiled(functions)
    assert_works(functions)
    assert "slower interpreter is used" in caplog.text


def test_the_cache_is_below_the_users_cache_by_default(monkeypatch, tmp_path):
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "walk_optimizer"
