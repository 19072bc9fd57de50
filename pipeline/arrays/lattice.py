"""What kernels of the imaging stages share: how they are compiled, indices of a lattice, lists that grow, sparse boxes.

No fast-math: a result does not depend on how the work is split into functions. Kernels take arrays out of a named tuple
before a loop: inside the loop, counting references to its fields in every round makes it five times as slow.
"""

import contextlib
import mmap
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from solver._compile import on_disk, part_of_callers

entry_point = on_disk(nogil=True, no_cfunc_wrapper=True)
"""Compiles what Python calls: kept on disk until a source behind it changes; others may run beside it (``cores``)."""
kernel = part_of_callers()
"""Compiles what other kernels call: into the entry points."""


@kernel
def clamped(i: int, n: int) -> int:
    """The index of the border voxel for indices outside."""
    return 0 if i < 0 else (n - 1 if i >= n else i)


@kernel
def unravelled(flat: int, shape: tuple[int, int, int]) -> tuple[int, int, int]:
    """Indices of a flat C-order index."""
    rest = flat // shape[2]
    return rest // shape[1], rest % shape[1], flat % shape[2]


@kernel
def nodes_near(low: float, high: float, reach: float, h: float, n: int) -> tuple[int, int]:
    """First and stop index of the nodes (of ``n``, ``h`` mm apart) within ``reach`` mm of the interval low to high."""
    return max(0, int(np.ceil((low - reach) / h))), min(n, int(np.floor((high + reach) / h)) + 1)


@kernel
def grown(array: NDArray[Any]) -> NDArray[Any]:
    """A copy twice as long along its first axis; the second half is uninitialised."""
    return np.concatenate((array, np.empty_like(array)))


@kernel
def steps_around(shape: tuple[int, int, int], reach: int) -> NDArray[Any]:
    """Steps of a flat C-order index to all voxels up to ``reach`` away along each axis, ascending; 0 is one of them."""
    side = 2 * reach + 1
    out = np.empty(side**3, np.int64)
    for n in range(side**3):
        a, b, c = unravelled(n, (side, side, side))
        out[n] = ((a - reach) * shape[1] + b - reach) * shape[2] + c - reach
    return out


def sparse_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Zeros in 4 KiB pages of the array's own, given back to the system as soon as the array is dropped.

    ``np.zeros`` asks the kernel for pages of 2 MiB: a vessel that touches one voxel in fifty then holds the whole box
    (20 MiB for 600 scattered voxels of a box of 28 MiB, against 2 here), and clearing them takes time as well.
    """
    kind = np.dtype(dtype)
    size = int(np.prod(shape))
    if size * kind.itemsize < mmap.PAGESIZE:
        return np.zeros(shape, kind)
    pages = mmap.mmap(-1, size * kind.itemsize, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with contextlib.suppress(OSError):  # a system without pages of 2 MiB knows no such advice
        pages.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(pages, kind, size).reshape(shape)
