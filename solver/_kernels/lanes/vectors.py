"""Eight numbers that one instruction works on: the compiler's vectors as a type, so that a kernel may be eight wires'.

A recursion along a wire waits for the result before, not for the processor, which does eight multiplications in the
time of one. A kernel whose numbers are ``Lanes`` therefore does eight wires in lock-step in the time of one, and its
source is that of one wire: sums and products, ``math.sqrt``, ``sin``, ``cos`` and ``floor``. Where one wire would take
a branch, lanes may disagree: ``select`` takes a value for each, ``anywhere`` asks whether any needs the branch at all.
Both are plain Python for plain numbers. A vector of four, a quad, is a row of the wall's coefficients.
"""

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils, typeconv
from numba.core.typing import templates
from numba.np import arrayobj

from solver._kernels.flags import inlined

untyped: Any = types
extend: Any = extending
typing: Any = templates
arrays: Any = arrayobj
build: Any = cgutils
conversions: Any = typeconv
WIDTH = 8
"""Lanes: what AVX-512 holds. Where the processor's vectors are shorter the compiler takes two or four for each."""
BITS = ir.VectorType(ir.IntType(1), WIDTH)
CONTRACT = ("contract",)  # as in ``flags.FAST``


class VectorType(untyped.Type):  # type: ignore[misc]
    """Numba's type of a number in each of some lanes."""

    def __init__(self, width: int) -> None:
        self.width, self.value = width, ir.VectorType(ir.DoubleType(), width)
        super().__init__(f"Vector({width})")

    def can_convert_from(self, _: Any, other: Any) -> Any:
        """A plain number is the same one in each lane."""
        return conversions.Conversion.safe if isinstance(other, untyped.Number) else None


class MaskType(untyped.Type):  # type: ignore[misc]
    """Numba's type of a yes or no in each lane."""

    def __init__(self) -> None:
        super().__init__("Mask")


LANES, QUAD, MASK = VectorType(WIDTH), VectorType(4), MaskType()


@extend.register_model(VectorType)
class VectorModel(extend.models.PrimitiveModel):  # type: ignore[misc]
    """A vector register."""

    def __init__(self, manager: Any, kind: VectorType) -> None:
        super().__init__(manager, kind, kind.value)


