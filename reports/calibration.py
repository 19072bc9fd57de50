"""The pages of a calibration and of a planned one: parameters with what is seen of them, profiles, errors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reports._content import NOTHING, Grid, flatten, grid, number
from reports.case_files import counted
from reports.page import draw_sections, write_page
from reports.records import read_json
from reports.schema import Column

PRIOR = (
    "what was taken for likely before any trace was seen: mean and standard deviation; of a factor the latter is "
    "of its logarithm"
)
USED = "what parameters.toml holds: of a parameter that is not seen what is stated; the others fitted again beside it"
FACTOR_FROM = 0.3
"""Standard deviation of a logarithm from which it is told as a factor."""
OF_FACTORS = "of a factor in percent, or, where it is large, as what to multiply and to divide the value by"
GAINED = 0.98
"""Error after calibrating over the one before from which the wires are not called nearer."""
STATED_AND_FITTED, AS_GIVEN = ["before_mm", "after_mm"], "as_given_mm"
"""Columns of a frame's distances, mm."""
TURNED = {
    "as_calibrated": " with each insertion turned for itself",
    "in_both": ", each insertion turned for itself in both",
}
COLUMNS = (
    Column("parameter", "-", "a factor on what the manifest states, or in the unit that its name ends with", "text"),
    Column("value", "-", "where the wires meet the traces best", "text"),
    Column("sd", "-", "one standard deviation: how far the true value may be off; " + OF_FACTORS, "text"),
    Column("used", "-", USED, "text"),
    Column(
        "seen",
        "-",
        "known well enough to be taken, or contradicting what is stated; a reservation is said above",
        "text",
    ),
    Column("prior", "-", PRIOR, "text"),
    Column("bounds", "-", "values outside are not tried", "text"),
    Column("meaning", "-", "what it is", "text"),
)

WIRE = (
    Column("of", "-", "a key of [wires.*] of the manifest", "text"),
    Column("at_mm", "mm", "distance from the tip"),
    Column("stated", "-", "what the manifest states, in the unit that the key ends with"),
    Column("used", "-", "what parameters.toml holds"),
    Column(
        "sd",
        "-",
        "one standard deviation, what is not seen being as uncertain as above; held: the fit leaves it as stated",
        "text",
    ),
)
RATIOS = (
    "Shapes tell the ratios of stiffness alone: of the shaft to the tip, and of the wall to the wire. EI of the tip is "
    "held as stated, and the shaft's is relative to it (absolute_stiffness = false in parameters.toml). If you know "
    "the shaft's EI and not the tip's: multiply EI all along, and stiffness_N_mm2 of every wall, in parameters.toml "
    "by your shaft's EI over the one here. That changes no shape."
)
MOVED = (
    Column("insertion", "-", "its cases", "text"),
    Column("of", "-", "what was moved: where the wire is held, which way it enters, the wall, the roll", "text"),
    Column("how", "-", "along the wire or across it; of the wall below 0: away from the wire, a wider lumen", "text"),
    Column("moved", "-", "from what is stated, in mm, of direction and roll in degrees"),
    Column("sd", "-", "one standard deviation", "text"),
    Column("prior", "-", "one standard deviation that the fit starts from: stated, or taken where nothing is", "text"),
)
PLANNED = (
    COLUMNS[0],
    Column("sd", "-", "one standard deviation as the planned study would find it; " + OF_FACTORS, "text"),
    Column("enough", "-", "a standard deviation up to which the parameter counts as seen", "text"),
    replace(COLUMNS[4], meaning="known well enough to be taken"),
    COLUMNS[-1],
)


def render_calibration(out: Path) -> Path:
    """Draw the figures and write calibration.html into a folder that holds calibration.json; returns its path."""
    record = read_json(out / "calibration.json")
    rows = record["estimates"]
    unseen = [row for row in rows if not row["seen"]]
    table = pd.DataFrame([_row(row) for row in rows])
    page = {
        "title": "wireval calibration",
        "used": record["used"],
        "insertions": counted(len({one["group"] for one in record["used"]}), "insertion"),
        "unseen": unseen,
        "reservations": record["reservations"],
        "doubted": [row for row in rows if row["seen"] and row["why"]],
        "moved": _moved(record.get("insertions", [])),
        "traces": _of_the_traces(record),
        "gained": gained(record["frames"]),
        "starts": [(number(roll), number(value)) for roll, value in record["starts"]],
        "estimates": grid(table, COLUMNS, bad=[not row["seen"] for row in rows], nothing=NOTHING),
        "wire": _wire(record.get("wire", [])),
        "ratios": RATIOS if record.get("absolute_stiffness") is False else "",
        "sections": draw_sections("calibration", record, out, embed=False),
        "warnings": record.get("warnings", ()),
        "notes": record["notes"],
        "provenance": list(flatten(record["provenance"])),
    }
    return write_page("calibration.html.j2", page, out / "calibration.html")


def _wire(rows: Sequence[Mapping[str, Any]]) -> Grid | None:
    """The wire's profiles as stated and as calibrated; None in a record that has none."""
    if not rows:
        return None
    told = [{**row, "sd": _spread({**row, "logarithmic": True}, "sd") if row["sd"] > 0 else "held"} for row in rows]
    return grid(pd.DataFrame(told), WIRE, nothing=NOTHING)


