"""The pages of a calibration and of a planned one: parameters with what is seen of them, profiles, errors."""

from pathlib import Path
from typing import Any

import pandas as pd

from reports._content import NOTHING, flatten, grid, number
from reports.page import draw_sections, write_page
from reports.records import read_json
from reports.schema import Column

PRIOR = (
    "what was taken for likely before any trace was seen: mean and standard deviation; of a factor the latter is "
    "of its logarithm"
)
USED = "what parameters.toml holds: of a parameter that is not seen what is stated; the others fitted again beside it"
COLUMNS = (
    Column("parameter", "-", "a factor on what the manifest states, or in the unit that its name ends with", "text"),
    Column("value", "-", "where the wires meet the traces best", "text"),
    Column("sd", "-", "one standard deviation: how far the true value may be off; of a factor in percent", "text"),
    Column("used", "-", USED, "text"),
    Column("seen", "-", "known well enough to be taken", "text"),
    Column("prior", "-", PRIOR, "text"),
    Column("bounds", "-", "values outside are not tried", "text"),
    Column("meaning", "-", "what it is", "text"),
)

PLANNED = (
    COLUMNS[0],
    Column("sd", "-", "one standard deviation as the planned study would find it; of a factor in percent", "text"),
    Column("enough", "-", "a standard deviation up to which the parameter counts as seen", "text"),
    COLUMNS[4],
    COLUMNS[-1],
)


def render_calibration(out: Path, embed: bool = False) -> Path:
    """Draw the figures and write calibration.html into a folder that holds calibration.json; returns its path."""
    record = read_json(out / "calibration.json")
    rows = record["estimates"]
    unseen = [row for row in rows if not row["seen"]]
    table = pd.DataFrame([_row(row) for row in rows])
    page = {
        "title": "wireval calibration",
        "used": record["used"],
        "unseen": unseen,
        "scale": number(record["scale"]),
        "starts": [(number(roll), number(value)) for roll, value in record["starts"]],
        "estimates": grid(table, COLUMNS, bad=[not row["seen"] for row in rows], nothing=NOTHING),
        "sections": draw_sections("calibration", record, out, embed),
        "warnings": record.get("warnings", ()),
        "notes": record["notes"],
        "provenance": list(flatten(record["provenance"])),
    }
    return write_page("calibration.html.j2", page, out / "calibration.html")


def render_design(out: Path) -> Path:
    """Write design.html into a folder that holds design.json: what a planned study would tell; returns its path."""
    record = read_json(out / "design.json")
    rows = record["predicted"]
    table = pd.DataFrame([_planned(row) for row in rows])
    page = {
        "title": "wireval: a planned calibration",
        "unseen": [row for row in rows if not row["seen"]],
        "predicted": grid(table, PLANNED, bad=[not row["seen"] for row in rows], nothing=NOTHING),
        "notes": record["notes"],
        "provenance": list(flatten(record["provenance"])),
    }
    return write_page("design.html.j2", page, out / "design.html")


def _planned(row: dict[str, Any]) -> dict[str, Any]:
    spread, enough = (
        f"{number(100 * row[key], 2)} %" if row["logarithmic"] else number(float(row[key]), 2)
        for key in ("sd", "enough")
    )
    seen = "yes" if row["seen"] else "NO"
    return {"parameter": row["name"], "sd": spread, "enough": enough, "seen": seen, "meaning": row["what"]}


def _row(row: dict[str, Any]) -> dict[str, Any]:
    spread = f"{number(100 * row['sd'], 2)} %" if row["logarithmic"] else number(row["sd"], 2)
    bounds = " to ".join(number(float(v)) for v in row["bounds"])
    return {
        "parameter": row["name"],
        "value": number(float(row["value"])),
        "sd": spread,
        "used": number(float(row["used"])),
        "seen": "yes" if row["seen"] else "NO",
        "prior": f"{number(float(row['prior']))} ± {number(float(row['prior_sd']), 2)}",
        "bounds": bounds,
        "meaning": row["what"],
    }
