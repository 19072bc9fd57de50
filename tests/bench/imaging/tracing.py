"""Tracing error against contrast over noise, its limit, and two chains from scikit-image on the same frames."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field

import numpy as np

from pipeline.segment import segment
from pipeline.trace import trace
from tests.bench.imaging.rivals import RIVALS
from tests.bench.imaging.scenes import errors, pulls, scene, volumes

CNRS = (16, 8, 4)
BARS = {16: (0.04, 0.2), 8: (0.07, 0.35), 4: (0.13, 0.55)}
"""Mean and median tip error that are asked for, voxel."""
KINDS = (
    ("white, one scan", 0.0, True, False),
    ("correlated 0.8", 0.8, True, False),
    ("white, none", 0.0, False, False),
    ("none, uneven", 0.0, False, True),
)
"""Noise and reference in words, correlation length (voxel), is a reference given, is the contrast uneven."""
SEEDS = range(300, 308)
RIVAL_SEEDS = 2


@dataclass
class Cell:
    """What one method gave at one contrast: errors (voxel) a seed, pulls, CPU seconds, statuses."""

    rows: list = field(default_factory=list)
    across: list = field(default_factory=list)
    tips: list = field(default_factory=list)
    seconds: list = field(default_factory=list)
    status: Counter = field(default_factory=Counter)

    def line(self, name, cnr):
        """One line of the table."""
        odd = {k: v for k, v in self.status.items() if k != "OK"}
        if not self.rows:
            return f"   {name:20s} {cnr:4d}  {odd}"
        got = np.array(self.rows)
        mean, p95, _, cover = got.mean(axis=0)
        tip, worst = np.median(got[:, 2]), got[:, 2].max()
        text = f"   {name:20s} {cnr:4d}  {mean:.3f}  {p95:.3f}  {tip:.3f}  {worst:5.2f}  {cover:.4f} "
        if self.across:
            pull, tip = np.concatenate(self.across).std(), np.sqrt(np.mean(np.square(self.tips)))
            text += f" {pull:.2f}   {tip:.2f}     {1.25 * 0.8 / (cnr * np.sqrt(8)):.3f}"
        else:
            text += " " * 21
        return f"{text}  {np.median(self.seconds):6.3f}  {len(got)}" + (f"  {odd}" if odd else "")


def timed(cell, s, work):
    """Run ``work``; note its CPU time, and its points' errors where there are points."""
    start = time.process_time()
    points = work()
    cell.seconds.append(time.process_time() - start)
    if points is not None and len(points):
        cell.rows.append(errors(points, s))


def traced(cell, s, frame, reference):
    """The traced curve into the cell: with a reference, or with the lumen from the frame itself and nothing else."""
    lumen = segment(reference or frame, s.entry[None])
    found = []

    def work():
        found.append(trace(frame, lumen, s.entry, s.direction, reference=reference))
        return found[0].points_mm

    timed(cell, s, work)
    curve = found[0]
    cell.status[curve.status.name] += 1
    if len(curve.points_mm):
        a, t = pulls(curve, s)
        cell.across.append(a)
        cell.tips.append(t)
    return lumen


def measure(side, seeds, rivals, kinds=KINDS):
    """Cells by (method, CNR) over the seeds; the rivals, far slower, on the first ``rivals`` seeds alone."""
    cells = defaultdict(Cell)
    for seed in seeds:
        for uneven in {k[3] for k in kinds}:
            s = scene(seed, side, uneven)
            for label, correlation, given, _ in [k for k in kinds if k[3] == uneven]:
                for cnr in CNRS:
                    frame, reference = volumes(s, cnr, correlation)
                    lumen = traced(cells[label, cnr], s, frame, reference if given else None)
                    if label == KINDS[0][0] and seed - seeds[0] < rivals:
                        compete(cells, cnr, s, frame, lumen)
    return cells


def compete(cells, cnr, s, frame, lumen):
    """The rivals on the same frame."""
    for name, chain in RIVALS.items():
        timed(cells[name, cnr], s, lambda c=chain: c(s, frame, lumen))


def report(quick):
    """Print the table."""
    side = 128 if quick else 256
    seeds, rivals = (SEEDS[:4] if quick else SEEDS), RIVAL_SEEDS
    print(
        f"\n## Tracing, {side}^3 frames of 0.3 mm, 0.4 mm wire, PSF 0.8 voxel, "
        f"seeds {seeds[0]}-{seeds[-1]} (rivals: the first {rivals}); errors in voxels"
    )
    bars = "  ".join(f"{cnr}: {mean} / {tip}" for cnr, (mean, tip) in BARS.items())
    print(f"   bars at CNR  {bars}  (mean / median tip), cover 0.99, pull 0.8-1.25")
    print("   limit: mean 2-D error of a line fit with knots every 8 voxels, 1.25 * 0.8 / (CNR sqrt 8)")
    print("   none: no reference scan, lumen and background from the frame itself; uneven: contrast that fades by")
    print("   a quarter along the vessel and is mottled by 4 %. Rivals: threshold half way up, skeleton, longest path;")
    print("   Sato filter on the lumen's box (on the frame it would take minutes), cheapest path to the TRUE tip")
    print("   method or noise       CNR   mean   p95    tip  worst   cover   pull  tip pull  limit    CPU s  frames")
    for (name, cnr), cell in sorted(measure(side, seeds, rivals).items(), key=_order):
        print(cell.line(name, cnr))


def _order(item):
    name, cnr = item[0]
    return [label for label, *_ in KINDS].index(name) if name not in RIVALS else 0.5, name, -cnr
