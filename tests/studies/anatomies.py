"""Real vessel trees through ``synth --anatomy`` and ``run``: ``python -m tests.studies.anatomies [--size N] [FILE]``.

Without files: five BraVa trees and the aorta-to-cranial tree of $WIREVAL_DATA. Prints errors and statuses by frame.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pandas as pd

from pipeline.cli import main as wireval
from reports.schema import ERRORS
from reports.tables import read

TREES = ("BG001", "BG0002", "BG05", "BG10", "BG0019")
FRAMES, SIZE, SEED = 6, 128, 100
COLUMNS = ("insertion_mm", "trace_mean_mm", "trace_tip_mm", "rms_mm", "tip_mm", "truth_rms_mm", "truth_tip_mm")


def files(data: Path) -> list[Path]:
    """The six trees: whatever is there of them."""
    brava = [data / "brava_swc" / f"{name}.swc" for name in TREES]
    carotid = data / "aorta_to_cranial" / "Centrelines_comb" / "Centerline curve - RCCA.mrk.json"
    return [p for p in [*brava, carotid] if p.exists()]


def quietly(words: list[str]) -> tuple[int, str]:
    """Exit code and output of one command."""
    log = io.StringIO()
    with redirect_stdout(log), redirect_stderr(log):
        code = wireval(words)
    return code, log.getvalue()


def run_tree(path: Path, root: Path, size: int = SIZE, frames: int = FRAMES) -> tuple[pd.DataFrame, str]:
    """One tree: its errors table (empty where no study came out) and the last words of what failed."""
    study, out = root / path.stem / "study", root / path.stem / "out"
    sizes = ["--size", str(size), "--frames", str(frames), "--seed", str(SEED)]
    code, said = quietly(["synth", "--anatomy", str(path), "-o", str(study), *sizes])
    if code:
        return pd.DataFrame(), said.strip().splitlines()[-1]
    code, said = quietly(["run", str(study / "manifest.toml"), "-o", str(out), "--no-cache", "--until", "compare"])
    if code not in (0, 1):
        return pd.DataFrame(), said.strip().splitlines()[-1]
    table = read(next((out / "cases").iterdir()) / "errors.csv", ERRORS)
    return table, ""


def lines(path: Path, table: pd.DataFrame, trouble: str) -> list[str]:
    """Frame by frame, then the pooled row of the tree."""
    if table.empty:
        return [f"{path.name}: {trouble}"]
    rows = [f"{path.name}: {(table['status'] == 'ok').sum()} of {len(table)} frames ok"]
    for record in table.to_dict("records"):
        numbers = "".join(f"{float(record[c]):15.3f}" if pd.notna(record[c]) else f"{'-':>15s}" for c in COLUMNS)
        rows.append(f"  {record['frame']:3d} {record['status']:22s}{numbers}")
    good = table[table["status"] == "ok"]
    if len(good):
        middle = "".join(f"{float(good[c].median()):15.3f}" for c in COLUMNS)
        rows.append(f"      {'median of ok frames':22s}{middle}")
    return rows


def main(words: list[str]) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.studies.anatomies", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--size", type=int, default=SIZE)
    parser.add_argument("--frames", type=int, default=FRAMES)
    args = parser.parse_args(words)
    chosen = args.files or files(Path(os.environ.get("WIREVAL_DATA", "")))
    if not chosen:
        sys.exit("no trees: set WIREVAL_DATA to the folder of real data, or name .swc or .mrk.json files")
    sys.stdout.write(f"{'':26s}{''.join(f'{c:>15s}' for c in COLUMNS)}\n")
    for path in chosen:
        with tempfile.TemporaryDirectory() as scratch:
            table, trouble = run_tree(path, Path(scratch), args.size, args.frames)
        sys.stdout.write("\n".join(lines(path, table, trouble)) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
