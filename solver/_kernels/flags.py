"""How compiled functions are compiled: eight decorators.

Machine code that Python can call is made for entry points alone. Unpacking a kernel's forty arrays is code too: made
for every kernel, it would take as long again as compiling the kernels themselves.
"""

from functools import partial
from typing import Any

from solver._compile import on_disk, part_of_callers

# Only fused multiply-add may change how sums are rounded: NaN and inf must keep their meaning, because the minimiser
# recognises a broken state by them.
FAST: dict[str, Any] = {"fastmath": {"contract"}, "error_model": "numpy"}
_internal = partial(part_of_callers, _nrt=False, **FAST)

# Called from Python; kept on disk.
entry_point = on_disk(**FAST)
# The same for long calls: other threads of Python run meanwhile. The second counts no references: it makes no arrays.
released = on_disk(nogil=True, **FAST)
uncounted = on_disk(nogil=True, _nrt=False, **FAST)
# Called by other kernels. Arrays are borrowed, not counted: the caller of the entry point keeps them alive. A count is
# a call in the middle of a recursion, around which everything in registers goes through memory.
kernel = _internal()
# The same for kernels that make arrays, which needs numba's runtime of reference counts.
owner = _internal(_nrt=True)
# The same, kept on disk as well: another process can compile it meanwhile.
cached = _internal(how=on_disk)
# Called per joint or per point: inlined by LLVM, so that the tuples it takes never leave the registers.
inlined = _internal(forceinline=True)
# A part of one other kernel: merged into it before anything is compiled, or it would be compiled twice.
merged = _internal(inline="always")
