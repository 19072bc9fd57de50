"""Everything an insertion works on, behind one pointer: handing forty arrays to a kernel costs 11 µs, a handle 0.6."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

from numba import types
from numba.experimental import structref

from solver._kernels.flags import entry_point


class Journey(NamedTuple):
    """What ``advance`` is given: problem, cut, base and orders, and the arrays at, report and force that it fills."""

    problem: Any
    cut: Any
    base: Any
    orders: Any
    at: Any
    report: Any
    force: Any


@structref.register
class JourneyType(types.StructRef):
    """Numba's type of a handle; it keeps the arrays alive."""


class Handle(structref.StructRefProxy):
    """A journey as compiled code sees it: its fields are read there alone."""


structref.define_proxy(Handle, JourneyType, list(Journey._fields))  # type: ignore[no-untyped-call]


@entry_point
def bound(problem: Any, cut: Any, base: Any, orders: Any, at: Any, report: Any, force: Any) -> Any:
    """The handle of a journey."""
    return Handle(problem, cut, base, orders, at, report, force)  # type: ignore[no-untyped-call]


def bind(journey: Journey) -> Journey:
    """The handle of a journey; without compiled code (NUMBA_DISABLE_JIT=1) the journey itself."""
    return journey if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0") else bound(*journey)
