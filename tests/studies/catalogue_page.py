"""The page of the catalogue, every scene with its picture: ``python -m tests.studies.catalogue_page [NAME ...]``.

Writes data_synthetic/CATALOGUE.md and reports/pictures/catalogue/NAME.png (named scenes only, all of them without).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from data_synthetic import catalogue
from data_synthetic.catalogue.scene import NamedScene
from data_synthetic.catalogue.study import Study
from tests.studies import catalogue as small

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "data_synthetic" / "CATALOGUE.md"
PICTURES = ROOT / "reports" / "pictures" / "catalogue"
EDGE = 240  # pixels of a picture: 27 of them stay below half a megabyte
COLOURS = 48
BRIGHT = 2200.0  # grey value drawn white: a little more than twice the contrast
RED = (220, 40, 40)
HEAD = """# The catalogue of synthetic scenes

`wireval synth NAME -o DIR` writes any of them as files with truth. `wireval synth --list` names them.

- **Expected** is the status in which every frame ends. The test suite checks it ({frames} frames a scene), and holds
  the errors against `reports/baseline/catalogue`.
- **Pictures** show the brightest voxel along one axis of one frame at 0.5 or 0.6 mm (seed {seed}), with the true wire
  in red.
- **A frame without wire** ends in `trace_low_contrast`, not `no_wire`. In noise something thin is always found, and
  refused for being too faint.

This page is written by `python -m tests.studies.catalogue_page`.

"""


def page() -> str:
    """The whole page as Markdown."""
    rows = ["| scene | why | expected | made to try | |", "|---|---|---|---|---|"]
    for name in catalogue.names():
        scene = catalogue.describe(name)
        picture = f'<img src="../reports/pictures/catalogue/{name}.png" width="150" alt="{name}">'
        tried = ", ".join(scene.tries)
        rows.append(f"| `{name}` | {scene.why} | {expected(scene)} | {tried} | {picture} |")
    return HEAD.format(seed=small.SEED, frames=small.FRAMES) + "\n".join(rows) + "\n"


def expected(scene: NamedScene) -> str:
    """One status where all frames share it, else one a frame."""
    statuses = scene.expected_statuses(small.FRAMES)
    told = statuses[:1] if len(set(statuses)) == 1 else statuses
    return ", ".join(" or ".join(f"`{s}`" for s in one.split("|")) for one in told)


def draw(study: Study) -> Image.Image:
    """The frame that the scene is about: the one without wire where there is one, else the last."""
    visible = study.setup.visible or (True,) * len(study.truth)
    number = visible.index(False) if False in visible else len(study.truth) - 1
    index = study.grid.to_index(study.truth[number].points_mm + shift_of(study, number))
    axis = int(np.argmin(np.ptp(index, axis=0) * study.grid.spacing_mm))
    seen = study.frame(number).max(axis=axis).astype(float)
    across, up = (a for a in range(3) if a != axis)
    spacing = study.grid.spacing_mm[[across, up]]
    scale = EDGE / float(np.max(np.array(seen.shape) * spacing))
    size = tuple(round(float(n * s * scale)) for n, s in zip(seen.shape, spacing, strict=True))
    picture = Image.fromarray(greys(seen)).resize((size[0], size[1]), Image.Resampling.BICUBIC).convert("RGB")
    if visible[number]:
        line = (index[:, [across, up]] + 0.5) * spacing * scale
        line[:, 1] = size[1] - line[:, 1]
        ImageDraw.Draw(picture).line([(float(x), float(y)) for x, y in line], fill=RED, width=2)
    return picture.quantize(COLOURS)


def shift_of(study: Study, number: int) -> NDArray[np.float64]:
    """Where the phantom of that frame lies against the reference."""
    motion = study.setup.motion_mm
    return np.zeros(3) if motion is None else motion[number]


def greys(seen: NDArray[np.float64]) -> NDArray[np.uint8]:
    """From the noise to twice the contrast; the second axis upwards."""
    low = float(np.percentile(seen, 20))
    grey = np.clip(255.0 * (seen - low) / (BRIGHT - low), 0.0, 255.0)
    return np.ascontiguousarray(grey.T[::-1]).astype(np.uint8)


def main(names: list[str]) -> None:
    """Write the page and the pictures."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in names or catalogue.names():
        scene = catalogue.describe(name)
        study = catalogue.build(
            name, frames=small.FRAMES, size=small.size_of(scene), seed=small.SEED, truth_step_mm=small.TRUTH_STEP_MM
        )
        draw(study).save(PICTURES / f"{name}.png", optimize=True)
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
