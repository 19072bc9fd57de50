"""Whether frames show a vessel beside the lumen where the reference has none: a branch that was filled later.

The lumen is the reference's, so no wire can go there in a simulation. A branch crosses the shell of voxels that lie
some way outside the wall. Grey is compared cell by cell, which takes noise to a third: there, a vessel stands out.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from pipeline.arrays.grids import spelt, spread, unflattened
from pipeline.model import Array, Volume
from pipeline.register.rigid import Motion
from solver.grid import Grid

SHELL_VOXELS = 2.5, 5.0
"""How far outside the wall the shell's voxels lie: beyond the blur of wall and wire, and of a wall that moved."""
CELL_VOXELS = 3
"""Edge of a cell; along thick slices as many voxels as come nearest to it."""
FULL = 0.3
"""Share of a cell's voxels that the shell holds at the least: the mean of 8 has a third of their noise."""
AS_BRIGHT = 0.5, 1.5
"""Shares of the vessel's contrast by which a cell is brighter than the reference where a vessel is filled; what has
more is metal, as is what lies beside it."""
LEAST_CELLS = 3
"""Cells side by side: a branch of 3 voxels radius has 5 or 6, a bare wire of 3 voxels on its way to the entry 2. One of
6 voxels and more that is hardly brighter than the medium has as many as a branch, and is told too."""
SURE = 6.0
"""Noises of the cells (by what they differ where nothing is) from which one is asked."""
DARK = 0.5
"""Darker cells per brighter one from which neither is medium: bone that moved by itself and streaks have both."""
APART, BESIDE_OTHER = 1.8, 2.0
"""Cell edges between the centres of two that touch, and from metal or padding within which nothing is believed."""
ON_A_VOXEL = 1e-3
"""Voxels from a voxel's centre within which its grey is taken: 6.4 ms for 8.5 a frame of 256 voxels."""
NO_NOISE = 1e-9
"""Variance over the squared contrast below which a cell is padding."""


class Branch(NamedTuple):
    """How many cells side by side show a filled vessel at most, and where, (3,) LPS mm."""

    cells: int = 0
    at_mm: Array = np.zeros(3)

    @property
    def told(self) -> bool:
        """Whether it is more than noise, and than a bare wire that passes there."""
        return self.cells >= LEAST_CELLS

    @property
    def size(self) -> float:
        """By which the clearest frame is found."""
        return self.cells

    def sentence(self, frame: int) -> str:
        """A warning, by the clearest frame."""
        return (
            f"something as bright as the filled vessel lies beside the lumen, at LPS mm ({spelt(self.at_mm)}) (frame "
            f"{frame}), where the reference has nothing: a branch that it does not show, a sheath or a wire outside, "
            "or bone that moved; no simulated wire can go there: scan it as filled as the frames are"
        )


@dataclass(frozen=True, eq=False)
class Shell:
    """Points (n, 3) LPS mm some way outside the wall, and the cell (n,) of each; the cells' centres (k, 3), their edge
    and the reference's mean grey (k,) in them.
    """

    points_mm: Array
    cell: NDArray[np.intp]
    centre_mm: Array
    edge_mm: float
    grey: Array


def shell_of(reference: Volume, distance: Grid) -> Shell:
    """The shell of a lumen (signed distance, mm) in its reference."""
    low, high = (v * distance.voxel_mm for v in SHELL_VOXELS)
    high = min(high, float(distance.values.max()))  # beyond which distances are cut off
    size = np.maximum(1, np.rint(CELL_VOXELS * distance.voxel_mm / distance.spacing_mm)).astype(np.intp)
    index = unflattened(np.flatnonzero((distance.values > low) & (distance.values < high)), distance.shape)
    points = distance.to_mm(index)
    grey, inside = _grey(reference, points)
    points, grey = points[inside], grey[inside]
    cells = np.ravel_multi_index(tuple((index[inside] // size).T), distance.shape)
    _, cell, count = np.unique(cells, return_inverse=True, return_counts=True)
    held = count[cell] >= FULL * np.prod(size)
    _, cell = np.unique(cell[held], return_inverse=True)
    centres = np.stack([_means(cell, along) for along in points[held].T], axis=1)
    return Shell(points[held], cell, centres, float(np.max(size * distance.spacing_mm)), _means(cell, grey[held]))


def branch_in(frame: Volume, shell: Shell, motion: Motion, gain: float, contrast: float) -> Branch:
    """What a frame shows beside the lumen. motion : of the phantom.  gain : of grey, frame over reference.

    contrast : of the filled vessel in the reference (negative for one that is darker).
    """
    grey, inside = _grey(frame, motion.moved(shell.points_mm))
    seen = _means(shell.cell, inside) == 1.0
    if not seen.any() or not gain * contrast:
        return Branch()
    mean = _means(shell.cell, grey)
    more = (mean - gain * shell.grey) / (gain * contrast)
    more -= np.median(more[seen])
    high = seen & (np.abs(more) > max(AS_BRIGHT[0], SURE * spread(more[seen])))
    padded = _means(shell.cell, (grey - mean[shell.cell]) ** 2) < NO_NOISE * (gain * contrast) ** 2
    other, filled = padded | (high & (np.abs(more) > AS_BRIGHT[1])), high & (more > 0.0) & (more < AS_BRIGHT[1])
    if np.count_nonzero(high & (more < 0.0)) > DARK * np.count_nonzero(filled):
        return Branch()
    centres = shell.centre_mm[filled]
    if other.any() and len(centres):
        centres = centres[cKDTree(shell.centre_mm[other]).query(centres)[0] > BESIDE_OTHER * shell.edge_mm]
    if not len(centres):
        return Branch()
    beside = cKDTree(centres).query_ball_point(centres, APART * shell.edge_mm, return_length=True)
    return Branch(int(np.max(beside)), motion.moved(centres[int(np.argmax(beside))]))


def _grey(scan: Volume, points_mm: Array) -> tuple[Array, NDArray[np.bool_]]:
    """A scan's grey (n,) at points (n, 3), and which of these lie inside it.

    Between voxels: a bone's edge that moved by half a voxel, read at the next one, was as bright as a vessel.
    """
    index, last = scan.to_index(points_mm), np.array(scan.shape) - 1
    inside = np.all((index > -ON_A_VOXEL) & (index < last + ON_A_VOXEL), axis=1)
    nearest = np.rint(index)
    if np.max(np.abs(index - nearest), initial=0.0) < ON_A_VOXEL:  # as of all frames that did not move
        return scan.values[tuple(np.clip(nearest, 0, last).astype(np.intp).T)].astype(np.float64), inside
    grey = ndimage.map_coordinates(scan.values, index.T, np.float64, order=1, mode="nearest")
    return np.asarray(grey), inside


def _means(cell: NDArray[np.intp], values: NDArray[np.generic]) -> Array:
    """Mean (k,) over each cell of values (n,)."""
    return np.asarray(np.bincount(cell, values) / np.bincount(cell))
