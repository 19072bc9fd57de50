"""One promise of the solver, measured."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """One measured promise. aim : in words; met : None where no aim is set."""

    claim: str
    value: float
    unit: str
    aim: str = ""
    met: bool | None = None
