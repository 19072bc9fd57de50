"""All cases of a run at a glance: error of every frame, and the pooled error of every case with its interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.case_files import GOOD
from reports.figures._style import (
    PURPLE,
    SEQUENTIAL,
    SIMULATED,
    VERMILION,
    Drawing,
    has,
    new_figure,
    plain,
    whole_numbers,
)

_CLIP_PERCENTILE = 98.0  # one lost frame must not turn the others dark
_MAX_INCH = 24.0
_BAR_INCH = 4.0
_TOP_TICKS_FROM = 30  # rows from which the lower axis is out of sight
_MAX_NAMES = 90  # more labels than that overlap at the largest height


@dataclass(frozen=True, eq=False)
class RunFiles:
    """Tables of a run. errors maps a case to its errors.csv; summary has one row per case; sweep may be empty."""

    errors: dict[str, pd.DataFrame]
    summary: pd.DataFrame
    sweep: pd.DataFrame


def case_frame_map(run: RunFiles) -> Drawing | None:
    """95th percentile error of every frame of every case; a cross is a frame without result."""
    table = _long(run)
    failed = ~table["status"].isin(GOOD).to_numpy(dtype=bool)
    if not has(table, "p95_mm") and not failed.any():
        return None
    cases = list(dict.fromkeys(table["case"]))
    grid = np.full((len(cases), int(table["frame"].max()) + 1), np.nan)
    rows = table["case"].map({name: i for i, name in enumerate(cases)}).to_numpy(dtype=int)
    grid[rows, table["frame"].to_numpy(dtype=int)] = table["p95_mm"].to_numpy()
    figure, axes = _tall(len(cases))
    axes.set_facecolor("0.93")
    edges = np.arange(grid.shape[1] + 1) - 0.5, np.arange(len(cases) + 1) - 0.5
    top = max(float(np.nanpercentile(grid, _CLIP_PERCENTILE)), 1e-9) if np.isfinite(grid).any() else 1.0
    clipped = bool((grid > top).any())
    mesh = axes.pcolormesh(
        *edges, grid, cmap=SEQUENTIAL, vmin=0.0, vmax=top, edgecolors="white", linewidth=0.4
    )
    axes.plot(table["frame"].to_numpy(dtype=int)[failed], rows[failed], "x", color=VERMILION, markersize=5)
    extend = "max" if clipped else "neither"
    figure.colorbar(mesh, ax=axes, label="95th percentile, mm", extend=extend, **_bar(figure))
    _name_rows(axes, cases)
    axes.set_xlabel("frame")
    whole_numbers(axes.xaxis)
    plain(axes)
    axes.grid(visible=False)
    return Drawing(figure, table)


def cases_by_error(run: RunFiles) -> Drawing | None:
    """Pooled rms of every case with its 95 % interval, beside the centreline's."""
    table = run.summary[run.summary["rms_mm"].notna()]
    if len(table) < 2:
        return None
    shown = table[["case", "role", "rms_mm", "rms_low_mm", "rms_high_mm", "null_centreline_rms_mm"]]
    figure, axes = _tall(len(table))
    places = np.arange(len(table))
    axes.hlines(places, table["rms_low_mm"], table["rms_high_mm"], color=SIMULATED, linewidth=2)
    validation = (table["role"] != "calibration").to_numpy(dtype=bool)
    for chosen, marker, label in (
        (validation, "o", "simulated"),
        (~validation, "D", "simulated (calibration)"),
    ):
        if chosen.any():
            axes.plot(
                table["rms_mm"].to_numpy()[chosen], places[chosen], marker, color=SIMULATED, label=label
            )
    axes.plot(
        table["null_centreline_rms_mm"], places, "s", color=PURPLE, fillstyle="none", label="centreline"
    )
    _name_rows(axes, list(table["case"]))
    axes.set_xlim(left=0.0)
    axes.set_xlabel("pooled rms distance to the traced wire, mm")
    axes.legend(frameon=False, fontsize=8, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    plain(axes)
    return Drawing(figure, shown)


def _long(run: RunFiles) -> pd.DataFrame:
    # a case without scans has nothing to show here, unless it failed
    known = {name: t for name, t in run.errors.items() if (t["status"] != "simulated").any()}
    parts = [t[["frame", "status", "p95_mm"]].assign(case=name) for name, t in known.items()]
    columns = ["case", "frame", "status", "p95_mm"]
    return pd.concat(parts, ignore_index=True)[columns] if parts else pd.DataFrame(columns=columns)


def _tall(n_rows: int) -> tuple[Figure, Axes]:
    figure = new_figure(float(np.clip(1.3 + 0.24 * n_rows, 2.2, _MAX_INCH)))
    return figure, figure.subplots()


def _bar(figure: Figure) -> dict[str, Any]:
    """A colour bar of readable size at the top, however tall the figure is."""
    share = min(1.0, _BAR_INCH / figure.get_figheight())
    return {"pad": 0.01, "shrink": share, "anchor": (0.0, 1.0), "aspect": 12, "fraction": 0.04}


def _name_rows(axes: Axes, names: Sequence[str]) -> None:
    every = -(-len(names) // _MAX_NAMES)
    axes.set_yticks(range(0, len(names), every), list(names)[::every], fontsize=8)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(axis="x", labeltop=len(names) >= _TOP_TICKS_FROM)
