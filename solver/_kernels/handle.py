"""All that an insertion works on, behind one pointer: handing forty arrays to a kernel costs 11 µs, a handle 0.6."""

from typing import Any, NamedTuple

from numba import types
from numba.experimental import structref

from solver._kernels.bare import bare
from solver._kernels.flags import entry_point


class Contents(NamedTuple):
    """What is behind a handle.

    problem, table, introducer, limits : see ``data``.     place, report : (1,), (2,) records of ``records.PLACE`` and
    ``records.REPORT``; the second report is that of the last good state.     force : (k + 1, 3) contact forces, N.
    """

    problem: Any
    table: Any
    introducer: Any
    limits: Any
    place: Any
    report: Any
    force: Any


@structref.register
class HandleType(types.StructRef):
    """Numba's type of a handle."""


class Handle(structref.StructRefProxy):
    """The contents as compiled code sees them: their fields are read there alone."""


structref.define_proxy(Handle, HandleType, list(Contents._fields))  # type: ignore[no-untyped-call]


@entry_point
def bound(problem: Any, table: Any, introducer: Any, limits: Any, place: Any, report: Any, force: Any) -> Any:
    """The handle of the contents, which must be kept beside it."""
    return Handle(  # type: ignore[no-untyped-call]
        bare(problem), bare(table), bare(introducer), limits, bare(place), bare(report), bare(force)
    )


def handle_of(contents: Contents) -> Any:
    """The handle of the contents; where nothing is compiled (NUMBA_DISABLE_JIT) the contents themselves."""
    return bound(*contents) if hasattr(bound, "py_func") else contents
