"""One promise of the solver, measured."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """One measured promise. aim : in words; met : None where no aim is set.

    An order of convergence keeps what it was fitted to. against : what was made smaller, with its unit.
    sizes, errors : its values, and the errors found there in ``error_unit``.
    """

    claim: str
    value: float
    unit: str
    aim: str = ""
    met: bool | None = None
    against: str = ""
    sizes: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()
    error_unit: str = ""
