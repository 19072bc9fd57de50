"""How many scenes of each temptation are traced right, refused, or wrong and called ok.

``python -m tests.studies.seeing.table`` (make seeing): 34 seeds of each case, from 300 up.
``--seeds 0:8 --only gap --say`` while tuning.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from pipeline.segment import segment
from pipeline.status import FrameStatus, StageError
from pipeline.trace import trace
from tests.studies.seeing import render
from tests.studies.seeing.scenes import CASES

MEAN, WORST, TIP, BRIDGED = 0.35, 2.0, 1.5, 4.0
"""Voxels: mean and largest error of points that are not flagged, of the tip, and largest of flagged points; the
mean of a wire fainter than six noises may be twice that."""
MISSING = 0.05
"""Share of the vessel's axis outside the lumen that nobody may pass over in silence."""


@dataclass
class Row:
    """One scene: right, and what was said. across, tip : errors over their stated standard deviation."""

    case: str
    seed: int
    verdict: str = ""
    status: str = ""
    text: str = ""
    across: float = float("nan")
    tip: float = float("nan")
    mean: float = float("nan")
    wall: float = float("nan")
    levels: dict = field(default_factory=dict)


def on_wire(curve, scene):
    """Whether the curve is the wire, in words where it is not; and its mean error, voxels."""
    h, true = scene.voxel, scene.wire
    points, flagged = curve.points_mm, np.asarray(curve.flagged)
    if len(points) < 2:
        return "no curve", np.nan
    fine = cKDTree(render.even(true, 0.02))
    off = fine.query(points)[0] / h
    length = render.arc_of(true)[-1]
    tip = np.linalg.norm(points[-1] - true[-1]) / h
    allowed = max(TIP, 4.4 / scene.tip_cnr)  # four standard deviations of the best there is
    seen = cKDTree(render.even(points, 0.05) if len(points) > 4 else points).query(true)[0] < 2.5 * h
    arc = render.arc_of(true)
    for a, b in scene.gaps:
        seen |= (arc > a - 1) & (arc < b + 1)
    wrong = []
    # what lies beyond the true tip is the tip's error, which has its own bound
    sure = off[~flagged & ((points - true[-1]) @ (true[-1] - true[-8]) <= 0)]
    if len(sure) and (sure.mean() > MEAN * (2 if scene.cnr < 6 else 1) or sure.max() > WORST):
        wrong.append(f"mean {sure.mean():.2f}, worst {sure.max():.2f} voxel")
    if flagged.any() and off[flagged].max() > BRIDGED:
        wrong.append(f"bridge {off[flagged].max():.1f} voxel off")
    if seen.mean() < 0.98 or abs(render.arc_of(points)[-1] - length) > 3 * h + 0.03 * length:
        wrong.append(f"{render.arc_of(points)[-1]:.1f} of {length:.1f} mm")
    if tip > allowed:
        wrong.append(f"tip {tip:.1f} voxel off")
    return ", ".join(wrong), float(sure.mean()) if len(sure) else np.nan


def pulls(curve, scene):
    """Root mean square error across the wire, per axis, over the stated sigma; the tip's along it over its own."""
    true = render.even(scene.wire, 0.01)
    near = cKDTree(true).query(curve.points_mm)[1]
    t = np.gradient(true, axis=0)[near]
    t /= np.linalg.norm(t, axis=1)[:, None]
    off = curve.points_mm - true[near]
    off -= np.sum(off * t, axis=1)[:, None] * t
    sure = ~np.asarray(curve.flagged)
    sure[-2:] = False
    share = np.sum(off**2, axis=1) / 2 / curve.sigma_mm**2
    tip = float((curve.points_mm[-1] - true[-1]) @ t[-1] / curve.tip_sigma_mm)
    return float(np.sqrt(np.mean(share[sure]))) if sure.any() else np.nan, tip


def lumen_faults(lumen, scene):
    """What is wrong with the lumen, in words: vessel missing, or too much; and its wall's RMS, voxel."""
    grid, h = lumen.distance, scene.voxel
    wide = scene.radius > 1.5 * h
    # the vessel's two ends are cut off by the scan or round; nobody asks for them
    inner = slice(40, -40)
    axis = scene.axis[inner][wide[inner]]
    size = np.array(scene.frame.shape)
    inside = np.all((scene.frame.to_index(axis) > 2) & (scene.frame.to_index(axis) < size - 3), axis=1)
    axis = axis[inside]
    index = np.rint(grid.to_index(axis)).astype(int)
    held = np.all((index >= 0) & (index < np.array(grid.shape)), axis=1)
    depth = np.full(len(axis), np.inf)
    depth[held] = grid.values[tuple(index[held].T)]
    missing = float(np.mean(depth > 0))
    volume = float(np.sum(grid.values < 0) * np.prod(grid.spacing_mm))
    expected = float(np.sum(np.pi * scene.radius**2) * 0.05)
    words = []
    if missing > MISSING:
        words.append(f"{100 * missing:.0f} % of the vessel missing")
    if volume > 1.3 * expected + 15.0:
        words.append(f"{volume / expected:.1f} times its volume")
    near = np.argwhere(np.abs(grid.values) < 0.5 * h)[::7]
    away, at = cKDTree(scene.axis).query(grid.to_mm(near))
    own = (away < scene.radius[at] + 2 * h) & (at > 40) & (at < len(scene.axis) - 40)
    error = (grid.values[tuple(near.T)] - (away - scene.radius[at]))[own]
    return ", ".join(words), float(np.sqrt(np.mean(error**2))) / h if len(error) else np.nan


