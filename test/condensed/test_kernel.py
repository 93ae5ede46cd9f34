"""The memory that Python and C share is laid out alike, and what can't be loaded is done without."""

import ctypes
import re
from pathlib import Path

import pytest
from condensed.conftest import needs_compiler

from walk_optimizer.condensed import functions, kernel
from walk_optimizer.condensed.kernel import Step

HEADER = (Path(kernel.__file__).parent / "condensed.h").read_text()


@needs_compiler
def test_the_structure_is_as_long_here_as_there():
    size = ctypes.c_int.in_dll(kernel.kernel().code, "step_bytes").value
    assert ctypes.sizeof(Step) == size


def test_the_fields_have_the_headers_order():
    declared = HEADER[HEADER.index("typedef struct {\n    int intervals") : HEADER.index("} Step;")]
    code = re.sub(r"/\*.*?\*/", "", declared, flags=re.DOTALL)
    names = [
        re.sub(r"\[.*?\]|\*", "", one).split()[-1]
        for statement in code.split("{", 1)[1].split(";")
        for one in re.sub(r"\[[^]]*\]", "", statement).split(",")
        if one.strip()
    ]
    assert names == [name for name, *_ in Step._fields_]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("LIMITS", kernel.LIMITS),
        ("GAP_LIMIT", kernel.GAP_LIMIT),
        ("BEHIND", kernel.ENDS),
        ("ROWS", functions.POINT_ROWS),
        ("ANGLES", functions.ANGLES),
        ("MOMENTA", functions.MOMENTA),
        ("POINT", 16),
        ("WIDTH", 22),
        ("PADDED", 24),
    ],
)
def test_sizes_are_the_headers(name, value):
    assert int(re.search(rf"\b{name} = (\d+)", HEADER)[1]) == value


@needs_compiler
@pytest.mark.parametrize("name", ["momentum", "point", "curvature"])
def test_generated_functions_need_no_work_space(name):
    """C calls them with none."""
    sizes = [ctypes.c_longlong() for _ in range(4)]
    generated = kernel.kernel().generated
    assert getattr(generated, f"condensed_{name}_work")(*map(ctypes.byref, sizes)) == 0
    arguments, results, integers, numbers = (size.value for size in sizes)
    assert (integers, numbers) == (0, 0)
    made = {one.name(): one for one in functions.node_functions()}[f"condensed_{name}"]
    assert (arguments, results) == (made.n_in(), made.n_out())


@pytest.mark.parametrize("lost", ["native_library", "machine_code"])
def test_without_one_of_the_libraries_there_is_no_kernel(monkeypatch, lost):
    monkeypatch.setattr(kernel, lost, lambda *_: None)
    assert kernel.kernel.__wrapped__() is None
