"""The picture of the cone-beam study: the same slice by both scanners, one X-ray projection, and what metal adds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from data_synthetic import catalogue
from data_synthetic.geometry import ScanGrid
from data_synthetic.scanner.conebeam import Arc, ConeBeamScanner

Array = NDArray[np.float64]

EDGE = 380  # pixels of a panel
LINE = 26  # pixels of its title
SLAB = 1
"""Slices on either side that are averaged where streaks are shown: noise falls, streaks stay."""


def draw(out: Path, scene: str, seed: int, target: Path) -> None:
    """Four panels of the last frame of OUT/psf and OUT/conebeam."""
    frame = sorted((out / "conebeam" / "frames").iterdir())[-1].name
    scans = {s: _load(out / s / "frames" / frame) for s in ("psf", "conebeam")}
    reference = _load(out / "conebeam" / "reference.mha")
    truth = json.loads((out / "conebeam" / "truth.json").read_text(encoding="utf-8"))["frames"][-1]
    grid = _grid(out / "conebeam" / "reference.mha")
    wire = grid.to_index(truth["points_mm"])
    # streaks lie in planes across the axis of rotation: take the one in which most of the wire runs
    level = int(np.bincount(np.rint(wire[:, 2]).astype(int)).argmax())
    added = scans["conebeam"] - reference
    streaks = added[:, :, max(level - SLAB, 0) : level + SLAB + 1].mean(axis=2)
    panels = [
        ("psf: axial slice through the wire", scans["psf"][:, :, level], (-300.0, 1500.0)),
        ("conebeam: the same slice", scans["conebeam"][:, :, level], (-300.0, 1500.0)),
        ("conebeam: one X-ray projection, -log of the photons", _projection(scene, seed, grid, truth), None),
        ("conebeam: frame minus reference, mean of three slices", streaks, (-250.0, 250.0)),
    ]
    sheet = Image.new("L", (2 * EDGE, 2 * (EDGE + LINE)), 255)
    for k, (title, values, window) in enumerate(panels):
        left, top = (k % 2) * EDGE, (k // 2) * (EDGE + LINE)
        ImageDraw.Draw(sheet).text((left + 6, top + 7), title, fill=0)
        sheet.paste(_panel(values, window), (left, top + LINE))
    target.parent.mkdir(parents=True, exist_ok=True)
    sheet.quantize(24).save(target, optimize=True)


def _load(path: Path) -> Array:
    """Grey values indexed x, y, z."""
    return sitk.GetArrayFromImage(sitk.ReadImage(str(path))).transpose(2, 1, 0).astype(float)


def _grid(path: Path) -> ScanGrid:
    image = sitk.ReadImage(str(path))
    nx, ny, nz = image.GetSize()
    direction = np.array(image.GetDirection()).reshape(3, 3)
    return ScanGrid((nx, ny, nz), np.array(image.GetSpacing()), np.array(image.GetOrigin()), direction)


def _projection(scene: str, seed: int, grid: ScanGrid, truth: dict[str, object]) -> Array:
    """What the detector sees from one side, 45 degrees off the front: columns across, rows along the axis."""
    setup = catalogue.describe(scene).setup(np.random.default_rng([seed, 1]), 1)
    arc = Arc(projections=1, degrees=-90.0)
    scanner = ConeBeamScanner.of(setup, grid, arc)
    points = np.array(truth["points_mm"], dtype=np.float64)
    counts = scanner.counts(scanner.wire_paths([(points, setup.wire.radius_mm)]), scanner.iodine())
    seen = np.random.default_rng(seed).poisson(counts[0])
    return np.asarray(-np.log(np.maximum(seen, 1) / arc.photons)).T


def _panel(values: Array, window: tuple[float, float] | None) -> Image.Image:
    """Columns along the first axis, the second upwards, grey between the window's ends."""
    low, high = window or (float(np.percentile(values, 0.5)), float(np.percentile(values, 99.8)))
    grey = np.clip(255.0 * (values - low) / (high - low), 0.0, 255.0).astype(np.uint8)
    return Image.fromarray(grey.T[::-1].copy()).resize((EDGE, EDGE), Image.Resampling.LANCZOS)
