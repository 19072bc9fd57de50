"""What a benchmark leaves: tidy tables, a page, and the settings to use, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

from pipeline.benchmark.claim import Claim
from pipeline.run.provenance import collect
from reports.bench import recommended, render_bench
from reports.schema import BENCH, CLAIMS, ORDERS

SOLVER_CSV, PEERS_CSV, BENCH_CSV = "solver.csv", "peers.csv", "bench.csv"
CLAIMS_CSV, ORDERS_CSV = "claims.csv", "orders.csv"
STRESS_CSV, SCENES_CSV = "stress.csv", "stress_scenes.csv"
TARGETS_MM = (0.1, 0.01)


def machine() -> str:
    """Processor, number of cores and versions in one sentence."""
    found = collect()
    versions = ", ".join(f"{name} {found['versions'][name]}" for name in ("numpy", "numba"))
    dirty = " with uncommitted changes" if found["git_dirty"] else ""
    return (
        f"{found['processor']}, {found['cpu_count']} cores, one thread per run; {found['system']}; "
        f"Python {found['python']}, {versions}; wireval {found['wireval']} {found['git_commit'][:10]}{dirty}"
    )


def note() -> str:
    """What the reader of the figures must know."""
    return (
        f"Machine: {machine()}. Milliseconds are processor time of a whole insertion in steps of 1 mm, median of the "
        "repeats, compilation excluded, divided by its length. Errors are against an insertion with 0.1 and 0.05 mm "
        "segments, extrapolated, on the same voxel wall (0.3 mm) with the smooth hull, so that a sampled hull's error "
        "holds what that model changes."
    )


def write_claims(found: Sequence[Claim], out: Path) -> None:
    """claims.csv, a row a claim, and orders.csv, a row for each point that an order was fitted to."""
    rows = [{name: getattr(c, name) for name in CLAIMS.names} for c in found]
    pd.DataFrame(rows).to_csv(out / CLAIMS_CSV, index=False)
    points = [
        {
            "against": c.against,
            "size": size,
            "error": error,
            "unit": c.error_unit,
            "order": c.value,
            "aim": c.aim,
        }
        for c in found
        for size, error in zip(c.sizes, c.errors, strict=True)
    ]
    pd.DataFrame(points, columns=list(ORDERS.names)).to_csv(out / ORDERS_CSV, index=False)


def write_page(out: Path) -> Path:
    """Join what lies in the folder into bench.csv and render it."""
    parts = [pd.read_csv(out / name) for name in (SOLVER_CSV, PEERS_CSV) if (out / name).exists()]
    empty = pd.DataFrame(columns=list(BENCH.names))
    table = pd.concat(parts, ignore_index=True) if parts else empty
    table.to_csv(out / BENCH_CSV, index=False)
    others = [out / name if (out / name).exists() else None for name in (STRESS_CSV, CLAIMS_CSV, ORDERS_CSV)]
    return render_bench(out / BENCH_CSV, out, *others, note=note())


def advice(rows: pd.DataFrame) -> Iterator[str]:
    """The fastest setting of each scene within each target error, a line each."""
    best = recommended(rows)
    for target in TARGETS_MM:
        for scene in dict.fromkeys(rows["scene"]):
            mine = best[(best["scene"] == scene) & (best["target_mm"] == target)] if len(best) else best
            if mine.empty:
                yield f"{scene}: no setting reaches {target:g} mm"
                continue
            row = mine.iloc[0]
            yield (
                f"{scene}: for {target:g} mm use {row['method']}, segment {row['segment_mm']:g} mm, "
                f"hull {row['hull']}, quadrature {row.get('quadrature', '-')}, tolerance {row['tolerance']:g}: "
                f"{row['ms_per_mm']:.3g} ms per mm, {row['shape_error_mm']:.2g} mm"
            )
