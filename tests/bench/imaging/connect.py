"""Fuzzy connectedness beside what SimpleITK and scikit-image offer: time and agreement, one run."""

from __future__ import annotations

import time
from functools import partial

import numpy as np
import SimpleITK as sitk
from skimage.segmentation import flood as skimage_flood

from pipeline.segment.config import SegmentConfig
from pipeline.segment.connect import connect, estimate_affinity, neighbours, strength_list
from pipeline.segment.levels import GreyLevels
from solver.grid import Grid

LEVELS = GreyLevels(1000.0, 100.0, 50.0, (50.0, 12.0))
ROUNDS = 4
"""Rounds of all methods in turn, so that a busy machine hits each; the best of each counts."""


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


def _mask(result, values):
    """A boolean volume of what any of the methods returns."""
    if isinstance(result, tuple):
        mask = np.zeros(values.size, bool)
        mask[result[0]] = True
        return mask.reshape(values.shape)
    return result if isinstance(result, np.ndarray) else sitk.GetArrayFromImage(result).T > 0


def methods(values, seed):
    """What is compared: ours as ``segment`` runs it by default, without smoothing, by strength; and the others."""
    grid, config = Grid(values), SegmentConfig()
    ours, plain = estimate_affinity(LEVELS), estimate_affinity(LEVELS, SegmentConfig(scale=0))
    rest = (config.threshold, neighbours(config.adjacency))
    small, corner = Grid(values[:40, :40, :40].copy()), np.array([[5, 5, 5]])
    for search in (connect, strength_list):
        search(small, corner, ours, *rest)
    image = sitk.GetImageFromArray(values.transpose(2, 1, 0))
    point = [[int(c) for c in seed[0]]]
    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    return {
        "fuzzy connectedness, defaults": lambda: connect(grid, seed, ours, *rest),
        "fuzzy connectedness, not smoothed": lambda: connect(grid, seed, plain, *rest),
        "fuzzy connectedness, bucket queue": lambda: strength_list(grid, seed, ours, *rest),
        "SimpleITK ConnectedThreshold": lambda: sitk.ConnectedThreshold(image, point, 550, 3000),
        "SimpleITK ConfidenceConnected": lambda: sitk.ConfidenceConnected(image, point, 2, 4.0, 2, 1),
        "skimage flood (tolerance)": lambda: skimage_flood(values, tuple(point[0]), tolerance=450),
    }


def compare(side):
    """Rows (name, seconds, Dice with ours), the object's share, our three times over ConnectedThreshold's."""
    values, _, seed = tortuous(side)
    actions = methods(values, seed)
    best, results = dict.fromkeys(actions, np.inf), {}
    for _ in range(ROUNDS):
        for name, action in actions.items():
            seconds, results[name] = best_of(action, 1)
            best[name] = min(best[name], seconds)
    names = list(actions)
    own = _mask(results[names[0]], values)
    rows = [(name, best[name], _dice(own, _mask(results[name], values))) for name in names]
    return rows, own.mean(), [best[name] / best["SimpleITK ConnectedThreshold"] for name in names[:3]]


def embedded(sides=(256, 640)):
    """CPU seconds for one object (1 % of 256^3) in volumes of two sizes, as ``segment`` runs it by default."""
    config, tables, best = SegmentConfig(), estimate_affinity(LEVELS), [np.inf] * len(sides)
    made = [tortuous(side, 256) for side in sides]
    for _ in range(ROUNDS):
        for n, (values, _, seed) in enumerate(made):
            search = partial(connect, Grid(values), seed, tables, config.threshold, neighbours(6))
            best[n] = min(best[n], best_of(search, 1)[0])
    return best


def report(quick):
    """Print the table."""
    print("\n## Fuzzy connectedness: CPU seconds, one thread, one run (identity with max-min Dijkstra and with")
    print("   reconstruction on every voxel: tests/pipeline/test_segment_connect.py)")
    for side in (256,) if quick else (256, 512):
        rows, share, (ours, plain, queue) = compare(side)
        bar = 1.0 if side == 256 else 0.5
        print(f"{side}^3, object {100 * share:.2f} %: over ConnectedThreshold {ours:.2f} (bar {bar}); not smoothed "
              f"{plain:.2f}, bucket queue {queue:.2f}")  # fmt: skip
        for name, seconds, dice in rows:
            print(f"  {name:36s} {seconds:7.4f} s   Dice with ours {dice:.3f}")
    far = 384 if quick else 640
    small, large = embedded((256, far))
    print(f"one object inside 256^3 and {far}^3: {small:.4f} and {large:.4f} s, ratio {large / small:.2f} (bar 1.8)")
