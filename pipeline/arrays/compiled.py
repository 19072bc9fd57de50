"""How the kernels of the imaging stages are compiled.

No fast-math: a result does not depend on how the work is split into functions. Inside loops, arrays are taken out of a
named tuple beforehand: counting references to its fields once a round makes a loop five times as long.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from solver._compile import on_disk

HOW: dict[str, Any] = {"no_cfunc_wrapper": True}
door = on_disk(**HOW)
"""What Python calls: kept on disk until a source behind it changes."""
kernel = njit(**HOW)
"""What other kernels call: compiled into the doors."""
