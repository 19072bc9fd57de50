"""Arrays without their reference counts: each change of one is an atomic instruction, 5 ns, and there are forty arrays.

Whoever calls the kernels must keep the arrays alive.
"""

from typing import Any

from numba import extending, types
from numba.core import cgutils
from numba.core.typing import templates
from numba.np import arrayobj

untyped: Any = types
extend: Any = extending
arrays: Any = arrayobj
build: Any = cgutils
typing: Any = templates


def _stripped(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The instructions that take the counts out of an array, or out of all arrays in a tuple."""
    if isinstance(kind, untyped.Array):
        array = arrays.make_array(kind)(context, builder, value)
        array.meminfo = build.get_null_value(array.meminfo.type)
        return array._getvalue()
    if isinstance(kind, untyped.BaseTuple):
        for n, part in enumerate(kind.types):
            value = builder.insert_value(value, _stripped(context, builder, part, builder.extract_value(value, n)), n)
    return value


@extend.intrinsic
def bare(_: Any, kept: Any) -> Any:
    """The same array, or tuple of anything, without reference counts for the arrays in it."""
    return typing.signature(kept, kept), lambda context, builder, __, args: _stripped(context, builder, kept, args[0])
