"""The page of a calibration: parameters with what is seen of them, profiles, correlations, errors before and after."""

from pathlib import Path
from typing import Any

import pandas as pd

from reports._content import NOTHING, flatten, grid, number
from reports.case_files import read_json
from reports.html import draw_sections, write_page
from reports.schema import Column

COLUMNS = (
    Column("parameter", "-", "a factor on what the manifest states, or in the unit that its name ends with", "text"),
    Column("value", "-", "where the traces are fitted best", "text"),
    Column("sd", "-", "one standard deviation of the posterior; of a factor in percent", "text"),
    Column("used", "-", "what parameters.toml holds: the stated value where the parameter is not seen", "text"),
    Column("seen", "-", "known well enough to be taken", "text"),
    Column("prior", "-", "mean and standard deviation; of a factor the latter is of its logarithm", "text"),
    Column("bounds", "-", "values outside are not tried", "text"),
    Column("meaning", "-", "what it is", "text"),
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
        "notes": record["notes"],
        "provenance": list(flatten(record["provenance"])),
    }
    return write_page("calibration.html.j2", page, out / "calibration.html")


def _row(row: dict[str, Any]) -> dict[str, Any]:
    spread = f"{100 * row['sd']:.2g} %" if row["logarithmic"] else number(row["sd"], 2)
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
