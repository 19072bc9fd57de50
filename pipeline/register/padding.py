"""What a scan shows beyond its round field of view: one grey, whose edge belongs to the scanner and does not move.

Padding of -1024 five millimetres from a vessel held a phantom that moved by 0.6 mm in its place, or slid it by 2.4 mm.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.model import Volume
from solver.grid import read_only

LEAST = 100
"""Voxels of one grey that are padding at the least."""
ABRUPT = 0.5
"""Share of the way up to the rest's median grey that is passed in the next voxel, from which it is no air: the edge of
air is blurred."""
RIM_VOXELS = 5
"""How far from padding no edge is believed: where its rim passes tissue and air, its fill has an edge with one of both,
and frames were 0.7 to 2.6 voxels off."""


class Padding(NamedTuple):
    """The voxels beyond a field of view, and the median grey of those next to them."""

    where: NDArray[np.bool_]
    beside: float


def padding_in(scan: Volume) -> Padding | None:
    """What lies beyond the field of view; None where nothing does."""
    values = scan.values
    darkest = values.min()
    padding = np.asarray(values == darkest)
    if not LEAST <= np.count_nonzero(padding) < padding.size - LEAST:
        return None
    beside = float(np.median(values[ndimage.binary_dilation(padding) & ~padding]))
    abrupt = beside - darkest >= ABRUPT * (float(np.median(values[~padding])) - darkest)
    return Padding(padding, beside) if abrupt else None


def unpadded(scan: Volume, padding: Padding | None) -> Volume:
    """The scan with the grey beside its padding in place of that."""
    if padding is None:
        return scan
    fill = np.asarray(padding.beside, scan.values.dtype)
    return replace(scan, values=read_only(np.where(padding.where, fill, scan.values)), made_of=None)


def off_the_rim(edges: NDArray[np.bool_], padding: Padding | None) -> NDArray[np.bool_]:
    """The edges that are no part of the rim of padding."""
    return edges if padding is None else edges & ~ndimage.binary_dilation(padding.where, iterations=RIM_VOXELS)
