"""README's pictures from finished runs: ``python -m tests.studies.pictures VALIDATE_OUT ANEURISM_OUT``."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

WIDTH = 900
COLOURS = 256  # a palette keeps a picture below 250 kB
TARGET = Path(__file__).resolve().parents[2] / "reports" / "pictures"


def figure(out: Path, name: str) -> Image.Image:
    """One figure of the run's first case."""
    return Image.open(min(out.glob(f"cases/*/figures/{name}.png"))).convert("RGB")


def rows_of(picture: Image.Image, least_gap: int = 8) -> list[int]:
    """Rows in which nothing is drawn, at the middle of each gap."""
    empty = (np.asarray(picture).min(axis=(1, 2)) > 250).astype(int)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], empty, [0]])))
    return [int((a + b) // 2) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= least_gap]


def save(picture: Image.Image, name: str) -> None:
    """Scaled to README's width, with a palette."""
    height = round(picture.height * WIDTH / picture.width)
    small = picture.resize((WIDTH, height), Image.Resampling.LANCZOS).quantize(COLOURS)
    TARGET.mkdir(parents=True, exist_ok=True)
    small.save(TARGET / name, optimize=True)


def last_row(sheet: Image.Image) -> Image.Image:
    """The legend and the last frame of the projections."""
    legend = sheet.crop((0, 0, sheet.width, 30))
    start = [row for row in rows_of(sheet) if row < 0.8 * sheet.height][-1]
    return stacked([legend, sheet.crop((0, start, sheet.width, sheet.height))])


def stacked(parts: list[Image.Image]) -> Image.Image:
    """Pictures below each other, scaled to one width."""
    width = parts[0].width
    scaled = [p.resize((width, round(p.height * width / p.width)), Image.Resampling.LANCZOS) for p in parts]
    sheet = Image.new("RGB", (width, sum(p.height for p in scaled)), "white")
    top = 0
    for part in scaled:
        sheet.paste(part, (0, top))
        top += part.height
    return sheet


def main() -> None:
    """Write both pictures."""
    validate, aneurism = Path(sys.argv[1]), Path(sys.argv[2])
    save(
        stacked([last_row(figure(validate, "projections")), figure(validate, "error_by_depth")]), "circle_of_willis.png"
    )
    save(figure(aneurism, "simulated_wires"), "aneurism.png")


if __name__ == "__main__":
    main()
