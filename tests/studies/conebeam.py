"""One study seen by both scanners: ``python -m tests.studies.conebeam OUT`` (make conebeam; extra [conebeam]).

The same scene, seed, truth and manifest through ``psf`` and ``conebeam``, both through ``wireval run``; prints what the
generation cost and the pipeline's errors beside each other, and draws a slice and projections that show the streaks.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

from reports.schema import ERRORS
from reports.tables import read
from tests.studies.conebeam_picture import draw

SCENE, SCANNERS = "circle-of-willis", ("psf", "conebeam")
FRAMES, SIZE, SEED = 12, 256, 101  # nobody tunes on seeds from 100 up
COLUMNS = {
    "trace_mean_mm": "traced to true, mean",
    "trace_tip_mm": "traced to true, tip",
    "rms_mm": "simulated to traced, RMS",
    "truth_rms_mm": "simulated to true, RMS",
    "truth_tip_mm": "simulated to true, tip",
}


def command(words: list[str]) -> tuple[float, float]:
    """Wall and processor seconds of a ``wireval`` command; its own words go to the terminal."""
    before, clock = os.times(), time.monotonic()
    done = subprocess.run([sys.executable, "-m", "pipeline.cli", *words], check=False)
    after = os.times()
    if done.returncode not in (0, 1):
        sys.exit(f"wireval {' '.join(words)}: ended with {done.returncode}")
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return time.monotonic() - clock, used


def make_and_run(scanner: str, out: Path, args: argparse.Namespace) -> dict[str, float]:
    """Generate one study and run it; seconds of either."""
    sizes = ["--frames", str(args.frames), "--size", str(args.size), "--seed", str(args.seed)]
    made = command(["synth", args.scene, "-o", str(out / scanner), "--scanner", scanner, *sizes])
    ran = command(["run", str(out / scanner / "manifest.toml"), "-o", str(out / f"out-{scanner}"), "--fresh"])
    return {"made_s": made[0], "made_cpu_s": made[1], "run_s": ran[0], "run_cpu_s": ran[1]}


def errors(out: Path, scanner: str) -> pd.DataFrame:
    """The errors table of one run."""
    return read(next((out / f"out-{scanner}" / "cases").iterdir()) / "errors.csv", ERRORS)


def table(tables: dict[str, pd.DataFrame]) -> str:
    """Statuses, then median and worst frame of every column, a scanner a column."""
    lines = [f"{'':28s}" + "".join(f"{s:>24s}" for s in tables)]
    counts = [f"{(t['status'] == 'ok').sum()} of {len(t)}" for t in tables.values()]
    lines.append(f"{'frames ok':28s}" + "".join(f"{c:>24s}" for c in counts))
    for column, title in COLUMNS.items():
        cells = []
        for t in tables.values():
            good = t.loc[t["status"] == "ok", column].astype(float)
            cells.append(f"{good.median():.3f} ({good.max():.3f})" if len(good) else "-")
        lines.append(f"{title + ', mm':28s}" + "".join(f"{c:>24s}" for c in cells))
    lines.append("median (worst) over the frames that are ok in that scanner")
    for name, t in tables.items():
        failed = t.loc[t["status"] != "ok", ["frame", "status"]]
        lines += [f"{name} frame {f}: {s}" for f, s in failed.itertuples(index=False)]
    both = np.logical_and.reduce([t["status"].to_numpy() == "ok" for t in tables.values()])
    pooled = [
        f"{name} {np.sqrt(np.mean(t.loc[both, 'truth_rms_mm'].astype(float) ** 2)):.3f} mm"
        for name, t in tables.items()
    ]
    lines.append(f"RMS of simulated to true over the {both.sum()} frames ok in both: " + ", ".join(pooled))
    return "\n".join(lines)


def main(words: list[str]) -> None:
    """Make, run, print, draw."""
    parser = argparse.ArgumentParser(prog="python -m tests.studies.conebeam", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scene", default=SCENE)
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--size", type=int, default=SIZE)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--picture", type=Path, help="where to draw; default OUT/conebeam.png")
    parser.add_argument("--drawn", action="store_true", help="nothing is made or run again: table and picture only")
    args = parser.parse_args(words)
    for scanner in () if args.drawn else SCANNERS:
        seconds = make_and_run(scanner, args.out, args)
        sys.stdout.write(f"{scanner}: " + ", ".join(f"{k} {v:.0f}" for k, v in seconds.items()) + "\n")
        sys.stdout.flush()
    sys.stdout.write(table({s: errors(args.out, s) for s in SCANNERS}) + "\n")
    draw(args.out, args.scene, args.seed, args.picture or args.out / "conebeam.png")


if __name__ == "__main__":
    main(sys.argv[1:])
