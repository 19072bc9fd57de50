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


def low_contrast(seeds, cnr):
    """Statuses of straight-ish wires at a contrast too low to be traced."""
    return Counter(tangles.run(seed, cnr, kind=0)[0].status.name for seed in seeds)


def empty_frames(seeds):
    """Statuses of frames without any wire."""
    found = Counter()
    for seed in seeds:
        shape = (60, 60, 60)
        frame, reference = (
            Volume(phantoms.scan(np.full(shape, 1000.0), 0.8, 100.0, 2 * seed + n), [0.3] * 3) for n in (0, 1)
        )
        distance = Grid(np.full(shape, -2.0, np.float32), [0.3] * 3)
        lumen = Lumen(distance, distance.with_values(np.ones(shape, np.uint8)))
        found[trace(frame, lumen, [9, 9, 0.5], [0, 0, 1], reference=reference).status.name] += 1
    return found


def report(quick):
    """Print the table."""
    seeds = range(100, 130 if quick else 300)
    print(
        f"\n## Topology at CNR 8: {len(seeds)} wires, seeds {seeds.start}-{seeds.stop - 1} "
        "(bar: 98 % right, none wrong unflagged)"
    )
    counts = tally(seeds)
    for kind, c in counts.items():
        print(
            f"   {kind:9s} "
            + "  ".join(
                f"{name} {c[name]}" for name in ("all", "right", "wrong, unflagged", "right, flagged")
            )
        )
    total = sum(counts.values(), Counter())
    print(
        f"   together  {100 * total['right'] / total['all']:.1f} % right, "
        f"{total['wrong, unflagged']} wrong and unflagged"
    )
    few = range(100, 104 if quick else 112)
    right, flagged = contact(few)
    print(
        f"   turns in contact (1.4 voxels) from the previous frame: {right} of {len(few)} right, "
        f"{flagged} wrong but flagged"
    )
    for cnr in (2.0, 1.5):
        print(f"   CNR {cnr}: {dict(low_contrast(few, cnr))}")
    print(f"   frames without wire: {dict(empty_frames(few))}")
