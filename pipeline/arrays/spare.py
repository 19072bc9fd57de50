"""Memory that is used again: to write to fresh memory costs a page fault every 4 KiB, of 3 to 10 us each."""

from typing import Any

from numpy.typing import DTypeLike, NDArray

from pipeline.arrays.lattice import sparse_zeros


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
