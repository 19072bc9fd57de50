"""The order in which people number things: frame_2 before frame_10, d25 before d25.5, in whatever folder or dataset."""

import re
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import pairwise
from statistics import fmean, pstdev
from typing import Any, TypeVar

T = TypeVar("T")
_NUMBER = re.compile(r"(?<![0-9])(?<![0-9][.,])([0-9]+)[.,]([0-9]+)(?![.,]?[0-9])|([0-9]+)")
"""With one point in it, or without: 1.2.840 has two and is three numbers, as is a date."""
Place = tuple[int, int]
"""Of a number in a name: the part of the path, and which of that part's numbers it is."""
PADDED = 3
"""Least digits of a counter that is filled up with zeros; a depth is written to 0.01 mm at most."""


def in_order(items: Iterable[T], name: Callable[[T], str] = str) -> list[T]:
    """The items by their names, which are relative paths or names of datasets.

    A number with a point is a decimal (d25, d25.25, d25.5), except where names count beyond the point (1.9, 1.10).
    """
    named = [(name(item), item) for item in items]
    counted = _counted([text for text, _ in named])
    return [item for _, item in sorted(named, key=lambda one: _key(one[0], counted))]


def last_counts(names: Sequence[str]) -> list[int | None]:
    """The last number of each name; None without one, or for a decimal, as of a depth: 31.2 mm is no frame 2."""
    counted, found = _counted(names), [[*_numbers(name)] for name in names]
    return [_count(*numbers[-1], counted) if numbers else None for numbers in found]


def _count(place: Place, whole: str, after: str, counted: set[Place]) -> int | None:
    return None if after and place not in counted else int(after or whole)


def _numbers(text: str) -> Iterator[tuple[Place, str, str]]:
    """The numbers of a name: place, digits before the point, and after it."""
    for part, words in enumerate(text.split("/")):
        for n, found in enumerate(_NUMBER.finditer(words)):
            yield (part, n), found[1] or found[3], found[2] or ""


def _counted(texts: Iterable[str]) -> set[Place]:
    """The places at which points separate counts: there these are more evenly apart than decimals would be."""
    seen: dict[Place, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for text in texts:
        for place, whole, after in _numbers(text):
            seen[place][whole].add(after)
    return {place for place, numbers in seen.items() if _counts(numbers.values())}


def _counts(each: Collection[set[str]]) -> bool:
    """Whether what follows points is counted. each : the digits after them, of every number before them."""
    digits = set().union(*each)
    widths, padded = {*map(len, digits)}, any(len(d) > 1 and d[0] == "0" for d in digits)
    # of run2.0000 and run2.0003 the point is the simulator's; depths that are known to 0.001 mm differ before it, too
    if len(each) == 1 < len(digits) and len(widths) == 1 and min(widths) >= PADDED and padded:
        return True
    # nobody counts 25, 25.5 or writes 1.05 for the fifth; where all have as many digits both are in one order
    if "" in digits or padded or len(widths) < 2:
        return False
    counts, decimals = ([_uneven([*map(read, some)]) for some in each] for read in (int, lambda d: float(f"0.{d}")))
    return sum(counts) < sum(decimals) or (counts == decimals and any(d[-1] == "0" for d in digits))


def _uneven(values: list[float]) -> float:
    """The spread of the steps between values, over their mean."""
    steps = [b - a for a, b in pairwise(sorted(values))]
    return pstdev(steps) / fmean(steps) if steps else 0.0


def _key(text: str, counted: set[Place]) -> tuple[Any, ...]:
    """Sort key, part by part of a path; the text itself decides between f1 and f01."""
    return tuple(_of_part(n, part, counted) for n, part in enumerate(text.split("/"))), text


def _of_part(number: int, part: str, counted: set[Place]) -> tuple[tuple[str, int, str, Any], ...]:
    """Each number with the text before it: compared by its count of digits, by these, and by those after a point."""
    pieces: list[tuple[str, int, str, Any]] = []
    done = 0
    for n, found in enumerate(_NUMBER.finditer(part)):
        digits, after = (found[1] or found[3]).lstrip("0"), found[2] or ""
        beyond = int(after or "0") if (number, n) in counted else float(f"0.{after}0")
        pieces.append((part[done : found.start()], len(digits), digits, beyond))
        done = found.end()
    return (*pieces, (part[done:], -1, "", 0))
