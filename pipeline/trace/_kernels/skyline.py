"""Symmetric positive definite systems that are nearly banded: Cholesky on the skyline, one thread.

The normal equations of a wire have a narrow band, a few full rows at the end (amplitudes, blur, offset) and, where
strands touch, some fill in between. LAPACK's dense factorisation takes a hundred times the work, and its threads
stall one another when several frames or other programs run.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point


@entry_point
def factorise(matrix: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], bool]:
    """Lower factor L (n, n) with L L^T = matrix, the first column of every row, and whether it went well."""
    n = matrix.shape[0]
    lower = np.zeros((n, n))
    first = np.zeros(n, np.int64)
    for i in range(n):
        start = 0
        while start < i and matrix[i, start] == 0.0:
            start += 1
        first[i] = start
        for j in range(start, i + 1):
            total = matrix[i, j]
            for k in range(max(start, first[j]), j):
                total -= lower[i, k] * lower[j, k]
            if j < i:
                lower[i, j] = total / lower[j, j]
            elif total > 0.0:
                lower[i, i] = np.sqrt(total)
            else:
                return lower, first, False
    return lower, first, True


@entry_point
def substitute(lower: NDArray[Any], first: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """x (n, m) with L L^T x = right (n, m), all columns at a time: they are neighbours in memory."""
    n, m = right.shape
    x = right.copy()
    for i in range(n):
        for k in range(first[i], i):
            for c in range(m):
                x[i, c] -= lower[i, k] * x[k, c]
        for c in range(m):
            x[i, c] /= lower[i, i]
    for i in range(n - 1, -1, -1):
        for c in range(m):
            x[i, c] /= lower[i, i]
        for k in range(first[i], i):
            for c in range(m):
                x[k, c] -= lower[i, k] * x[i, c]
    return x
