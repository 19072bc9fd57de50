"""The rivals one after the other, and this solver in the same run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import pandas as pd

from pipeline.benchmark.peers.judge import row_of

ADAPTERS = {
    "exudyn_cable": "exudyn",
    "exudyn_plain": "exudyn",
    "pypbd_rod": "pyPBD",
    "mujoco_cable": "mujoco",
    "pyelastica_rod": "pyelastica",
}
"""Module of this package and the distribution that it needs."""
OURS = "wireval_chain"
LIMIT_S = 300.0
WORK: dict[str, Sequence[tuple[str, int]]] = {
    OURS: [
        *(("cantilever", n) for n in (5, 10, 20, 50, 100, 200)),
        *(("bend", n) for n in (30, 60, 120)),
    ],
    "exudyn_cable": [
        *(("cantilever", n) for n in (5, 10, 20, 50, 100, 200)),
        *(("bend", n) for n in (30, 60, 120)),
    ],
    "exudyn_plain": [*(("bend", n) for n in (30, 60, 120))],
    "pypbd_rod": [*(("cantilever", n) for n in (20, 50, 100)), *(("bend", n) for n in (30, 60, 120))],
    "pyelastica_rod": [("cantilever", 20), ("cantilever", 50), ("bend", 30), ("bend", 60)],
    "mujoco_cable": [("cantilever", 20), ("cantilever", 50), ("bend", 30), ("bend", 60)],
}
QUICK_WORK = (("cantilever", 20), ("bend", 30))
SUB_STEPS = (1, 2, 3, 4, 8)


def missing(distribution: str) -> str:
    """A sentence where a rival is not installed, else its version."""
    try:
        return version(distribution)
    except PackageNotFoundError:
        return ""


def run_peers(*, quick: bool = False, say: Callable[[str], None] = lambda _: None) -> pd.DataFrame:
    """One row per simulator, scene and number of segments; those that are not installed are named and left out."""
    rows = []
    for adapter, task in _tasks(quick, say):
        answer = ask(adapter, *task)
        if "error" in answer:
            say(f"{adapter} {' '.join(map(str, task))}: no answer: {answer['error']}")
            continue
        row = row_of(answer, *task)
        rows.append(row)
        say(
            f"{row['method']:20s} {row['scene']:10s} n {row['joints']:4d}  {row['ms_per_step']:10.4f} ms per step "
            f"(last {row['ms_last_step']:.4f})  shape {row['shape_error_mm']:.5f} mm  tip {row['tip_error_mm']:.5f} mm"
            f"  {row['steps']} steps  callback {100 * row['callback_share']:.0f} %"
        )
    return pd.DataFrame(rows)


def _tasks(quick: bool, say: Callable[[str], None]) -> Iterator[tuple[str, tuple[str, int, int]]]:
    for adapter, work in WORK.items():
        if adapter in ADAPTERS and not missing(ADAPTERS[adapter]):
            say(f"{ADAPTERS[adapter]}: not installed, left out; pip install 'wireval[peers]' brings it")
            continue
        for scene, n in QUICK_WORK if quick else work:
            yield adapter, (scene, n, 1)
        if adapter in (OURS, "exudyn_cable") and not quick:
            for count in SUB_STEPS[1:]:
                yield adapter, ("bend", 60, count)


def ask(adapter: str, scene: str, n: int, per_mm: int, limit_s: float = LIMIT_S) -> dict[str, Any]:
    """Run one piece of work in a process of its own with one thread; ``error`` is a sentence where it fails."""
    command = [sys.executable, "-m", "pipeline.benchmark.peers.worker", adapter, scene, str(n), str(per_mm)]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    try:
        done = subprocess.run(
            command,
            env={**os.environ, **threads},
            capture_output=True,
            text=True,
            timeout=limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return {"error": f"none within {limit_s:g} s"}
    line = done.stdout.strip().rpartition("\n")[2]
    if done.returncode != 0 or not line.startswith("{"):
        return {"error": done.stderr.strip().rpartition("\n")[2] or f"exit code {done.returncode}"}
    answer: dict[str, Any] = json.loads(line)
    return answer
