"""The rivals one after the other, and this solver in the same run."""

import importlib
import os
import re
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.benchmark.isolate import Lost, alone
from pipeline.benchmark.peers.frame import EI, RivalWire, Task, pushed
from pipeline.benchmark.reference import Reference, reference, resampled, shape_error
from pipeline.model import Array, arc_length

PEERS_CSV = "peers.csv"
LIMIT_S = 300.0
QUICK_SEGMENTS = {"cantilever": 20, "bend": 30}
WARM_SEGMENTS = 6
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
OURS, OUR_METHOD = "wireval", "wireval newton"
TARGET_A = 1e-4
CAVEAT = "Each rival was set up in a short time; an expert of a tool may do better."


def sentences(rows: pd.DataFrame) -> Iterator[str]:
    """Scene A at equal error, scene B at equal joints, sub-steps, and what the wall's callback costs."""
    if rows.empty or OUR_METHOD not in set(rows["method"]):
        return
    plain = rows[rows["steps_per_mm"] == 1]
    yield from _scene_a(plain[plain["scene"] == "cantilever"])
    yield from _scene_b(plain[plain["scene"] == "bend"])
    for name, group in rows[(rows["scene"] == "bend") & (rows["joints"] == 60)].groupby("method", sort=False):
        if len(set(group["steps_per_mm"])) > 1:
            each = (
                f"{row['steps_per_mm']}: {row['bending_uJ']:.4g} µJ bending, {row['shape_error_mm']:.4f} mm off"
                for row in group.to_dict("records")
            )
            yield f"scene B, n = 60, steps per mm: {name}: {', '.join(each)}"
    yield CAVEAT


def _scene_a(rows: pd.DataFrame) -> Iterator[str]:
    """For each rival the least time in which its tip error is within 1e-4 of the length."""
    good = rows[rows["relative_tip_error"] <= TARGET_A]
    best = good.loc[good.groupby("method")["ms_per_step"].idxmin()].set_index("method")
    if OUR_METHOD not in best.index:
        return
    for name, row in best.iterrows():
        ratio = row["ms_per_step"] / best.loc[OUR_METHOD, "ms_per_step"]
        yield (
            f"scene A, tip within {TARGET_A:g} L: {name} n = {row['joints']}: {row['ms_per_step']:.3g} ms, "
            f"{ratio:.3g} times ours (error {row['relative_tip_error']:.2g})"
        )


def _scene_b(rows: pd.DataFrame) -> Iterator[str]:
    """Per step at equal numbers of joints: mean over the insertion, and the last step, where all wires are as long.

    Then against our quickest wire that is no further off than the rival's, where there is one.
    """
    ours = rows[rows["method"] == OUR_METHOD]
    for _, row in rows[rows["method"] != OUR_METHOD].merge(ours, on="joints", suffixes=("", "_ours")).iterrows():
        took, mine, off = row["ms_per_step"], row["ms_per_step_ours"], row["shape_error_mm"]
        last, share = row["ms_last_step"] / row["ms_last_step_ours"], 100 * row["callback_share"]
        text = (
            f"scene B, n = {row['joints']}: {row['method']} {took:.3g} ms per step, {took / mine:.3g} times ours "
            f"({mine:.3g} ms; last step {last:.3g} times), error {off:.4f} mm against "
            f"{row['shape_error_mm_ours']:.4f}; {share:.0f} % of its time is the Python wall"
        )
        good = ours[ours["shape_error_mm"] <= off]
        if not good.empty:
            best = good.loc[good["ms_per_step"].idxmin()]
            text += f"; {took / best['ms_per_step']:.3g} times ours of equal or lower error "
            text += f"(n = {best['joints']}, {best['shape_error_mm']:.4f} mm)"
        yield text