def _moved(rows: Sequence[Mapping[str, Any]]) -> Grid | None:
    """What each insertion was moved by for itself; None in a record that does not tell."""
    if not rows:
        return None
    told = [
        {
            **{name: row[name] for name in ("insertion", "of", "how")},
            "moved": row["value"],
            "sd": number(row["sd"], 2) if row["prior_sd"] else "exact",
            "prior": number(row["prior_sd"], 2) if row["prior_sd"] else "exact",
        }
        for row in rows
    ]
    return grid(pd.DataFrame(told), MOVED, bad=[row["beyond"] for row in rows], nothing=NOTHING)


def _of_the_traces(record: Mapping[str, Any]) -> str:
    """What the traces' standard deviations were taken to be; empty where it is what they state."""
    scale = float(record["scale"])
    if record.get("stated", True):
        times = f"The traces' variances were taken {number(scale)} times as large as they are stated, since the wires "
        return f"{times}lie that much farther from them. " if f"{scale:.2f}" != "1.00" else ""
    return (
        "Curves of your own state no standard deviation: theirs is what the distances that the fit leaves ask for. A "
        "lumen, or a profile of the wire, that is wrong by as much is not told from noise then, and values may be off "
        "beyond the standard deviations here: judge by the distances that are left. "
    )


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
    spread, enough = (_spread(row, key) for key in ("sd", "enough"))
    seen = "yes" if row["seen"] else "NO"
    return {"parameter": row["name"], "sd": spread, "enough": enough, "seen": seen, "meaning": row["what"]}


def _spread(row: Mapping[str, Any], key: str) -> str:
    """A standard deviation; that of a factor in percent, or from 30 % on as a factor itself."""
    sd = float(row[key])
    if row["logarithmic"]:
        return f"a factor of {number(float(np.exp(sd)), 2)}" if sd > FACTOR_FROM else f"{number(100 * sd, 2)} %"
    return number(sd, 2)


def to_its_digits(row: Mapping[str, Any], key: str) -> str:
    """A value of a row, to the place where its standard deviation has its second digit: 1.037 +- 0.1 says too much.

    The standard deviation of a factor is of its logarithm: of the factor itself it is as many times its value.
    """
    value, sd = float(row[key]), float(row["sd"]) * (abs(float(row[key])) if row["logarithmic"] else 1.0)
    if not 0.0 < sd < np.inf:
        return number(value)
    places = min(1 - int(np.floor(np.log10(float(f"{sd:.1e}")))), 6)
    return f"{round(value, places) + 0.0:.{max(places, 0)}f}"  # of -0.0, too


def gained(frames: Sequence[Mapping[str, Any]]) -> str:
    """How far the wires of the fitted frames lie from their traces, as stated and as calibrated; empty without any.

    Rolls that are stated 40 degrees off were "as stated" 0.06 mm, which a run as stated is not: it turns no insertion.
    """
    every = pd.DataFrame(frames, columns=["depth_mm", *STATED_AND_FITTED, AS_GIVEN]).astype(float)
    known = every.dropna(subset=["depth_mm", *STATED_AND_FITTED])
    if known.empty:
        return ""
    before, after = (_rms_mm(known, name) for name in STATED_AND_FITTED)
    said = "" if after < GAINED * before else ": no nearer" if after < before / GAINED else ": farther away"
    turned = {str(frame.get("turned", "")) for frame in frames}
    alone = next((words for where, words in TURNED.items() if where in turned), "")
    return (
        f"the wires of {counted(len(known), 'fitted frame')} lie {number(before)} mm rms from their traces as stated, "
        f"{number(after)} mm as calibrated{alone}{said}; clamps and walls are fitted to both"
        f"{_as_given(known)}"
    )


def _as_given(known: pd.DataFrame) -> str:
    """What is said of the wires with the walls as they are given: of fewer frames, how near these came besides.

    Those that do not come to rest there may be the worst: without them alone the worst case read as a gain.
    """
    given = known.dropna(subset=[AS_GIVEN])
    if given.empty:
        return "; with the walls as they are given none of these wires comes to rest"
    said = f"; with the walls as they are given it is {number(_rms_mm(given, AS_GIVEN))} mm"
    if len(given) == len(known):
        return said
    calibrated = number(_rms_mm(given, "after_mm"))
    return f"{said} over the {counted(len(given), 'frame')} that come to rest then, {calibrated} mm as calibrated"


def _rms_mm(frames: pd.DataFrame, name: str) -> float:
    """Root mean square of a column, each frame with the weight of its length."""
    return float(np.sqrt(np.average(frames[name] ** 2, weights=frames["depth_mm"])))


def _row(row: dict[str, Any]) -> dict[str, Any]:
    bounds = " to ".join(number(float(v)) for v in row["bounds"])
    return {
        "parameter": row["name"],
        "value": to_its_digits(row, "value"),
        "sd": _spread(row, "sd"),
        "used": to_its_digits(row, "used") if row["seen"] else f"{float(row['used']):g}",
        "seen": "yes" if row["seen"] else "NO",
        "prior": f"{number(float(row['prior']))} ± {number(float(row['prior_sd']), 2)}",
        "bounds": bounds,
        "meaning": row["what"],
    }
