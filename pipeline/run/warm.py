"""Load the machine code that scans need ahead of them: segment a vessel of a few voxels, and trace a wire in it."""

import numpy as np
from numpy.typing import DTypeLike

from pipeline.model import Lumen, Volume
from pipeline.segment import segment
from pipeline.trace import trace
from solver.grid import Grid

SIZE, LUMEN, TIP = 24, 5.0, 15
"""Voxels, of 1 mm: the scan's edge, the lumen's radius, the wire's length."""
VESSEL, WIRE = 30.0, 80.0
"""Grey values above tissue: a signed byte holds both."""


def warm_up(kind: DTypeLike, *, reference: bool, traced: bool) -> None:
    """Segment a straight vessel and trace a straight wire in it, with or without a scan that has no wire in it.

    kind : of grey values; each has machine code of its own. Kernels for doubtful scans alone are not met so.
    traced : whether tracing is needed, too.
    """
    middle = (SIZE - 1) / 2
    x, y, z = np.indices((SIZE, SIZE, SIZE), dtype=np.float32)
    off = np.hypot(x - middle, y - middle)
    noise = np.random.default_rng(0).uniform(0.0, 2.0, off.shape)
    empty = VESSEL / (1.0 + np.exp(2.0 * (off - LUMEN))) + noise
    wire = empty + WIRE * np.exp(-0.5 * off**2) * (z < TIP)
    frame, without = (Volume(values.astype(kind)) for values in (wire, empty))
    # beside a vessel that is being segmented, which then waits for no code that is loaded for later stages
    segment(without, [[middle, middle, middle]])
    if traced:
        lumen = Lumen(Grid(off - LUMEN), 0.5 * VESSEL)
        trace(frame, lumen, [middle, middle, 0.5], [0.0, 0.0, 1.0], reference=without if reference else None)
