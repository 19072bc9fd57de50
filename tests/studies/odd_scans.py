"""Scans that nobody would scan, through segment, register and trace: a result or a sentence, never an error of Python.

``make bounds`` runs them with every index of compiled code checked (NUMBA_BOUNDSCHECK), which no other test does:
compiled code that reads beyond an array goes on with what lies there.

Slabs of one to three voxels, voxels of 0.05 to 2.5 mm that are no cubes, vessels thinner than a voxel or thicker than
the scan, half outside it, turned axes, one byte a voxel to eight, no noise to more than there is vessel.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.model import Volume
from pipeline.register import anchor, register
from pipeline.segment import segment
from pipeline.status import StageError
from pipeline.trace import trace
from solver.grid import Array

KINDS = ("f4", "i2", "u2", "u1", "f8")
VESSEL, WIRE = 1000.0, 4000.0


@dataclass(frozen=True, eq=False)
class OddScan:
    """A reference and a frame, the wire's place of entry (3,) mm and its direction there."""

    reference: Volume
    frame: Volume
    entry: Array
    direction: Array


def _shape(rng: np.random.Generator) -> tuple[Array, NDArray[np.int64]]:
    spacing = 10.0 ** rng.uniform(-1.3, 0.4, 3) if rng.random() < 0.4 else np.full(3, rng.choice([0.1, 0.3, 0.5, 1.0]))
    size = rng.integers(1, 60, 3) if rng.random() < 0.3 else rng.integers(12, 60, 3)
    if rng.random() < 0.15:
        size[rng.integers(3)] = rng.integers(1, 4)
    return spacing, size


def _stored(grey: Array, kind: str, fortran: bool) -> NDArray[np.generic]:
    """Grey as a scanner may store it; whole numbers are cut off at the ends of their range."""
    if kind[0] == "f":
        stored = grey.astype(kind)
    else:
        ends = np.iinfo(kind)
        shifted = grey / 20.0 if kind == "u1" else grey - 1000.0 * (kind == "i2")
        stored = np.clip(shifted, ends.min, ends.max).astype(kind)
    return np.asfortranarray(stored) if fortran else stored


def odd_scan(seed: int) -> OddScan:
    """One of them: a bent tube that may leave the scan anywhere, and a wire along part of it."""
    rng = np.random.default_rng(seed)
    spacing, size = _shape(rng)
    extent, t = size * spacing, np.linspace(0.0, 1.0, 200)[:, None]
    start, end = extent * rng.uniform(-0.1, 1.1, 3), extent * rng.uniform(-0.1, 1.1, 3)
    bow = rng.normal(size=3) * extent.min() * rng.choice([0.0, 0.3])
    axis = start + (end - start) * t + bow * np.sin(np.pi * t)
    radius = rng.uniform(0.3, 8.0) * spacing.min()
    voxels = (np.indices(size.tolist()).reshape(3, -1).T * spacing).astype(float)
    away = np.asarray(cKDTree(axis).query(voxels)[0]).reshape(size)
    wire = axis[: rng.integers(2, 200)] + 0.2 * radius * rng.normal(size=3)
    off = np.asarray(cKDTree(wire).query(voxels)[0]).reshape(size)
    lumen = VESSEL / (1.0 + np.exp(np.clip((away - radius) / (0.4 * spacing.min()), -50.0, 50.0)))
    line, noise = WIRE * np.exp(-0.5 * (off / (0.7 * spacing.min())) ** 2), rng.choice([0.0, 5.0, 60.0, 300.0])
    kind, fortran = str(rng.choice(KINDS)), rng.random() < 0.2
    turned, origin = np.linalg.qr(rng.normal(size=(3, 3)))[0], 100.0 * rng.normal(size=3)
    axes = turned * np.sign(np.linalg.det(turned)) if rng.random() < 0.3 else np.eye(3)
    reference, frame = (
        Volume(_stored(grey + noise * rng.normal(size=size), kind, fortran), spacing, origin, axes)
        for grey in (lumen, lumen + line)
    )
    first = int(rng.integers(0, 10))
    along = axes @ (axis[first + 5] - axis[first])
    return OddScan(reference, frame, origin + axes @ axis[first], along / np.linalg.norm(along))


def outcome(seed: int) -> str:
    """How the stages end on it: a status by name. What else they raise is a defect."""
    scan, rng = odd_scan(seed), np.random.default_rng([seed, 1])
    known = rng.random() < 0.6
    radius = None if known else 0.5 * float(scan.frame.spacing_mm.min())
    try:
        lumen = segment(scan.reference if known else scan.frame, scan.entry[None], wire_radius_mm=radius)
        if known and rng.random() < 0.5:
            register(scan.frame, anchor(scan.reference, lumen), 0.1)
    except StageError as error:
        return error.status.name
    depth = None if rng.random() < 0.6 else float(rng.uniform(1.0, 100.0))
    reference = scan.reference if known else None
    return trace(scan.frame, lumen, scan.entry, scan.direction, reference=reference, expected_mm=depth).status.name


def main(arguments: list[str]) -> int:
    """Print how often each status comes; exit code 1 where something else was raised."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0:1000")
    first, stop = map(int, parser.parse_args(arguments).seeds.split(":"))
    found: Counter[str] = Counter()
    for seed in range(first, stop):
        try:
            found[outcome(seed)] += 1
        except Exception as error:  # whatever it is, it is counted
            found["RAISED"] += 1
            print(f"seed {seed}: {type(error).__name__}: {error}")
    print(*(f"{count} {name}" for name, count in found.most_common()), sep="\n")
    return int("RAISED" in found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
