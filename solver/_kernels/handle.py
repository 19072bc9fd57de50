"""All that an insertion works on, behind one pointer: handing forty arrays to a kernel costs 11 µs, a handle 0.6."""

from typing import Any, NamedTuple

from numba import extending, types
from numba.core import cgutils
from numba.experimental import structref

from solver._kernels.bare import bare
from solver._kernels.data import Problem
from solver._kernels.flags import entry_point

extend: Any = extending
build: Any = cgutils


class Contents(NamedTuple):
    """What is behind a handle.

    problem, table, introducer, limits : see ``data``.     place, report : (1,), (3,) records of ``records.PLACE`` and
    ``records.REPORT``; report 1 is that of the last good state, 2 a copy that ``forks`` keeps.
    force : (k + 1, 3) contact forces, N.
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


@structref.register
class ProblemType(types.StructRef):
    """The type of the problem behind a handle: handed on by value, it would be 370 words for every call."""


def reader(name: str) -> Any:
    """A code generator for reading a field, without reference counts: the arrays in it are bare.

    Numba's own counts each array: for forty that is more code than the solver has, and takes as long to compile.
    """

    def read(context: Any, builder: Any, kind: Any, handle: Any) -> Any:
        counted = build.create_struct_proxy(kind)(context, builder, value=handle).meminfo
        # numba's record of what it counts: the count, the destructor, its argument, the data
        record = builder.bitcast(counted, counted.type.as_pointer())
        contents = kind.get_data_type()
        stored = context.data_model_manager[contents].get_value_type().as_pointer()
        data = builder.bitcast(builder.load(builder.gep(record, [build.int32_t(3)])), stored)
        value = getattr(build.create_struct_proxy(contents)(context, builder, ref=data), name)
        if context.enable_nrt and isinstance(kind.field_dict[name], ProblemType):
            # the code around this counts references, and will release this one
            context.nrt.incref(builder, kind.field_dict[name], value)
        return value

    return read


for field in Contents._fields:
    extend.lower_getattr(HandleType, field)(reader(field))
for field in Problem._fields:
    extend.lower_getattr(ProblemType, field)(reader(field))


class Handle(structref.StructRefProxy):
    """The contents as compiled code sees them: their fields are read there alone."""


class ProblemHandle(structref.StructRefProxy):
    """A problem as compiled code sees it."""


structref.define_proxy(Handle, HandleType, list(Contents._fields))  # type: ignore[no-untyped-call]
structref.define_proxy(ProblemHandle, ProblemType, list(Problem._fields))  # type: ignore[no-untyped-call]


@entry_point
def bound(problem: Any, table: Any, introducer: Any, limits: Any, place: Any, report: Any, force: Any) -> Any:
    """The handle of the contents; it does not keep them alive, which the caller must."""
    p = bare(problem)
    inner = ProblemHandle(  # type: ignore[no-untyped-call]
        p.field,
        p.stiffness,
        p.pressed,
        p.friction,
        p.shaft,
        p.chain,
        p.state,
        p.scratch,
        p.skips,
        p.twisting,
        p.straight,
    )
    return Handle(  # type: ignore[no-untyped-call]
        inner, bare(table), bare(introducer), limits, bare(place), bare(report), bare(force)
    )


def handle_of(contents: Contents) -> Any:
    """The handle of the contents; where nothing is compiled (NUMBA_DISABLE_JIT) the contents themselves."""
    return bound(*contents) if hasattr(bound, "py_func") else contents
