"""docs/metrics.md from the columns that are registered: ``python -m tests.studies.metrics_page`` writes it anew."""

from __future__ import annotations

from pathlib import Path

from pipeline.compare.nulls import ANOTHER
from reports.schema import ERRORS, POOLED, SUMMARY, Column

PAGE = Path(__file__).resolve().parents[2] / "docs" / "metrics.md"
HEAD = """# What is measured of a frame

In the formulas w are points of the simulated wire, and c points of the traced curve. Both lie at equal steps
(`compare.sample_mm`) of the arc length s from the entry, and at the tip. The clamp's reach (`compare.skip_mm`) is left
out, which is 10 mm, and of wires shorter than 12 mm all but the last 2. g is the wire of a trivial predictor, cut at
the frame's depth, with points where w has them. A case pools over its frames that are ok. overall.csv does so over all
validation cases.

This page is written by `python -m tests.studies.metrics_page` from reports/columns.toml.

| column | unit | what | how | of a case |
|---|---|---|---|---|
"""


def row(column: Column) -> str:
    pooled = f"`{column.pooled_name}`: {POOLED[column.pooled]}" if column.pooled else ""
    formula = column.formula.replace("|", "\\|")
    return f"| `{column.name}` | {column.unit} | {column.meaning} | {formula} | {pooled} |"


def text() -> str:
    """The page: every column with a formula, and the predictor that overall.csv alone has."""
    shown = [*(c for c in ERRORS if c.formula), SUMMARY[f"null_{ANOTHER}_rms_mm"]]
    return HEAD + "\n".join(map(row, shown)) + "\n"


if __name__ == "__main__":
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(text(), encoding="utf-8")
