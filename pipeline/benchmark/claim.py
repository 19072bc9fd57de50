"""One promise of the solver, measured; and what becomes of many of them: lines, two tables and a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas as pd

from pipeline.benchmark.page import CLAIMS_CSV, ORDERS_CSV
from reports.bench import CLAIM_COLUMNS, ORDER_COLUMNS


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


def tell(claims: Iterable[Claim], out: Path, say: Callable[[str], None]) -> bool:
    """Say each claim as it is measured, and write them; False where a promise is broken."""
    found = []
    for claim in claims:
        found.append(claim)
        verdict = {None: "", True: "met", False: "NOT MET"}[claim.met]
        unit = claim.unit if claim.unit != "1" else ""
        say(f"{claim.claim}: {claim.value:.4g} {unit} [{claim.aim}] {verdict}")
    write_claims(found, out)
    return all(claim.met is not False for claim in found)


def write_claims(found: Sequence[Claim], out: Path) -> None:
    """claims.csv, a row a claim, and orders.csv, a row for each point that an order was fitted to."""
    claims = pd.DataFrame([asdict(claim) for claim in found])
    claims[[column.name for column in CLAIM_COLUMNS]].to_csv(out / CLAIMS_CSV, index=False)
    points = claims[claims["sizes"].str.len() > 0].explode(["sizes", "errors"]).drop(columns="unit")
    names = {"sizes": "size", "errors": "error", "error_unit": "unit", "value": "order"}
    points = points.rename(columns=names)[[column.name for column in ORDER_COLUMNS]]
    points.to_csv(out / ORDERS_CSV, index=False)
