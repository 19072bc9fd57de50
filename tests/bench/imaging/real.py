"""Real scans: the CatPhan's four wire ramps and the aneurysm scan; only where $WIREVAL_DATA says that they are."""

from __future__ import annotations

import gzip
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from scipy import ndimage
from skimage.morphology import skeletonize

from pipeline.load import load, read_header
from pipeline.model import Volume
from pipeline.segment import segment
from tests.pipeline.in_region import trace_region

# corners (x, y) in pixels of four boxes, each around one ramp of the CTP404 module, slices 26 to 38
BOXES = (((168, 195), (188, 315)), ((324, 195), (344, 315)), ((195, 166), (319, 186)), ((195, 322), (319, 342)))


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


VOXEL_MM = 0.5
"""The aneurysm scan's files do not say; the inlet's radius of 4.75 voxels is that of a carotid artery at 0.5 mm."""
SLICES = (106, 152, 186)
"""z of three slices that are looked at. Seen at 0.5 mm voxels:

106: every bright section has its outline at its edge, and so have sections of two to four voxels; two neighbours at
(84, 193) and (88, 196) touch. The faint thin piece at (161, 100) is drawn a voxel beside its bright spot; the streaks
at (74, 228) and (140, 85), which nothing as bright joins to the tree, stay out or keep a speck.
152: sac and siphon, flank to flank, have an outline each; of the faint cloud between sac and the small artery at
(129, 105) only specks are outlined; at (83, 213) two small arteries share one outline, a third has its own.
186: siphon, middle cerebral artery and distal sections are outlined at their bright edges; sections of one or two
voxels at (152, 117), (158, 113) and (117, 106) are kept, the faint row from (183, 131) up to (186, 137) is not.
"""


def aneurysm(data: Path):
    """The scan and its lumen, seeded at its brightest place."""
    raw = gzip.decompress((data / "aneurism_3dra" / "aneurism.raw.gz").read_bytes())
    values = np.frombuffer(raw, np.uint8).reshape(256, 256, 256, order="F")
    volume = Volume(values, [VOXEL_MM] * 3)
    grey = ndimage.gaussian_filter(volume.values.astype(np.float32), 1.5)
    seed = volume.to_mm(np.array(np.unravel_index(int(grey.argmax()), grey.shape)))
    return volume, segment(volume, seed[None])


def branches(lumen):
    """Rows (voxels along, its middle in mm, least, median and greatest distance from the centre line to the wall, mm).

    The centre line is scikit-image's skeleton, cut where more than two of its voxels meet; longest first.
    """
    inside = lumen.distance.values < 0
    line = skeletonize(inside)
    around = ndimage.convolve(line.astype(np.uint8), np.ones((3, 3, 3), np.uint8), mode="constant")
    labels, count = ndimage.label(line & (around <= 3), np.ones((3, 3, 3)))
    depth = -lumen.distance.values
    rows = []
    for n, box in enumerate(ndimage.find_objects(labels), start=1):
        own = labels[box] == n
        middle = np.argwhere(own).mean(axis=0) + [s.start for s in box]
        d = depth[box][own]
        rows.append((int(own.sum()), lumen.distance.to_mm(middle), d.min(), np.median(d), d.max()))
    return sorted(rows, key=lambda r: -r[0]), count


def draw(volume, lumen, picture: Path):
    """Depth of the lumen seen along three axes, and three slices with the wall drawn on the grey."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(18, 12.5))
    for axis, panel in enumerate(axes[0]):
        panel.imshow(np.max(-lumen.distance.values, axis=axis).T.clip(0), origin="lower", cmap="magma", vmax=5.5)
        panel.set_title(f"greatest distance to the wall along {'xyz'[axis]}, 0 to 5.5 mm")
    corner = np.rint(volume.to_index(lumen.distance.origin_mm)).astype(int)
    for z, panel in zip(SLICES, axes[1], strict=True):
        panel.imshow(volume.values[:, :, z].T, origin="lower", cmap="gray")
        k = z - corner[2]
        x, y = (np.arange(n) + c for n, c in zip(lumen.distance.shape[:2], corner[:2], strict=True))
        panel.contour(x, y, lumen.distance.values[:, :, k].T, levels=[0.0], colors="tab:orange", linewidths=1)
        panel.set_title(f"grey and wall at z = {z}")
    figure.tight_layout()
    figure.savefig(picture, dpi=60)


def report_aneurysm(data: Path, picture: Path | None):
    """Print the tree's branches and draw it."""
    volume, lumen = aneurysm(data)
    values = lumen.distance.values
    found, blur = lumen.counters, lumen.levels["scanner_blur_mm"]
    print(f"## Aneurysm scan (voxel taken as {VOXEL_MM} mm): {int((values < 0).sum())} voxels inside, deepest "
          f"{-float(values.min()):.2f} mm, level {lumen.wall_level:.0f}, blur {blur:.2f} mm, "
          f"{found['voxels_thin']:.0f} voxels looked at again for thin branches")  # fmt: skip
    rows, count = branches(lumen)
    thick = np.array([r[3] for r in rows])
    print(f"   {count} branches of the centre line; median distance to the wall {np.median(thick):.2f} mm, "
          f"{np.mean(thick < VOXEL_MM):.0%} below a voxel; the twelve longest:")  # fmt: skip
    print("   voxels   middle (mm)               least  median  greatest distance to the wall (mm)")
    for length, middle, least, median, most in rows[:12]:
        place = " ".join(f"{c:7.1f}" for c in middle)
        print(f"   {length:6d}   {place}   {least:6.2f}  {median:6.2f}  {most:6.2f}")
    for text in lumen.warnings:
        print(f"   warning: {text}")
    if picture is not None:
        draw(volume, lumen, picture)


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
        print(f"   angle {angle:.2f}  rms within the slice {across:.3f} mm, across the slices {up:.3f} mm  {status}")
    report_aneurysm(Path(root), picture)
