"""Refusals in five parts: what, where, got, allowed, do this."""

from typing import NoReturn

import numpy as np

LONGEST = 200
"""Characters of what was got that a message shows."""


def refuse(what: str, where: str, got: object, allowed: str, advice: str) -> NoReturn:
    """Raise the ValueError of an argument that cannot be used."""
    shown = repr(got.item() if isinstance(got, np.generic) else got)  # not np.float64(30.5)
    shown = shown if len(shown) <= LONGEST else f"{shown[:LONGEST]}... ({len(shown)} characters)"
    raise ValueError(f"{what}: {where}: got {shown}; allowed: {allowed}; {advice}")
