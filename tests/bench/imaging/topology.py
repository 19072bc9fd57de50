"""Gaps, crossings in contact, parallel turns: how many are right, and whether a wrong one says so."""

from __future__ import annotations

from collections import Counter

import numpy as np
from scipy import ndimage

from pipeline.model import Lumen, Volume
from pipeline.trace import trace
from solver.grid import Grid
from tests.pipeline import phantoms, tangles


def tally(seeds, cnr=8.0):
    """Counts by kind: all, right, wrong and not flagged, right but flagged."""
    counts: dict[str, Counter] = {}
    for seed in seeds:
        _, outcome = tangles.run(seed, cnr)
        c = counts.setdefault(outcome.kind, Counter())
        c["all"] += 1
        c["right"] += outcome.right
        c["wrong, unflagged"] += not outcome.right and not outcome.flagged
        c["right, flagged"] += outcome.right and outcome.flagged
    return counts


def contact(seeds, pitch_voxels=1.4):
    """Coils whose turns touch, traced from a previous curve that is off by half a voxel: right ones."""
    right = flagged = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        wire = tangles.coil(rng, pitch_voxels * tangles.VOXEL)
        wander = ndimage.gaussian_filter1d(rng.normal(size=wire.points.shape), 60, axis=0)
        wander *= 0.5 * tangles.VOXEL / np.sqrt(np.mean(np.sum(wander**2, axis=1)))
        previous = (wire.points + wander)[20:-60:6]
        _, outcome = tangles.run(seed, wire=wire, previous=previous)
        right += outcome.right
        flagged += not outcome.right and outcome.flagged
    return right, flagged


def plain(seed):
    """A wandering wire without gaps or crossings."""
    return tangles.Tangle("plain", phantoms.random_curve(50_000 + seed, length=36.0, bend=0.05))


def earlier(seed, wire, aside_mm=0.0):
    """The curve of the frame before: 6 mm shorter, half a voxel off (smooth), or the whole of it aside by so much."""
    rng = np.random.default_rng(seed)
    wander = ndimage.gaussian_filter1d(rng.normal(size=wire.points.shape), 60, axis=0)
    wander *= 0.5 * tangles.VOXEL / np.sqrt(np.mean(np.sum(wander**2, axis=1)))
    across = np.cross(wire.points[-1] - wire.points[0], rng.normal(size=3))
    return (wire.points + wander + aside_mm * across / np.linalg.norm(across))[20:-120:6]


def low_contrast(seeds, cnr, prior):
    """Right, wrong with a status and wrong without one, and the statuses, of plain wires with one kind of prior."""
    counts, statuses = Counter(), Counter()
    for seed in seeds:
        wire = plain(seed)
        previous = {"none": None, "right": earlier(seed, wire), "wrong": earlier(seed, wire, 2.0)}[prior]
        curve, outcome = tangles.run(seed, cnr, wire=wire, previous=previous)
        statuses[curve.status.name] += 1
        counts["right, ok"] += outcome.right and not outcome.flagged
        counts["right, flagged"] += outcome.right and outcome.flagged
        counts["wrong, flagged"] += not outcome.right and outcome.flagged
        counts["wrong, unflagged"] += not outcome.right and not outcome.flagged
    return counts, statuses


def empty_frames(seeds):
    """Statuses of frames without any wire."""
    found = Counter()
    for seed in seeds:
        shape = (60, 60, 60)
        frame, reference = (
            Volume(phantoms.scan(np.full(shape, 1000.0), 0.8, 100.0, 2 * seed + n), [0.3] * 3) for n in (0, 1)
        )
        distance = Grid(np.full(shape, -2.0, np.float32), [0.3] * 3)
        lumen = Lumen(distance)
        found[trace(frame, lumen, [9, 9, 0.5], [0, 0, 1], reference=reference).status.name] += 1
    return found


def report(quick):
    """Print the table."""
    seeds = range(400, 430 if quick else 600)
    print(
        f"\n## Topology at CNR 8: {len(seeds)} wires, seeds {seeds.start}-{seeds.stop - 1} "
        "(bar: 98 % right, none wrong unflagged)"
    )
    counts = tally(seeds)
    for kind, c in counts.items():
        print(
            f"   {kind:9s} "
            + "  ".join(f"{name} {c[name]}" for name in ("all", "right", "wrong, unflagged", "right, flagged"))
        )
    total = sum(counts.values(), Counter())
    print(
        f"   together  {100 * total['right'] / total['all']:.1f} % right, "
        f"{total['wrong, unflagged']} wrong and unflagged"
    )
    few = range(400, 404 if quick else 412)
    right, flagged = contact(few)
    print(
        f"   turns in contact (1.4 voxels) from the previous frame: {right} of {len(few)} right, "
        f"{flagged} wrong but flagged"
    )
    faint = range(720, 724 if quick else 732)
    print(f"   low contrast, plain wires of seeds {faint[0]}-{faint[-1]}; a previous curve is 6 mm short and")
    print("   half a voxel off (right) or 2 mm aside (wrong); it counts where its crest stands 3 sigmas out on 95 %")
    print("   of it and ends where the curve does")
    print("   CNR  previous  right, ok  right, flagged  wrong, flagged  wrong, unflagged  statuses")
    for cnr in (3.0, 2.5, 2.0, 1.5):
        for prior in ("none", "right", "wrong"):
            c, statuses = low_contrast(faint, cnr, prior)
            print(
                f"   {cnr:.1f}  {prior:8s}  {c['right, ok']:9d}  {c['right, flagged']:14d}  "
                f"{c['wrong, flagged']:14d}  {c['wrong, unflagged']:16d}  {dict(statuses)}"
            )
    print(f"   frames without wire: {dict(empty_frames(few))}")
