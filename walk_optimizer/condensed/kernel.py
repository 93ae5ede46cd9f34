"""The C code of the condensed step, and the memory that it shares with NumPy."""

import ctypes
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.compiler import native_library
from walk_optimizer.condensed.functions import node_functions
from walk_optimizer.transcription.compilation import machine_code

FloatArray = NDArray[np.float64]

_SLOWER = "IPOPT, which is slower,"
_NUMBERS = ctypes.POINTER(ctypes.c_double)
_GENERATED = ("momentum", "point", "curvature")

# Inequalities of a node, and which of them is the gap of foot 2.
LIMITS, GAP_LIMIT = 13, 8
# The ends of a step: the state at its start (8), K, q_eq, and the multipliers of the state at its end (8).
ENDS = 18


class Step(ctypes.Structure):
    """`Step` of condensed.h."""

    _fields_ = (
        ("intervals", ctypes.c_int),
        ("threads", ctypes.c_int),
        *((name, ctypes.c_void_p) for name in _GENERATED),
        ("walker", _NUMBERS),
        ("lengths", _NUMBERS),
        ("differentiation", ctypes.c_double * 12),
        ("butcher", ctypes.c_double * 9),
        ("quadrature", ctypes.c_double * 3),
        ("lower", ctypes.c_double * 4),
        ("upper", ctypes.c_double * 4),
        ("cone", ctypes.c_double * 6),
        ("cone_least", ctypes.c_double * 3),
        ("weight", ctypes.c_double),
        ("mass", ctypes.c_double),
        ("penalty", ctypes.c_double),
        ("curvature_share", ctypes.c_double),
        *((name, _NUMBERS) for name in ("start", "omega", "momenta", "torques", "passive", "springs")),
        *((name, _NUMBERS) for name in ("slacks", "multipliers")),
        *((name, _NUMBERS) for name in ("y", "true_momenta", "momentum_jacobian", "rows", "row_jacobian")),
        *((name, _NUMBERS) for name in ("limits", "rate_defect", "momentum_multipliers", "hessian")),
        *((name, _NUMBERS) for name in ("start_hessian", "condensed", "passive_rows", "defect_gradient")),
        ("eliminations", ctypes.c_void_p),
        *((name, _NUMBERS) for name in ("step_omega", "step_momenta", "step_torques", "new_passive")),
        *((name, _NUMBERS) for name in ("step_slacks", "step_multipliers")),
    )


class Kernel:
    """The compiled code.

    Attributes:
        code: Its functions, each of which takes a `Step` first.
        generated: The functions that CasADi made.
        elimination_numbers: Numbers of 8 bytes that the elimination of an interval takes.
    """

    def __init__(self, library: Path, generated: Path) -> None:
        """Load both libraries.

        Raises:
            OSError: one of them can't be loaded.
        """
        self.code = ctypes.CDLL(str(library))
        self.generated = ctypes.CDLL(str(generated))
        self.code.condense.argtypes = [ctypes.POINTER(Step), ctypes.c_double]
        size = ctypes.c_int.in_dll(self.code, "elimination_bytes").value
        self.elimination_numbers = -(-size // 8)

    def connect(self, step: Step) -> None:
        """Set the functions that CasADi made in a step."""
        for name in _GENERATED:
            function = getattr(self.generated, f"condensed_{name}")
            setattr(step, name, ctypes.cast(function, ctypes.c_void_p))


@cache
def kernel() -> Kernel | None:
    """Return the compiled code; None without a C compiler."""
    library = native_library(Path(__file__).parent, _SLOWER)
    generated = None if library is None else machine_code(node_functions)
    return None if library is None or generated is None else Kernel(library, generated)


def address(array: FloatArray) -> "ctypes._Pointer[ctypes.c_double]":
    """Return where a contiguous array begins."""
    return array.ctypes.data_as(_NUMBERS)
