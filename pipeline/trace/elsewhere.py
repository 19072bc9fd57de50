"""Which lines lie near the entry, for a frame in which no bright line passes the entry itself."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.grids import around, sampled, spelt, spread
from pipeline.model import Array, Volume
from solver.grid import Grid

REACH_MM = 12.0
"""How far around the entry the line is looked for: a vessel's width and some."""
LEAST_SPREADS, LEAST_MM = 5.0, 4.0
"""Least height of the line, in standard deviations of all that is near, and its least length: a wire of contrast 6
noises has a height of 5.7 to 8.1, the same vessel without wire 3.2."""
BESIDE_MM = 1.0
"""Distance from the line beyond which the entry is not on it: a clamp may lie as far from the manifest's entry."""
DARKER = 1.5
"""Height of a dark line over that of the brightest line near it, from which it is told: where the phantom moved both
are alike, and beside a wire of 800 grey a streak of 100 was."""
DARK = (
    "a dark line passes entry_mm: if that is the wire, it is darker than the contrast medium, in which only brighter "
    "ones are traced: scan with thinner medium, or without"
)


class Line(NamedTuple):
    """A bright line: how near it comes to the entry, mm; its point nearest to it, (3,) LPS mm; its height, grey/mm2."""

    distance_mm: float
    nearest_mm: Array
    height: float

    def __str__(self) -> str:
        """A hint for the user on where the entry belongs."""
        where = f"passes {self.distance_mm:.1f} mm from entry_mm, at [{spelt(self.nearest_mm)}] mm (LPS)"
        return f"the brightest line near it {where}: if that is the wire, entry_mm belongs on it"


def hint_of_lines(frame: Volume, reference: Volume | None, entry_mm: Array) -> str:
    """What lines near the entry tell, to be added to a note; empty where there are none."""
    line = DARK if passed_by_dark(frame, reference, entry_mm) else brightest_line(frame, reference, entry_mm)
    return f"; {line}" if line else ""


def brightest_line(frame: Volume, reference: Volume | None, entry_mm: Array) -> Line | None:
    """The brightest line within ``REACH_MM`` of the entry; None without one, or where it passes the entry.

    reference : the scan without wire, if there is one: bone is a line, too.
    """
    line = _nearest(*_around(frame, reference, entry_mm), entry_mm)
    return line if line and BESIDE_MM < line.distance_mm < REACH_MM else None


def passed_by_dark(frame: Volume, reference: Volume | None, entry_mm: Array) -> bool:
    """Whether the darkest line near the entry passes it, and no bright one is as strong.

    A wire, or its coat, that is darker than the medium.
    """
    grey, box = _around(frame, reference, entry_mm)
    dark = _nearest(-grey, box, entry_mm)
    if dark is None or dark.distance_mm > BESIDE_MM:
        return False
    bright = _nearest(grey, box, entry_mm)
    return bright is None or dark.height > DARKER * bright.height


def _around(frame: Volume, reference: Volume | None, entry_mm: Array) -> tuple[NDArray[np.float32], Grid]:
    """The frame's grey around the entry less the reference's, where that is seen; and the frame's part."""
    box = around(frame, entry_mm[None], REACH_MM)
    grey = box.values.astype(np.float32)
    if reference is not None:
        grey = np.nan_to_num(grey - sampled(reference, box, np.nan).values)
    return grey, box


def _nearest(grey: NDArray[np.float32], box: Grid, entry_mm: Array) -> Line | None:
    """The point of the brightest line that is nearest to the entry; None without one."""
    if min(grey.shape) < 3:
        return None
    strength = _of_lines(grey, box.spacing_mm)
    if not len(line := _strongest(strength, box.spacing_mm)):
        return None
    points = box.to_mm(line)
    away = np.linalg.norm(points - entry_mm, axis=1)
    nearest = int(np.argmin(away))
    return Line(float(away[nearest]), points[nearest], float(strength.max()))


def _of_lines(grey: NDArray[np.float32], spacing: Array) -> Array:
    """How much like a bright line each voxel is, by its Hessian: curved down both ways across, and not along."""
    sigma = float(spacing.max()) / spacing
    second = np.empty((*grey.shape, 3, 3), np.float32)
    for i in range(3):
        for j in range(i, 3):
            orders = [(axis == i) + (axis == j) for axis in range(3)]
            second[..., i, j] = second[..., j, i] = (
                ndimage.gaussian_filter(grey, sigma, orders) / spacing[i] / spacing[j]
            )
    values = np.linalg.eigvalsh(second)
    return np.asarray(-values[..., 1] - np.abs(values[..., 2]), float)


def _strongest(strength: Array, spacing: Array) -> NDArray[np.int64]:
    """Voxels (n, 3) of the line that holds the strongest voxel; none where it is weak or short."""
    peak = float(strength.max())
    if not peak > LEAST_SPREADS * spread(strength):
        return np.zeros((0, 3), np.int64)
    labels, _ = ndimage.label(strength > 0.4 * peak, np.ones((3, 3, 3)))
    line = np.argwhere(labels == labels[np.unravel_index(np.argmax(strength), strength.shape)])
    length = float(np.linalg.norm(np.ptp(line, axis=0) * spacing))
    return line if length >= LEAST_MM else line[:0]
