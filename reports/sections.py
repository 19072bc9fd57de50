"""The parts of every page, as sections.toml declares them."""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path


@cache
def declared(part: str) -> tuple[Mapping[str, str], ...]:
    """The entries of sections.toml for a page (case, run or bench) or for the cards of a case, in order."""
    text = Path(__file__).with_name("sections.toml").read_text(encoding="utf-8")
    return tuple(tomllib.loads(text)[part])
