"""The one place that says how kernels are compiled."""

from __future__ import annotations

import numba

# Only fused multiply-add is allowed to reorder arithmetic: NaN and inf must keep their meaning, because
# the minimiser detects a broken state by them.
kernel = numba.njit(cache=True, fastmath={"contract"}, error_model="numpy")

# For what is called per joint or per point: inlined, so that the tuples it takes never leave the registers.
inlined = numba.njit(cache=True, fastmath={"contract"}, error_model="numpy", forceinline=True)
