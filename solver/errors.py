"""Refusals in five parts: what, where, got, allowed, do this."""

from typing import NoReturn


def refuse(what: str, where: str, got: object, allowed: str, advice: str) -> NoReturn:
    """Raise the ValueError of an argument that cannot be used."""
    raise ValueError(f"{what}: {where}: got {got!r}; allowed: {allowed}; {advice}")
