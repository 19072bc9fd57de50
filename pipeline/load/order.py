"""The order in which people number things: frame_2 before frame_10, d25 before d25.5, in whatever folder or dataset."""

import re
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

T = TypeVar("T")
_DECIMAL = r"(?<![0-9])(?<![0-9][.,])([0-9]+)[.,]([0-9]+)(?![.,]?[0-9])"
"""A number with one point in it: 1.2.840 has two and is none, as is a date."""


def in_order(items: Iterable[T], name: Callable[[T], str] = str) -> list[T]:
    """The items by their names, which are relative paths or names of datasets.

    A number with a point is a decimal (d25, d25.25, d25.5), except where names count beyond the point (1.9, 1.10).
    """
    named = [(name(item), item) for item in items]
    number = "([0-9]+)()" if _counted([text for text, _ in named]) else f"{_DECIMAL}|([0-9]+)"
    return [item for _, item in sorted(named, key=lambda one: _key(one[0], re.compile(number)))]


def _counted(texts: list[str]) -> bool:
    """Whether points separate counts: some have fewer digits after them than others that end in 0.

    Nobody writes 1.10 beside 1.9 who means a tenth.
    """
    after = [digits for text in texts for _, digits in re.findall(_DECIMAL, text)]
    most = max(map(len, after), default=0)
    return any(len(digits) < most for digits in after) and any(d.endswith("0") for d in after if len(d) == most)


def _key(text: str, number: re.Pattern[str]) -> tuple[Any, ...]:
    """Sort key, part by part of a path; the text itself decides between f1 and f01."""
    return tuple(_of_part(part, number) for part in text.split("/")), text


def _of_part(part: str, number: re.Pattern[str]) -> tuple[tuple[str, int, str, str], ...]:
    """Each number with the text before it: compared by its count of digits, by these, and by those after a point."""
    pieces, done = [], 0
    for found in number.finditer(part):
        whole, after, *alone = found.groups(default="")
        digits = (whole or alone[0]).lstrip("0")
        pieces.append((part[done : found.start()], len(digits), digits, after.rstrip("0")))
        done = found.end()
    return (*pieces, (part[done:], -1, "", ""))
