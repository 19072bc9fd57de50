"""The one place that says how kernels are compiled.

Machine code to be called from Python is made for the doors alone. Handing a kernel its forty arrays is code too,
and making it for every kernel would take as long again as compiling them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

# Only fused multiply-add is allowed to reorder arithmetic: NaN and inf must keep their meaning, because
# the minimiser detects a broken state by them.
FAST: dict[str, Any] = {"fastmath": {"contract"}, "error_model": "numpy"}
LEAN = dict(FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def door(function: F) -> F:
    """What Python calls; kept on disk."""
    return cast(F, numba.njit(cache=True, **FAST)(function))


def _within(**how: Any) -> Callable[[F], F]:
    """Compiled into the doors that need it, with no way in from Python."""
    options = dict(LEAN, **how)

    def decorate(function: F) -> F:
        within: Any = numba.njit(**options)(function)

        def add(compiled: Any) -> None:
            within.overloads[tuple(compiled.signature.args)] = compiled

        def refuse(*_: object, **__: object) -> NoReturn:
            message = f"{function.__name__} is for compiled code: call a door, or write one in a test"
            raise TypeError(message)

        if within is not function:
            # numba would list it for Python all the same, and a call would end the process
            within.add_overload, within._compile_for_args = add, refuse
        return cast(F, within)

    return decorate


# For what other kernels call. Mind that a literal argument is a type of its own to numba, and compiles the callee
# again: pass 0 * k, or a number that is computed.
kernel = _within()
# For what another process can compile meanwhile: kept on disk as well.
kept = _within(cache=True)
# For what is called per joint or per point: the tuples it takes never leave the registers.
inlined = _within(forceinline=True)
# For a part of one other kernel: merged into it before anything is compiled, or it would be compiled twice.
once = _within(inline="always")