def measure_peers(out: Path, say: Callable[[str], None], *, quick: bool) -> None:
    """Rivals on scenes A and B, and this solver in the same run: a row for each, scene and number of segments.

    Those that are not installed, or have no answer, are named and left out.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))  # of the processes that are started here
    rows = []
    for module, number, task in _work(quick, say):
        row = ask(module, number, task)
        if isinstance(row, Lost):
            say(f"{module} {task.scene} {task.n} {task.per_mm}: no answer: {row.reason}")
            continue
        rows.append(row)
        say(
            f"{row['method']:20s} {row['scene']:10s} n {row['joints']:4d}  {row['ms_per_step']:10.4f} ms per step "
            f"(last {row['ms_last_step']:.4f})  shape {row['shape_error_mm']:.5f} mm  tip {row['tip_error_mm']:.5f} mm"
            f"  {row['steps']} steps  callback {100 * row['callback_share']:.0f} %"
        )
    table = pd.DataFrame(rows)
    table.to_csv(out / PEERS_CSV, index=False)
    for line in sentences(table):
        say(line)


def _work(quick: bool, say: Callable[[str], None]) -> Iterator[tuple[str, int, Task]]:
    """The tasks of this solver and of all that the extra [peers] pins, in its order.

    Each is a file, the number of the rival in it and its task. A rival's file is named after its distribution, in lower
    case. The file itself says what it is asked, and only a separate process imports it.
    """
    pinned = [line for line in requires(OURS) or () if re.search(r"extra == .peers", line)]
    for name in (OURS, *(re.split(r"[^\w.-]", line)[0] for line in pinned)):
        try:
            version(name)
        except PackageNotFoundError:
            say(f"{name}: not installed, left out; pip install 'wireval[peers]' brings it")
            continue
        found = alone("spawn", partial(_tasks, name.lower(), quick), LIMIT_S)
        if isinstance(found, Lost):
            say(f"{name.lower()}: no answer: {found.reason}")
            continue
        yield from ((name.lower(), number, task) for number, task in found)


def ask(module: str, number: int, task: Task) -> dict[str, Any] | Lost:
    """The row of a rival, made in a process of its own; Lost where that gives no answer."""
    return alone("spawn", partial(_row, module, number, task, reference(task.set_up)), LIMIT_S)


def _rivals(module: str) -> tuple[type[RivalWire], ...]:
    """The rivals of a file; what they print is lost."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    return tuple(importlib.import_module(f"pipeline.benchmark.peers.rivals.{module}").RIVALS)


def _tasks(module: str, quick: bool) -> list[tuple[int, Task]]:
    """All that is asked of the rivals of a file, with their numbers; ``quick`` is one task a scene."""
    found = []
    for number, rival in enumerate(_rivals(module)):
        segments = {"cantilever": rival.segments_a, "bend": rival.segments_b}
        tasks = [Task(scene, n) for scene, tried in segments.items() for n in tried]
        tasks += [Task("bend", 60, per_mm) for per_mm in rival.per_mm if per_mm > 1]
        if quick:
            tasks = [Task(scene, QUICK_SEGMENTS[scene]) for scene, tried in segments.items() if tried]
        found += [(number, task) for task in tasks]
    return found


def _row(module: str, number: int, task: Task, limit: Reference) -> dict[str, Any]:
    """A row with the columns of the benchmark's table and what the peers' own table adds.

    A short insertion runs first, so that loading and compiling are not timed.
    """
    rival, length = _rivals(module)[number], limit.arcs_mm[-1]
    pushed(rival, Task(task.scene, WARM_SEGMENTS), 2)
    runs = [pushed(rival, task) for _ in range(rival.repeats)]
    wire, seconds = runs[-1][0], np.median([seconds for _, seconds in runs], axis=0)
    points, total = wire.points(), float(seconds.sum())
    # counted back from the tip: a node before the clamp falls away
    arcs = arc_length(points)
    shape, tip = shape_error(resampled(points, arcs - arcs[-1] + length, limit.arcs_mm), limit.points_mm)
    steps = f"{wire.steps} steps" if len(seconds) == 1 else f"{wire.steps / len(seconds):.0f} steps per push"
    return {
        "scene": task.scene,
        "method": wire.name,
        "segment_mm": length / task.n,
        "hull": "offset",
        "tolerance": float("nan"),
        "ms_per_mm": 1e3 * total / length,
        "tip_error_mm": tip,
        "shape_error_mm": shape,
        "iterations": float("nan"),
        "joints": task.n,
        "steps_per_mm": task.per_mm,
        "steps": len(seconds),
        "ms_per_step": 1e3 * float(seconds.mean()),
        "ms_last_step": 1e3 * float(seconds[-1]),
        "relative_tip_error": tip / length,
        "bending_uJ": 1e3 * bending_energy(points),
        "callback_share": wire.wall_seconds / total if wire.wall_seconds else float("nan"),
        "status": wire.status,
        "note": wire.note.format(steps=steps),
        "reference_uncertainty_mm": limit.uncertainty_mm,
    }


def bending_energy(points: Array) -> float:
    """Bending energy of a polyline, N mm, by the turn at its nodes: tells a folded wire from a bent one."""
    along = np.diff(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    unit = along / length[:, None]
    turn = np.arctan2(np.linalg.norm(np.cross(unit[:-1], unit[1:]), axis=1), np.einsum("na,na->n", unit[:-1], unit[1:]))
    return float(0.5 * EI * np.sum(turn**2 / (0.5 * (length[:-1] + length[1:]))))
