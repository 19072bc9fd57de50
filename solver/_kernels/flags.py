"""The one place that says how kernels are compiled."""

from __future__ import annotations

from typing import Any, Protocol, TypeVar

import numba

F = TypeVar("F")


class Decorator(Protocol):
    """What leaves a function's type as it is."""

    def __call__(self, function: F, /) -> F:
        """Decorate."""
        ...


# Only fused multiply-add is allowed to reorder arithmetic: NaN and inf must keep their meaning, because
# the minimiser detects a broken state by them.
kernel = numba.njit(cache=True, fastmath={"contract"}, error_model="numpy")

# For what only other kernels call: without the way in from Python, which for the forty arrays of a wire is more
# machine code than most kernels.
_INNER: dict[str, Any] = {"no_cpython_wrapper": True}
inner: Decorator = numba.njit(cache=True, fastmath={"contract"}, error_model="numpy", **_INNER)

# For what is called per joint or per point: inlined, so that the tuples it takes never leave the registers.
inlined = numba.njit(cache=True, fastmath={"contract"}, error_model="numpy", forceinline=True)