LUMENS = (
    "stenosis", "stenosis, no reference", "contrast that decays by 60 %", "layered filling", "bone that touches",
    "contrast that has settled", "0.9 mm wire, voxels of 0.1 to 0.3 mm, no reference",
)  # fmt: skip


def scene_of(name, seed):
    """A scene of a case."""
    return CASES[name](np.random.default_rng([seed, list(CASES).index(name)]), seed)


def seen(scene, **otherwise):
    """The lumen and the curve of a scene. otherwise : what the manifest says instead."""
    radius = None if scene.reference else scene.wire_radius
    lumen = segment(scene.reference or scene.frame, scene.entry[None], wire_radius_mm=radius)
    stated = scene.stated | otherwise
    return lumen, trace(scene.frame, lumen, scene.entry, scene.direction, reference=scene.reference, **stated)


def found(name, seed, **otherwise):
    """A scene, its lumen and its curve. otherwise : what the manifest says instead."""
    scene = scene_of(name, seed)
    return scene, *seen(scene, **otherwise)


def look(name, seed, **otherwise):
    """One scene through segment and trace."""
    try:
        return row_of(name, seed, *found(name, seed, **otherwise))
    except StageError as error:
        return Row(name, seed, "refused", "SEGMENT_FAILED", str(error))


def row_of(name, seed, scene, lumen, curve):
    """What became of a scene."""
    row = Row(name, seed)
    row.status, row.text, row.levels = curve.status.name, curve.note, dict(curve.levels) | dict(curve.counters)
    fault, row.wall = lumen_faults(lumen, scene) if name in LUMENS else ("", np.nan)
    ok = curve.status is FrameStatus.OK
    if scene.wire is None:
        right = curve.status in (FrameStatus.NO_WIRE, FrameStatus.TRACE_LOW_CONTRAST)
        row.verdict = "right" if right else "wrong and ok" if ok else "refused"
        row.text = f"{curve.length_mm:.1f} mm of wire; {row.text}"
        return row
    wrong, row.mean = on_wire(curve, scene)
    silent = fault and not lumen.warnings and ok
    if not wrong and len(curve.points_mm):
        row.across, row.tip = pulls(curve, scene)
    row.verdict = "wrong and ok" if ok and (wrong or silent) else "right" if ok else "refused"
    row.text = "; ".join(t for t in (wrong, fault, *lumen.warnings, row.text) if t)
    if row.verdict == "refused" and not wrong:
        row.text = "though right: " + row.text
    return row


def line(name, rows):
    n = Counter(x.verdict for x in rows)
    good = sum(x.verdict == "refused" and x.text.startswith("though right") for x in rows)
    pull = np.nanmedian([x.across for x in rows]) if any(np.isfinite(x.across) for x in rows) else np.nan
    tip = np.array([x.tip for x in rows if np.isfinite(x.tip)])
    tips = np.median(np.abs(tip)) / 0.6745 if len(tip) else np.nan
    mean = np.nanmedian([x.mean for x in rows]) if any(np.isfinite(x.mean) for x in rows) else np.nan
    wall = np.nanmedian([x.wall for x in rows]) if any(np.isfinite(x.wall) for x in rows) else np.nan
    cells = [f"{v:6.2f}" if np.isfinite(v) else "     -" for v in (mean, pull, tips, wall)]
    return (
        f"   {name:42s} {len(rows):4d} {n['right']:6d} {n['refused']:8d} {good:8d} {n['wrong and ok']:8d}  "
        + " ".join(cells)
    )


def main(arguments):
    """Print the table; exit code 1 where something is wrong and ok."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="300:334")
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--say", action="store_true", help="one line a scene that is not right")
    given = parser.parse_args(arguments)
    seeds = range(*map(int, given.seeds.split(":")))
    names = [n for n in CASES if any(part in n for part in given.only.split("|"))]
    work = [(n, s) for n in names for s in seeds]
    print(
        f"## Seeing: {len(work)} traces, seeds {seeds.start}-{seeds.stop - 1}; "
        "mean and wall in voxels, pulls = error over sigma"
    )
    print(
        f"   {'case':42s} {'all':>4s} {'right':>6s} {'refused':>8s} {'(right)':>8s} {'wrong,ok':>8s}"
        "    mean   pull    tip   wall"
    )
    rows = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for row in pool.map(partial(_look), work, chunksize=2):
            rows.append(row)
            if given.say and row.verdict != "right":
                print(f"      {row.case} {row.seed}: {row.verdict} {row.status}: {row.text[:220]}", flush=True)
            if row.seed == seeds[-1]:
                print(line(row.case, [x for x in rows if x.case == row.case]), flush=True)
    print(line("together", rows))
    return int(any(x.verdict == "wrong and ok" for x in rows))


def _look(job):
    return look(*job)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
