"""How compiled functions are compiled: eight decorators.

Machine code that Python can call is made for entry points alone. Unpacking a kernel's forty arrays is code too: made
for every kernel, it would take as long again as compiling the kernels themselves.
"""

from collections.abc import Callable
from typing import Any, NoReturn, TypeVar, cast

import numba
from numba import types

from solver._compile import on_disk

F = TypeVar("F", bound=Callable[..., Any])
untyped: Any = types

# Only fused multiply-add may change how sums are rounded: NaN and inf must keep their meaning, because the minimiser
# recognises a broken state by them.
FAST: dict[str, Any] = {"fastmath": {"contract"}, "error_model": "numpy"}


def _internal(compiler: Callable[..., Any] = numba.njit, **how: Any) -> Callable[[F], F]:
    """Return a decorator for functions that only compiled code calls."""
    options = dict(FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True, **{"_nrt": False, **how})

    def decorate(function: F) -> F:
        compiled: Any = compiler(**options)(function)
        if compiled is function:  # NUMBA_DISABLE_JIT is set
            return function
        template = compiled.get_call_template

        def add(overload: Any) -> None:
            compiled.overloads[tuple(overload.signature.args)] = overload

        def refuse(*_: object, **__: object) -> NoReturn:
            message = f"{function.__name__} is for compiled code: call an entry point, or write one in a test"
            raise TypeError(message)

        def unliteral(args: tuple[Any, ...], kws: Any) -> Any:
            return template(tuple(untyped.unliteral(arg) for arg in args), kws)

        # numba would list the overload for Python all the same, and a call from there would end the process
        compiled.add_overload, compiled._compile_for_args = add, refuse
        # a literal argument is a type of its own to numba, and would compile the function once more
        compiled.get_call_template = unliteral
        return cast(F, compiled)

    return decorate


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
cached = _internal(on_disk)
# Called per joint or per point: inlined by LLVM, so that the tuples it takes never leave the registers.
inlined = _internal(forceinline=True)
# A part of one other kernel: merged into it before anything is compiled, or it would be compiled twice.
merged = _internal(inline="always")
