"""The bars of the full circle-of-Willis study, one line a seed: ``python -m tests.studies.bars OUT ...``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from reports.schema import ERRORS, TIMINGS
from reports.tables import read


def row(out: Path) -> str:
    """Frames ok, tracing in voxels (median frame), simulated against truth, peak memory."""
    case = next((out / "cases").iterdir())
    table, result = (read(case / "errors.csv", ERRORS), json.loads((case / "result.json").read_text(encoding="utf-8")))
    voxel = min(result["geometry"]["spacing_mm"])
    numbers = result["summary"]
    memory = read(case / TIMINGS.file, TIMINGS)["peak_memory_MiB"].max()
    return (
        f"{out.name:12s} {int((table['status'] == 'ok').sum()):3d}/{len(table)}"
        f"   {table['trace_mean_mm'].median() / voxel:6.3f} {table['trace_mean_mm'].max() / voxel:6.3f}"
        f"   {table['trace_tip_mm'].median() / voxel:6.3f} {table['trace_tip_mm'].max() / voxel:6.3f}"
        f"   {numbers['truth_rms_mm']:6.3f} {numbers['rms_mm']:6.3f} {numbers['tip_median_mm']:6.3f}"
        f"   {numbers['skill']:6.3f} {numbers['skill_strongest']:6.3f}  {memory:6.0f}"
        f"   against {numbers['strongest_null']}"
    )


def main() -> None:
    """Print the table."""
    print("             frames  trace mean (voxel) trace tip (voxel)  truth   rms    tip     skill  strongest  memory")
    print("                 ok  median    max   median    max        rms mm     mm    mm            MiB")
    for name in sys.argv[1:]:
        print(row(Path(name)))


if __name__ == "__main__":
    main()
