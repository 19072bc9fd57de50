"""The order in which people number things: frame_2 before frame_10, in whatever folder or dataset."""

import re
from typing import Any


def natural_key(text: str) -> tuple[Any, ...]:
    """Sort key of a relative path or dataset name, part by part; the text itself decides between f1 and f01."""
    return tuple(_of_part(part) for part in text.split("/")), text


def _of_part(part: str) -> tuple[tuple[str, int, str], ...]:
    """Each number with the text before it: compared by its count of digits, then by these, so that any length works."""
    pieces = re.split(r"([0-9]+)", part)
    digits = [piece.lstrip("0") for piece in pieces[1::2]]
    return (*((text, len(n), n) for text, n in zip(pieces[::2], digits, strict=False)), (pieces[-1], -1, ""))
