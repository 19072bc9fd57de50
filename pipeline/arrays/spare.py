"""What is used again: memory, as a page fault costs 3 to 10 us for every 4 KiB of fresh one, and what frames share."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar
from weakref import WeakKeyDictionary

from numpy.typing import DTypeLike, NDArray

from pipeline.arrays.lattice import sparse_zeros

Made = TypeVar("Made")


class Last(Generic[Made]):
    """What was last made of each object, as long as the object lives."""

    def __init__(self) -> None:
        self._made: WeakKeyDictionary[Any, tuple[object, Made]] = WeakKeyDictionary()

    def of(self, whose: object, by: object, make: Callable[[], Made]) -> Made:
        """What was made of an object, anew where it was not made by the same."""
        known = self._made.get(whose)
        if known is None or known[0] != by:
            known = self._made[whose] = by, make()
        return known[1]


class Spare:
    """Arrays of one shape and kind that nobody is using; several threads may take them and give them back."""

    def __init__(self, shape: tuple[int, ...], dtype: DTypeLike) -> None:
        self.shape, self.dtype = shape, dtype
        self._free: list[NDArray[Any]] = []

    def take(self) -> NDArray[Any]:
        """An array as an earlier user left it, or zeros."""
        try:
            return self._free.pop()
        except IndexError:  # to ask first would not do: another thread may take the last one meanwhile
            return sparse_zeros(self.shape, self.dtype)

    def give_back(self, array: NDArray[Any]) -> None:
        """Let others use an array that was taken."""
        self._free.append(array)
