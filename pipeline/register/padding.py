"""What a scan shows beyond its round field of view: one grey, whose edge belongs to the scanner and does not move.

Padding of -1024 five millimetres from a vessel held a phantom that moved by 0.6 mm in its place, or slid it by 2.4 mm.
"""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from pipeline.model import Volume
from solver.grid import read_only

LEAST = 100
"""Voxels of one grey that are padding at the least."""
ABRUPT = 0.5
"""Share of the way up to the rest's median grey that is passed in the next voxel, from which it is no air: the edge of
air is blurred, and noise that is cut off at 0 goes over into noise."""


def unpadded(scan: Volume) -> Volume:
    """The scan with the grey beside its padding in place of that; the same where it has none."""
    values = scan.values
    darkest = values.min()
    padding = values == darkest
    if not LEAST <= np.count_nonzero(padding) < padding.size - LEAST:
        return scan
    beside = float(np.median(values[ndimage.binary_dilation(padding) & ~padding]))
    if beside - darkest < ABRUPT * (float(np.median(values[~padding])) - darkest):
        return scan
    return replace(scan, values=read_only(np.where(padding, np.asarray(beside, values.dtype), values)), made_of=None)
