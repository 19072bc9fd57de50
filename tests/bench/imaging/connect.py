"""Fuzzy connectedness beside what SimpleITK and scikit-image offer: time and agreement, one run."""

from __future__ import annotations

import time

import numpy as np
import SimpleITK as sitk
from skimage.segmentation import flood as skimage_flood

from pipeline.segment.affinity import Levels, estimate_affinity
from pipeline.segment.connect import connect, neighbours, strength_map
from solver.grid import Grid

LEVELS = Levels(1000.0, 100.0, 50.0)


def tortuous(side, span=None):
    """A bright tortuous tube of about 1 % of ``span``^3 in the middle of ``side``^3, in even noise."""
    span = span or side
    rng = np.random.default_rng(100)
    values = np.full((side, side, side), 100, np.int16)
    values += rng.integers(-60, 60, values.shape, dtype=np.int16)
    t = np.linspace(0, 6 * np.pi, 4000)
    centre = side / 2 + 0.32 * span * np.stack([np.cos(t), np.sin(t), t / (3 * np.pi) - 1], axis=1)
    radius = 0.0205 * span
    reach = int(radius) + 2
    offset = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    ball = offset[np.sum(offset**2, axis=1) <= radius**2]
    cells = np.unique(np.rint(centre).astype(int), axis=0)
    for cell in cells:
        i, j, k = (cell + ball).T
        values[i, j, k] = 1000 + rng.integers(-60, 60, len(ball), dtype=np.int16)
    return values, cells[len(cells) // 2][None], np.rint(centre[0]).astype(int)[None]


def best_of(action, repeats=3):
    """Least CPU time of some runs, s, and the last result."""
    best, result = np.inf, None
    for _ in range(repeats):
        start = time.process_time()
        result = action()
        best = min(best, time.process_time() - start)
    return best, result


def _dice(a, b):
    return 2 * np.logical_and(a, b).sum() / (a.sum() + b.sum())


def compare(side):
    """Rows (name, seconds, Dice with ours) at one volume size."""
    values, _, seed = tortuous(side)
    grid = Grid(values)
    plain, smoothed = estimate_affinity(LEVELS, scale=0), estimate_affinity(LEVELS, scale=1)
    offsets = neighbours(6)
    connect(Grid(values[:40, :40, :40].copy()), np.array([[5, 5, 5]]), plain, 0.5, offsets)
    t_flood, (order, _) = best_of(lambda: connect(grid, seed, plain, 0.5, offsets))
    t_smooth, _ = best_of(lambda: connect(grid, seed, smoothed, 0.5, offsets), 2)
    t_queue, _ = best_of(lambda: strength_map(grid, seed, plain, 0.5, offsets), 2)
    mask = np.zeros(values.size, bool)
    mask[order] = True
    mask = mask.reshape(values.shape)
    image = sitk.GetImageFromArray(values.transpose(2, 1, 0))
    point = [[int(c) for c in seed[0]]]
    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    t_ct, ct = best_of(lambda: sitk.ConnectedThreshold(image, point, 550, 3000))
    t_cc, cc = best_of(lambda: sitk.ConfidenceConnected(image, point, 2, 4.0, 2, 1), 1)
    rows = [
        ("fuzzy connectedness, flood", t_flood, 1.0),
        ("fuzzy connectedness, flood, smoothed 0.7", t_smooth, np.nan),
        ("fuzzy connectedness, bucket queue", t_queue, np.nan),
        ("SimpleITK ConnectedThreshold", t_ct, _dice(mask, sitk.GetArrayFromImage(ct).T > 0)),
        ("SimpleITK ConfidenceConnected", t_cc, _dice(mask, sitk.GetArrayFromImage(cc).T > 0)),
    ]
    if side <= 256:
        t_fl, fl = best_of(lambda: skimage_flood(values, tuple(point[0]), tolerance=450), 1)
        rows.append(("skimage flood (tolerance)", t_fl, _dice(mask, fl)))
    return rows, len(order) / values.size, t_flood / t_ct, t_smooth / t_ct


def embedded(sides=(256, 640)):
    """CPU seconds for one object (1 % of 256^3) in volumes of two sizes."""
    out = []
    for side in sides:
        values, _, seed = tortuous(side, 256)
        grid, tables = Grid(values), estimate_affinity(LEVELS, scale=0)
        out.append(best_of(lambda g=grid, s=seed, t=tables: connect(g, s, t, 0.5, neighbours(6)), 4)[0])
        del values, grid
    return out


def report(quick):
    """Print the table."""
    print(
        "\n## Fuzzy connectedness: CPU seconds, one thread, one run (identity with max-min Dijkstra and with"
    )
    print("   reconstruction on every voxel: tests/pipeline/test_segment_connect.py)")
    for side in (256,) if quick else (256, 512):
        rows, share, ratio, smooth_ratio = compare(side)
        bar = 1.0 if side == 256 else 0.5
        print(f"{side}^3, object {100 * share:.2f} %: over ConnectedThreshold {ratio:.2f} (bar {bar}), "
              f"smoothed {smooth_ratio:.2f}")  # fmt: skip
        for name, seconds, dice in rows:
            print(f"  {name:42s} {seconds:7.3f} s   Dice with ours {dice:.3f}")
    small, large = embedded((256, 384) if quick else (256, 640))
    print(f"one object inside 256^3 and {384 if quick else 640}^3: {small:.4f} and {large:.4f} s, "
          f"ratio {large / small:.2f} (bar 1.8)")  # fmt: skip
