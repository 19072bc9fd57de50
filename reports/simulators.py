"""The page of several simulators side by side, from simulators.csv and where.csv."""

from pathlib import Path
from urllib.parse import quote

import pandas as pd

from reports import _content
from reports.figures.simulators import OURS, SimulatorFiles
from reports.html import draw_sections, write_page
from reports.schema import SIMULATORS, WHERE, Column
from reports.tables import read_if_there

PAGE = "simulators.html"


def render_simulators(out_dir: Path, embed: bool = False) -> Path:
    """Draw the figure and write simulators.html; returns its path. embed : pictures and numbers into the page."""
    files = SimulatorFiles(*(read_if_there(out_dir / table.file, table) for table in (SIMULATORS, WHERE)))
    table, columns = _one_table(files.simulators)
    grid = _content.grid(table, columns, bad=table["frames_ok"] < table["frames"], nothing=_content.NOTHING)
    for row, name in zip(grid["rows"], table["simulator"], strict=True):
        folder = out_dir / "simulators" / name
        row["cells"][0]["link"] = f"simulators/{quote(name)}/index.html" if folder.is_dir() else "index.html"
    page = {
        "title": "Simulators side by side - wireval",
        "names": list(table["simulator"]),
        "ours": OURS,
        "interval": next(iter(table["interval"].dropna()), ""),
        "simulators": grid,
        "sections": draw_sections("simulators", files, out_dir, embed),
        "where": _where(files.where),
    }
    return write_page("simulators.html.j2", page, out_dir / PAGE)


def _one_table(rows: pd.DataFrame) -> tuple[pd.DataFrame, list[Column]]:
    """A row for each simulator: its own numbers, then the ratio of its error to that of every other one."""
    table = rows[rows["against"].isna()].reset_index(drop=True)
    columns = list(SIMULATORS.shown("cases"))
    pairs = rows[rows["against"].notna()]
    for other in table["simulator"][table["simulator"].isin(pairs["against"])]:
        name = f"rms_ratio_to_{other}"
        mine = pairs[pairs["against"] == other].set_index("simulator")
        for end in ("", "_low", "_high"):
            table[name + end] = table["simulator"].map(mine[f"rms_ratio{end}"])
        meaning = f"rms_mm over that of {other}, on the frames that count in both; below 1: nearer than {other}"
        columns.append(Column(name, "1", meaning))
    return table, columns


def _where(rows: pd.DataFrame) -> _content.Grid | None:
    """A row for each bin: every simulator's error, the nearest, and by how much."""
    if rows.empty:
        return None
    bins = ["along", "low_mm", "high_mm"]
    table = rows.pivot_table(index=bins, columns="simulator", values="rms_mm", sort=False).reset_index()
    names = list(dict.fromkeys(rows["simulator"]))
    lead = rows[rows["lead"].notna()].rename(columns={"simulator": "nearest"})
    ends = ["ratio_to_next", "ratio_to_next_low", "ratio_to_next_high"]
    table = table.merge(lead[[*bins, "nearest", *ends, "lead"]], on=bins, how="left")
    table["nearest"] = table["nearest"].where(table["lead"] != "tie")
    own = [Column(name, "mm", f"rms distance of {name} to the traced wire in this bin") for name in names]
    nearest = Column("nearest", "-", "the simulator with the least error here", "text")
    columns = [*map(WHERE.__getitem__, bins), *own, nearest, WHERE[ends[0]], WHERE["lead"]]
    return _content.grid(table, columns, nothing=_content.NOTHING)
