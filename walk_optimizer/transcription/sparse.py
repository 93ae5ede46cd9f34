"""Sparse matrices of CasADi, gathered from the values of many small ones."""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]


def gather(rows: IntArray, columns: IntArray, values: ca.MX, shape: tuple[int, int]) -> ca.MX:
    """Return the sparse matrix with the values in their places; those of one place are added."""
    places, which = np.unique(columns * shape[0] + rows, return_inverse=True)
    pattern = ca.Sparsity.triplet(*shape, (places % shape[0]).tolist(), (places // shape[0]).tolist())
    if places.size == which.size:
        return ca.MX(pattern, values[np.argsort(which).tolist()])
    adder = ca.Sparsity.triplet(places.size, which.size, which.tolist(), list(range(which.size)))
    return ca.MX(pattern, ca.mtimes(ca.DM(adder, np.ones(which.size)), values))


def picked(vector: ca.MX, indices: IntArray) -> ca.MX:
    """Return the entries of a vector in the shape of an array of indices."""
    return ca.reshape(vector[indices.ravel(order="F").tolist()], *indices.shape)


def pattern(function: ca.Function) -> tuple[IntArray, IntArray]:
    """Return rows and columns of the nonzeros of a function's first output."""
    rows, columns = function.sparsity_out(0).get_triplet()
    return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)