@extend.register_model(MaskType)
class MaskModel(extend.models.PrimitiveModel):  # type: ignore[misc]
    """A mask register."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, BITS)


def _spread(builder: Any, number: Any, kind: VectorType) -> Any:
    """The instructions that put a number into all lanes."""
    nothing, zero = ir.Constant(kind.value, ir.Undefined), ir.Constant(ir.IntType(32), 0)
    first = builder.insert_element(nothing, number, zero)
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), kind.width), [0] * kind.width)
    return builder.shuffle_vector(first, nothing, everywhere)


@extend.lower_cast(untyped.Number, VectorType)
def _from_number(context: Any, builder: Any, kind: Any, to: Any, value: Any) -> Any:
    return _spread(builder, context.cast(builder, value, kind, untyped.float64), to)


def _operator(symbol: Any, takes: Any, gives: Any, lower: Callable[..., Any]) -> None:
    """Teach the compiler an operator of lanes or masks; numbers beside them are spread."""

    class Template(typing.AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: tuple[Any, ...], _: Any) -> Any:
            plain = untyped.Number if takes is not MASK else ()
            fits = takes in args and all(a == takes or isinstance(a, plain) for a in args)
            return typing.signature(gives, *[takes] * len(args)) if fits else None

    typing.infer_global(symbol)(Template)
    for count in (1, 2):
        extend.lower_builtin(symbol, *[takes] * count)(lambda _, builder, __, args: lower(builder, *args))


_SUMS = ((operator.add, "fadd"), (operator.iadd, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"))
for _symbol, _method in _SUMS:
    for _kind in (LANES, QUAD):
        _operator(_symbol, _kind, _kind, lambda b, x, y, m=_method: getattr(b, m)(x, y, flags=CONTRACT))
_operator(operator.truediv, LANES, LANES, lambda b, x, y: b.fdiv(x, y))
_operator(operator.neg, LANES, LANES, lambda b, x: b.fneg(x))
for _symbol, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    _operator(_symbol, LANES, MASK, lambda b, x, y, s=_sign: b.fcmp_ordered(s, x, y))
_operator(operator.eq, LANES, MASK, lambda b, x, y: b.fcmp_ordered("==", x, y))
_operator(operator.ne, LANES, MASK, lambda b, x, y: b.fcmp_unordered("!=", x, y))
_operator(operator.and_, MASK, MASK, lambda b, x, y: b.and_(x, y))
_operator(operator.or_, MASK, MASK, lambda b, x, y: b.or_(x, y))
_operator(operator.invert, MASK, MASK, lambda b, x: b.not_(x))


def _mathematical(function: Any) -> None:
    """Teach the compiler a function of ``math`` for lanes."""
    name = f"llvm.{function.__name__}.v{WIDTH}f64"

    @extend.intrinsic
    def of_lanes(_: Any, x: Any) -> Any:
        def lower(__: Any, builder: Any, ___: Any, args: Any) -> Any:
            kind = ir.FunctionType(LANES.value, [LANES.value])
            return builder.call(build.get_or_insert_function(builder.module, kind, name), args)

        return typing.signature(LANES, LANES), lower

    @extend.overload(function, strict=False)
    def choose(x: Any) -> Any:
        return (lambda x: of_lanes(x)) if x == LANES else None


for _function in (math.sqrt, math.sin, math.cos, math.floor):
    _mathematical(_function)


@extend.intrinsic
def _chosen(_: Any, mask: Any, one: Any, other: Any) -> Any:
    return typing.signature(LANES, MASK, LANES, LANES), lambda __, builder, ___, args: builder.select(*args)


@extend.intrinsic
def bits(_: Any, mask: Any) -> Any:
    """The lanes in which a mask holds, as the bits of an integer: the first lane is the lowest."""
    return typing.signature(untyped.int64, MASK), lambda context, builder, __, args: builder.zext(
        builder.bitcast(args[0], ir.IntType(WIDTH)), ir.IntType(64)
    )


def select(condition: Any, one: Any, other: Any) -> Any:
    """In each lane: ``one`` where the condition holds, else ``other``."""
    return one if condition else other


@extend.overload(select, jit_options={"forceinline": True}, strict=False)
def _select(condition: Any, one: Any, other: Any) -> Any:
    if condition == MASK:
        return lambda condition, one, other: _chosen(condition, one, other)
    return lambda condition, one, other: one if condition else other


def anywhere(condition: Any) -> Any:
    """Whether the condition holds in any lane."""
    return condition


@extend.overload(anywhere, jit_options={"forceinline": True}, strict=False)
def _anywhere(condition: Any) -> Any:
    return (lambda condition: bits(condition) != 0) if condition == MASK else (lambda condition: condition)


@inlined
def greater(one: Any, other: Any) -> Any:
    """The greater of two in each lane."""
    return select(one > other, one, other)


@inlined
def lesser(one: Any, other: Any) -> Any:
    """The lesser of two in each lane."""
    return select(one < other, one, other)


@extend.overload(max, strict=False)
def _max(x: Any, y: Any) -> Any:
    return (lambda x, y: greater(x, y)) if x == LANES else None


@extend.overload(min, strict=False)
def _min(x: Any, y: Any) -> Any:
    return (lambda x, y: lesser(x, y)) if x == LANES else None


@inlined
def size(number: Any) -> Any:
    """The absolute value in each lane."""
    return select(number < 0.0, -number, number)


@inlined
def select3(condition: Any, one: Any, other: Any) -> Any:
    """``select`` of three numbers."""
    return select(condition, one[0], other[0]), select(condition, one[1], other[1]), select(condition, one[2], other[2])


@extend.intrinsic
def spread(_: Any, number: Any) -> Any:
    """A number in all lanes."""
    return typing.signature(LANES, untyped.float64), lambda __, builder, ___, args: _spread(builder, args[0], LANES)


@extend.intrinsic
def _four(_: Any, c: Any, i: Any, j: Any, k: Any) -> Any:
    def lower(context: Any, builder: Any, kinds: Any, args: Any) -> Any:
        array = arrays.make_array(kinds.args[0])(context, builder, args[0])
        place = build.get_item_pointer(context, builder, kinds.args[0], array, args[1:], wraparound=False)
        four = ir.VectorType(ir.FloatType(), 4)
        return builder.fpext(builder.load(builder.bitcast(place, four.as_pointer()), align=4), QUAD.value)

    return typing.signature(QUAD, c, untyped.intp, untyped.intp, untyped.intp), lower


def four(c: Any, i: int, j: int, k: int) -> Any:
    """Four float32 in a row, from place (i, j, k) on, as a vector of float64."""
    return c[i, j, k : k + 4].astype(np.float64)


@extend.overload(four, jit_options={"forceinline": True}, strict=False)
def _four_of(c: Any, i: Any, j: Any, k: Any) -> Any:
    return lambda c, i, j, k: _four(c, i, j, k)


@extend.intrinsic
def _quad(_: Any, numbers: Any) -> Any:
    def lower(__: Any, builder: Any, ___: Any, args: Any) -> Any:
        result = ir.Constant(QUAD.value, ir.Undefined)
        for lane in range(4):
            number = builder.extract_value(args[0], lane)
            result = builder.insert_element(result, number, ir.Constant(ir.IntType(32), lane))
        return result

    return typing.signature(QUAD, untyped.UniTuple(untyped.float64, 4)), lower


def quad(numbers: tuple[float, float, float, float]) -> Any:
    """Four numbers as a vector."""
    return np.array(numbers)


@extend.overload(quad, jit_options={"forceinline": True}, strict=False)
def _quad_of(numbers: Any) -> Any:
    return lambda numbers: _quad(numbers)


@extend.intrinsic
def _weighted(_: Any, x: Any, w: Any) -> Any:
    def lower(__: Any, builder: Any, ___: Any, args: Any) -> Any:
        pair = ir.VectorType(ir.IntType(32), 2)
        products = builder.fmul(*args, flags=CONTRACT)
        halves = [builder.shuffle_vector(products, products, ir.Constant(pair, [n, n + 1])) for n in (0, 2)]
        both = builder.fadd(*halves, flags=CONTRACT)
        low, high = (builder.extract_element(both, ir.Constant(ir.IntType(32), n)) for n in (0, 1))
        return builder.fadd(low, high, flags=CONTRACT)

    return typing.signature(untyped.float64, QUAD, QUAD), lower


def weighted(x: Any, w: Any) -> float:
    """The sum of the four numbers of a vector, each with its weight."""
    return float(x[0] * w[0] + x[2] * w[2] + (x[1] * w[1] + x[3] * w[3]))


@extend.overload(weighted, jit_options={"forceinline": True}, strict=False)
def _weighted_of(x: Any, w: Any) -> Any:
    return lambda x, w: _weighted(x, w)


@extend.intrinsic
def in_lanes(_: Any, array: Any) -> Any:
    """An array (..., WIDTH) of numbers as one (...) of lanes, in the same memory, which must be kept."""
    result = untyped.Array(LANES, array.ndim - 1, "C", aligned=False)

    def lower(context: Any, builder: Any, kinds: Any, args: Any) -> Any:
        source = arrays.make_array(kinds.args[0])(context, builder, args[0])
        view = arrays.make_array(result)(context, builder)
        shape, strides = (build.unpack_tuple(builder, s, array.ndim)[:-1] for s in (source.shape, source.strides))
        size = context.get_constant(untyped.intp, 8 * WIDTH)
        data = builder.bitcast(source.data, LANES.value.as_pointer())
        arrays.populate_array(view, data, shape, strides, size, None, source.parent)
        return view._getvalue()

    return typing.signature(result, array), lower


def room(*shape: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Zeros (*shape, WIDTH), each row of lanes in one line of the processor's memory (64 bytes)."""
    count = math.prod(shape) * WIDTH
    flat = np.zeros(count + WIDTH)
    skip = -flat.ctypes.data // 8 % WIDTH
    return flat[skip : skip + count].reshape(*shape, WIDTH)
