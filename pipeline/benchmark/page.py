"""The page of a benchmark, made from the tables that its parts have left in the folder."""

from pathlib import Path

import pandas as pd

from pipeline.benchmark.claims import CLAIMS_CSV, ORDERS_CSV
from pipeline.benchmark.cost import SOLVER_CSV
from pipeline.benchmark.peers.run import PEERS_CSV
from pipeline.benchmark.stress.run import STRESS_CSV
from pipeline.run.provenance import code_state, this_run
from reports.bench import render_bench
from reports.schema import BENCH

BENCH_CSV = "bench.csv"
NOTE = (
    "Milliseconds are processor time of a whole insertion in steps of 1 mm, median of the repeats, compilation "
    "excluded, divided by its length. Errors are against an insertion with 0.1 and 0.05 mm segments, extrapolated, on "
    "the same voxel wall (0.3 mm) with the smooth hull, so that a sampled hull's error holds what that model changes."
)
"""What the reader of the figures must know."""


def machine() -> str:
    """Processor, number of cores and versions in one sentence."""
    found = code_state() | this_run()
    versions = ", ".join(f"{name} {found['versions'][name]}" for name in ("numpy", "numba"))
    dirty = " with uncommitted changes" if found["git_dirty"] else ""
    return (
        f"{found['processor']}, {found['cpu_count']} cores, one thread per run; {found['system']}; "
        f"Python {found['python']}, {versions}; wireval {found['wireval']} {found['git_commit'][:10]}{dirty}"
    )


def write_page(out: Path) -> Path:
    """Join what lies in the folder into bench.csv and render it."""
    parts = [pd.read_csv(out / name) for name in (SOLVER_CSV, PEERS_CSV) if (out / name).exists()]
    table = pd.concat(parts or [pd.DataFrame(columns=list(BENCH.names))], ignore_index=True)
    table.to_csv(out / BENCH_CSV, index=False)
    others = [out / name if (out / name).exists() else None for name in (STRESS_CSV, CLAIMS_CSV, ORDERS_CSV)]
    return render_bench(out / BENCH_CSV, out, *others, note=f"Machine: {machine()}. {NOTE}")
