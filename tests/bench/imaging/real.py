"""Real scans: the CatPhan's four wire ramps and the aneurysm scan; only where $WIREVAL_DATA says that they are."""

from __future__ import annotations

import gzip
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from scipy import ndimage

from pipeline.load import load, read_header
from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.trace import trace_region

# corners (x, y) in pixels of four boxes, each around one ramp of the CTP404 module, slices 26 to 38
BOXES = (
    ((168, 195), (188, 315)),
    ((324, 195), (344, 315)),
    ((195, 166), (319, 186)),
    ((195, 322), (319, 342)),
)


def catphan(data: Path):
    """For each ramp: angle to the slices (deg), rms across within the slices and across them (mm), status."""
    with tempfile.TemporaryDirectory() as name:
        zipfile.ZipFile(data / "catphan504_cbct" / "High_quality_head.zip").extractall(name)
        folder = next(p for p in Path(name).iterdir() if p.is_dir())
        volume = load(read_header(folder))
    rows = []
    for (x0, y0), (x1, y1) in BOXES:
        grey = volume.crop((x0, y0, 26), (x1, y1, 39)).values
        ends = [
            np.array([*np.unravel_index(grey[:, :, k].argmax(), grey.shape[:2]), k]) + np.array([x0, y0, 26])
            for k in (3, 9)
        ]
        a, b = (volume.to_mm(e) for e in ends)
        low, high = volume.to_mm([x0, y0, 26]), volume.to_mm([x1 - 1, y1 - 1, 38])
        curve = trace_region(volume, low, high, a, b - a)
        points = curve.points_mm - curve.points_mm.mean(axis=0)
        t = np.linalg.svd(points)[2][0]
        normal = volume.direction[:, 2]
        flat = np.cross(normal, t) / np.linalg.norm(np.cross(normal, t))
        angle = np.degrees(np.arcsin(abs(t @ normal)))
        rows.append((angle, np.std(points @ flat), np.std(points @ np.cross(t, flat)), curve.status.name))
    return rows


def aneurysm(data: Path, picture: Path | None):
    """Voxels, distance from the tree's middle to the wall, and a picture of the lumen."""
    raw = gzip.decompress((data / "aneurism_3dra" / "aneurism.raw.gz").read_bytes())
    values = np.frombuffer(raw, np.uint8).reshape(256, 256, 256, order="F")
    volume = Volume(values, [0.5, 0.5, 0.5])
    grey = ndimage.gaussian_filter(volume.values.astype(np.float32), 1.5)
    seed = volume.to_mm(np.array(np.unravel_index(int(grey.argmax()), grey.shape)))
    lumen = segment(volume, seed[None])
    inside = lumen.distance.values < 0
    if picture is not None:
        import matplotlib as mpl

        mpl.use("Agg")
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(1, 3, figsize=(18, 6))
        for axis, panel in enumerate(axes):
            panel.imshow(np.min(lumen.distance.values, axis=axis).T, origin="lower", cmap="viridis")
            panel.set_title(f"deepest distance along axis {axis}, mm")
        figure.savefig(picture, dpi=70)
    return int(inside.sum()), lumen


def report(quick, picture=None):
    """Print the table, or say why not."""
    root = os.environ.get("WIREVAL_DATA")
    if not root or not Path(root).exists():
        print("\n## Real scans: skipped, $WIREVAL_DATA is not set")
        return
    _ = quick
    print(
        "\n## CatPhan 504, cone-beam CT, 0.49 x 0.49 x 2.5 mm: four wires at 23 degrees (bars 1 degree, 0.05 mm across)"
    )
    for angle, across, up, status in catphan(Path(root)):
        print(
            f"   angle {angle:.2f}  rms within the slice {across:.3f} mm, across the slices {up:.3f} mm  {status}"
        )
    count, lumen = aneurysm(Path(root), picture)
    depth = -float(lumen.distance.values.min())
    print(f"## Aneurysm scan (voxel taken as 0.5 mm): {count} voxels inside, deepest {depth:.2f} mm, "
          f"level {lumen.wall_level:.0f}, blur {lumen.counters['scanner_blur_mm']:.2f} mm")  # fmt: skip
