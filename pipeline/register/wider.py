"""Whether the vessel's wall lies all around outside, or inside, the reference's: another phantom, or another pressure.

A wall that lies farther out by d changes grey by its steepness times d, on all sides alike, which is no motion. Offsets
and gains of grey, each patch's own, are no such change: it is that of a layer, and they are those of all of the patch.
"""

from typing import NamedTuple

import numpy as np

from pipeline.arrays.grids import spread
from pipeline.model import Array
from pipeline.register.left import Left
from pipeline.register.patches import TINY, products, shaded
from pipeline.register.points import StaticPoints
from pipeline.register.shift import bisquare

ROUNDS = 3
"""Times that it is found; the weights are worked out anew between them."""
SEEN = 0.2
"""A patch's share of the middle one's evidence from which it is asked how far it is from the others."""
TOLD_VOXELS = 0.2
"""From which it is told. Frames of the reference's own phantom have 0.04 at most at a contrast of 16 noises and 0.08 at
4 and 5 (15 scenes), wider ones by 0.25, 0.5 and 0.75 voxel 0.26, 0.52 and 0.77. In a vessel of 3 voxels radius with a
wire all along, a third of the wall or less lies away from metal, and what is left was taken for 0.3 to 0.8 voxel."""
SURE = 3.0
"""Standard deviations of it, by what patches differ, from which it is no noise: where half of a tree is narrower they
differ by as much as that is."""
OF_A_TRACE = 0.5
"""Share of it by which a trace may lie off: tips were by 0.4 to 0.7 of it, lines by 0.3 to 0.45."""


class Wider(NamedTuple):
    """How far the frame's wall lies outside the reference's (inside: below 0), and its standard deviation, voxels."""

    voxels: float = 0.0
    sd: float = 0.0
    voxel_mm: float = 1.0

    @property
    def told(self) -> bool:
        """Whether it is more than noise, and than any wall of the same phantom is off."""
        return abs(self.voxels) > max(TOLD_VOXELS, SURE * self.sd)

    @property
    def size(self) -> float:
        """By which the worst frame is found."""
        return abs(self.voxels)

    def sentence(self, frame: int) -> str:
        """A warning, by the worst frame."""
        side = "outside" if self.voxels > 0.0 else "inside"
        return (
            f"the vessel's wall lies {abs(self.voxels) * self.voxel_mm:.2f} mm {side} the reference's, all around "
            f"(frame {frame}): the reference shows another phantom, or this one at another pressure, filled or "
            "reconstructed otherwise; the lumen is the reference's, where simulated wires have too much or too little "
            "room, and traces are less sure by half of that; scan the reference as the frames are"
        )

    @property
    def off_mm(self) -> float:
        """What a trace may be off by that, if it is told; else 0."""
        return OF_A_TRACE * abs(self.voxels) * self.voxel_mm * self.told


def wider(s: StaticPoints, left: Left, brighter: float) -> Wider:
    """The wall's residual, on all sides alike. left : by the rigid fit.

    brighter : 1 for a vessel that is brighter than what is around it, -1 for a darker one.
    """
    if len(s.starts) < 2:
        return Wider()
    gain, grey, clear = left
    outward = brighter * s.voxel_mm * gain * np.linalg.norm(s.gradient, axis=1)
    rows, weights = np.column_stack([outward, s.shades, grey]), clear.astype(float)
    for _ in range(ROUNDS):
        power, right, shade = shaded(products(rows, weights, s.starts), 1)
        found = float(right.sum() / (power.sum() + TINY))
        residual = grey - outward * found - s.shade(shade @ np.array([-found, 1.0]))[0]
        weights, _ = bisquare(residual, clear)
    return Wider(found, _sd(power[:, 0, 0], right[:, 0]), s.voxel_mm)


def _sd(power: Array, right: Array) -> float:
    """Standard deviation of the mean, by what the patches (k,) that show it differ."""
    shown = power > max(SEEN * float(np.median(power)), TINY)
    if np.count_nonzero(shown) < 2:
        return float("inf")
    return spread(right[shown] / power[shown]) / float(np.sqrt(np.count_nonzero(shown)))
