"""Refusals in five parts: what, where, got, allowed, do this."""

from __future__ import annotations

from typing import NoReturn


def refuse(what: str, where: str, got: object, allowed: str, advice: str) -> NoReturn:
    """Raise the ValueError of an argument that cannot be used."""
    msg = f"{what}: {where}: got {got!r}; allowed: {allowed}; {advice}"
    raise ValueError(msg)
