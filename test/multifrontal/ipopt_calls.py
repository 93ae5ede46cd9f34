"""Calls the factorisation as IPOPT does."""

import ctypes
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


class _Control(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int) for name in ("f_arrays", "action", "nemin")),
        ("multiplier", ctypes.c_double),
        *((name, ctypes.c_int) for name in ("ordering", "print_level", "scaling")),
        ("small", ctypes.c_double),
        ("u", ctypes.c_double),
        *((name, ctypes.c_int) for name in ("unit_diagnostics", "unit_error", "unit_warning")),
        ("factor_min", ctypes.c_long),
        ("solve_blas3", ctypes.c_int),
        ("solve_min", ctypes.c_long),
        ("solve_mf", ctypes.c_int),
        ("consist_tol", ctypes.c_double),
        ("ispare", ctypes.c_int * 5),
        ("rspare", ctypes.c_double * 10),
    ]


_FIRST = ("flag", "flag68", "flag77", "matrix_dup", "matrix_rank", "matrix_outrange", "matrix_missing_diag")


_LAST = ("num_neg", "num_sup", "num_two", "ordering", "stat", "maxsupernode")


class _Info(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_int) for name in (*_FIRST, "maxdepth", "maxfront", "num_delay")),
        ("num_factor", ctypes.c_long),
        ("num_flops", ctypes.c_long),
        *(
            (name, ctypes.c_int)
            for name in ("num_neg", "num_sup", "num_two", "ordering", "stat", "maxsupernode")
        ),
        ("ispare", ctypes.c_int * 4),
        ("rspare", ctypes.c_double * 10),
    ]


@dataclass(frozen=True)
class Verdict:
    """What IPOPT is told of a factorisation."""

    flag: int
    rank: int
    negative: int
    delayed: int
    two_by_two: int
    entries: int


def _array(values, kind):
    return values.ctypes.data_as(ctypes.POINTER(kind))


class Factorization:
    """One pattern, factored for as many matrices as one likes."""

    def __init__(self, library, matrix, threshold=1e-8, threads=1):
        self._calls, self._control = ctypes.CDLL(str(library)), _Control()
        self._threads = threads
        self._calls.ma97_default_control_d(ctypes.byref(self._control))
        self._control.u = threshold
        lower = sp.csc_matrix(sp.tril(matrix))
        self.n = lower.shape[0]
        # As IPOPT's: indices from 1, and a diagonal with all of its entries.
        self._begin, self._index = (lower.indptr + 1).astype(np.int32), (lower.indices + 1).astype(np.int32)
        self._analysis, self._factors = ctypes.c_void_p(), ctypes.c_void_p()
        info = _Info()
        self._calls.ma97_analyse_d(
            0, self.n, *self._pattern(), None, ctypes.byref(self._analysis), ctypes.byref(self._control),
            ctypes.byref(info), None,
        )  # fmt: skip
        assert info.flag == 0

    def _pattern(self):
        return _array(self._begin, ctypes.c_int), _array(self._index, ctypes.c_int)

    def _state(self):
        return ctypes.byref(self._analysis), ctypes.byref(self._factors), ctypes.byref(self._control)

    def factor(self, matrix):
        values, info = np.ascontiguousarray(sp.csc_matrix(sp.tril(matrix)).data, dtype=float), _Info()
        assert values.size == self._index.size
        analysis, factors, control = self._state()
        self._calls.use_threads(self._threads)
        self._calls.ma97_factor_d(
            4, *self._pattern(), _array(values, ctypes.c_double), analysis, factors, control,
            ctypes.byref(info), None,
        )  # fmt: skip
        return Verdict(
            info.flag, info.matrix_rank, info.num_neg, info.num_delay, info.num_two, info.num_factor
        )

    def solve(self, right):
        columns, info = np.asfortranarray(right, dtype=float).copy(order="F"), _Info()
        count = columns.shape[1] if columns.ndim == 2 else 1
        self._calls.ma97_solve_d(
            0, count, _array(columns, ctypes.c_double), self.n, *self._state(), ctypes.byref(info)
        )
        assert info.flag == 0
        return columns

    def close(self):
        self._calls.ma97_finalise_d(ctypes.byref(self._analysis), ctypes.byref(self._factors))
        assert self._analysis.value is None
