"""Wires painted into volumes of other people's kind: ``python -m tests.studies.backgrounds [FOLDER]``.

Four are vessels of real trees (BraVa, from $WIREVAL_DATA) as MR or other angiography would give them, three show no
vessel; voxels are no cubes, volumes are turned. Each goes through ``wireval synth --background`` and ``wireval run``
with no other option; a line tells how many frames came out ok, and how far traces and wires lie from the true ones.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from data_synthetic.anatomy.centrelines import read_tree
from pipeline.cli import main as wireval
from reports.schema import ERRORS
from reports.tables import read

FRAMES = 8
AIR, TISSUE, SKULL, TEXTURE = -1000.0, 40.0, 900.0, 0.03
Values = np.ndarray


def tree(name: str, spacing: tuple[float, ...], size: tuple[int, ...]) -> Values:
    """How much of each voxel a tree's vessels fill, about its widest place; a linear ramp a voxel wide."""
    known = read_tree(Path(os.environ["WIREVAL_DATA"]) / "brava_swc" / f"{name}.swc")
    ends, radii = known.points_mm[known.edges], known.radii_mm[known.edges]
    share = np.linspace(0.0, 1.0, 16)[:, None, None]
    points = (ends[:, 0] + share * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)
    radius = (radii[:, 0] + share[..., 0] * (radii[:, 1] - radii[:, 0])).ravel()
    low = points[np.argmax(radius)] + [0.0, 0.0, 5.0] - 0.5 * np.array(spacing) * size
    places = low + np.indices(size).reshape(3, -1).T * spacing
    distance = np.full(len(places), np.inf)
    for least, most in ((0.0, 0.8), (0.8, 1.5), (1.5, np.inf)):  # the nearest axis alone is not the nearest wall
        own = (radius >= least) & (radius < most)
        apart, which = cKDTree(points[own]).query(places)
        distance = np.minimum(distance, apart - radius[own][which])
    return np.clip(0.5 - distance / np.mean(spacing), 0.0, 1.0).reshape(size)


def scanned(values: Values, noise: float, rng: np.random.Generator) -> Values:
    """Blurred, with a slow texture and noise."""
    slow = gaussian_filter(rng.normal(size=values.shape), 3.0)
    textured = gaussian_filter(values, 0.7) + slow / slow.std() * TEXTURE * np.ptp(values)
    return textured + rng.normal(size=values.shape) * noise


def away(size: tuple[int, ...]) -> Values:
    """Distance from the middle, in halves of the volume."""
    return np.sqrt(sum(x**2 for x in np.meshgrid(*(np.linspace(-1, 1, n) for n in size), indexing="ij", sparse=True)))


def head_ct(rng: np.random.Generator) -> Values:
    r = away((120, 120, 120))
    return scanned(np.where(r < 0.85, TISSUE, np.where(r < 0.95, SKULL, AIR)), 12.0, rng)


def head_mr(rng: np.random.Generator) -> Values:
    r = away((150, 170, 140))
    folds = gaussian_filter(rng.normal(size=r.shape), 4.0)
    brain = np.where(r < 0.85, 300.0 + 60.0 * folds / folds.std(), np.where(r < 0.93, 700.0, 0.0))
    return np.abs(scanned(brain, 15.0, rng))


def gel(rng: np.random.Generator) -> Values:
    return 500.0 + 120.0 * gaussian_filter(rng.normal(size=(128, 128, 128)), 0.8)


def vessels(
    name: str, spacing: tuple[float, ...], size: tuple[int, ...], greys: tuple[float, float, float]
) -> Callable[[np.random.Generator], Values]:
    """A tree with greys around and inside, and noise."""
    around, inside, noise = greys
    return lambda rng: scanned(around + (inside - around) * tree(name, spacing, size), noise, rng)


COARSE, FINE = (0.5, 0.5, 0.8), (0.35, 0.35, 0.35)
VOLUMES: dict[str, tuple[Callable[[np.random.Generator], Values], tuple[float, ...], type, str]] = {
    "mra": (vessels("BG15", COARSE, (140, 140, 80), (90.0, 420.0, 25.0)), COARSE, np.uint16, ".nii.gz"),
    "angio-8-bit": (vessels("BG11", FINE, (160, 160, 160), (30.0, 190.0, 7.0)), FINE, np.uint8, ".nrrd"),
    "wide-8-bit": (vessels("BG0002", (0.5,) * 3, (180, 180, 180), (30.0, 190.0, 7.0)), (0.5,) * 3, np.uint8, ".mha"),
    "attenuation": (vessels("BG0020", (0.3,) * 3, (166,) * 3, (0.02, 0.05, 0.0015)), (0.3,) * 3, np.float32, ".nii"),
    "head-ct": (head_ct, (0.6, 0.6, 0.7), np.int16, ".nii.gz"),
    "head-mr": (head_mr, (1.0, 1.0, 1.2), np.uint16, ".nrrd"),
    "gel": (gel, (0.4, 0.4, 0.4), np.uint16, ".mha"),
}  # fmt: skip


def written(folder: Path) -> Iterator[Path]:
    """Every volume as a file, every other one turned as a patient who lies on his back."""
    for number, (name, (make, spacing, kind, ending)) in enumerate(VOLUMES.items()):
        values = make(np.random.default_rng(number))
        limits = (0, 255) if kind is np.uint8 else (-32768, 65535)
        image = sitk.GetImageFromArray(np.clip(values, *limits).astype(kind).transpose(2, 1, 0))
        image.SetSpacing(spacing)
        if number % 2:
            image.SetDirection((-1, 0, 0, 0, -1, 0, 0, 0, 1))
        sitk.WriteImage(image, str(folder / f"{name}{ending}"))
        yield folder / f"{name}{ending}"


def main() -> int:
    """A line a volume, and the sum."""
    with tempfile.TemporaryDirectory() as temporary:
        folder, good, frames = Path(sys.argv[1] if sys.argv[1:] else temporary), 0, 0
        folder.mkdir(exist_ok=True)
        for path in written(folder):
            study, out = (folder / f"{path.name.split('.')[0]}-{what}" for what in ("study", "out"))
            wireval(["synth", "--background", str(path), "-o", str(study), "--frames", str(FRAMES), "-q"])
            wireval(["run", str(study), "-o", str(out), "-q", "--no-cache"])
            (table,) = (read(file, ERRORS) for file in out.glob("cases/*/errors.csv"))
            fine = table[table["status"] == "ok"]
            traced, wires = (float(fine[column].mean()) for column in ("trace_mean_mm", "truth_rms_mm"))
            good, frames = good + len(fine), frames + FRAMES
            print(f"{path.name}: {len(fine)} of {FRAMES} ok; traces {traced:.3f}, wires {wires:.3f} mm", flush=True)
    print(f"{good} of {frames} frames ok")
    return 0 if good >= 0.9 * frames else 1


if __name__ == "__main__":
    sys.exit(main())
