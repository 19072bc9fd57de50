"""Where a wall lies elsewhere than a rigid motion takes it: a phantom that is soft, or is pushed aside by the wire.

Each patch of the wall is asked for a shift of its own, beside its own gain and offset of grey. What two neighbours have
in common is no noise, however that is correlated: the scalar product of their shifts has none of its power.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import spelt
from pipeline.model import Array
from pipeline.register.left import Left
from pipeline.register.patches import PATCH_POINTS, TINY, means, products, shaded, spread_out
from pipeline.register.points import StaticPoints
from pipeline.register.shift import bisquare

ROUNDS = 2
"""Times that a patch's shift is found; the weights against metal are worked out anew between them."""
ACROSS = 0.1
"""Squared steepness over that of the steepest direction from which a shift shows: along a vessel it is noise."""
OF_NOISE = 2.0 * 1.386
"""Median of the squared length of the difference of two shifts, two noises per axis, over one noise's power."""
SURE = 3.0
"""Standard deviations of the mean power by noise from which it is not noise: of 90 frames whose phantom did not bend a
few have more, with 0.02 to 0.09 voxel."""
TOLD_VOXELS = 0.1
"""Root mean square from which it is told and counted: what a frame may be off that is taken not to have moved. Bends
(Gaussian, sd 5 mm) of 1.7, 1.0 and 0.5 voxel leave 0.2 to 0.6, 0.15 to 0.35 and 0.07 to 0.18, of which 0.7 to 1 is
measured; bends of sd 2.5 mm, shorter than a pair, are told in 7 of 9 frames."""
LEAST_PAIRS = 3
"""Pairs of patches: fewer tell no mean."""


@dataclass(frozen=True, eq=False)
class Bent:
    """What a rigid motion leaves of the wall, by pairs of patches: their centres (k, 3), LPS mm, the common power (k,)
    of the two shifts, squared voxels (noise makes it negative as often as positive), and their points (k,).

    noise : power of a patch's shift by noise, per axis.     voxel_mm : the unit.
    """

    at_mm: Array = field(default_factory=lambda: np.zeros((0, 3)))
    power: Array = field(default_factory=lambda: np.zeros(0))
    points: Array = field(default_factory=lambda: np.zeros(0))
    noise: float = 0.0
    voxel_mm: float = 1.0

    @cached_property
    def rms_voxels(self) -> float:
        """Root mean square over the wall, its noise taken out; 0 where it may be noise alone."""
        if len(self.power) < LEAST_PAIRS:
            return 0.0
        mean = float(np.average(self.power, weights=self.points))
        return float(np.sqrt(mean)) if mean > SURE * self.noise * np.sqrt(2.0 / len(self.power)) else 0.0

    @property
    def told(self) -> bool:
        """Whether it is more than a frame that is taken not to have moved may be off."""
        return self.rms_voxels > TOLD_VOXELS

    @property
    def size(self) -> float:
        """By which the worst frame is found."""
        return self.rms_voxels

    def sentence(self, frame: int) -> str:
        """A warning, by the worst frame."""
        return (
            "the vessel's wall fits no rigid motion of the phantom, up to "
            f"{self.rms_voxels:.2f} voxel rms are left (frame {frame}, {self.most_voxels:.2f} at LPS mm "
            f"({spelt(self.worst_mm)})): it is soft and bends, the wire pushes it aside, or slices of the scan lie "
            "aside; traces may lie beside the lumen by as much, which trace_sigma_mm includes; hold the vessel in "
            "place all along, and scan it anew"
        )

    @property
    def most_voxels(self) -> float:
        """The most of a pair."""
        return float(np.sqrt(max(0.0, self.power.max(initial=0.0))))

    @property
    def worst_mm(self) -> Array:
        """Where that is, LPS mm."""
        return np.asarray(self.at_mm[int(np.argmax(self.power))])

    def off_mm(self, points_mm: Array) -> Array:
        """Size (n,) of what is left beside each point (n, 3): that of the pair next to it, but no less than the mean.

        A bend may be shorter than a pair.
        """
        _, nearest = cKDTree(self.at_mm).query(points_mm)
        return np.asarray(self.voxel_mm * np.sqrt(np.maximum(self.power[nearest], self.rms_voxels**2)))


def bent(s: StaticPoints, left: Left) -> Bent:
    """The wall's residual place by place. left : by the rigid fit."""
    count = len(s.grey)
    if len(s.starts) < 2:
        return Bent()
    shift, known = _shifts(s, left)
    at, size = means(s.points_mm, s.starts), np.diff(s.starts, append=count)
    both = known[::2] & known[1::2]
    one, other = shift[::2][both], shift[1::2][both]
    noise = float(np.median(np.sum((one - other) ** 2, axis=1))) / OF_NOISE if both.any() else 0.0
    centres, points = 0.5 * (at[::2] + at[1::2])[both], (size[::2] + size[1::2])[both]
    return Bent(centres, np.sum(one * other, axis=1), points, noise, s.voxel_mm)


def _shifts(s: StaticPoints, left: Left) -> tuple[Array, NDArray[np.bool_]]:
    """Each patch's shift (k, 3), voxels, and whether it has points enough; robust."""
    gain, grey, used = left
    count, weights = len(grey), used.astype(float)
    design = -s.voxel_mm * gain[:, None] * s.gradient
    rows = np.column_stack([design, s.shades, grey])
    for _ in range(ROUNDS):
        normal, right, shade = shaded(products(rows, weights, s.starts), 3)
        shift = _shown(normal, right)
        shades = np.einsum("kij,kj->ki", shade, np.column_stack([-shift, np.ones(len(shift))]))
        residual = grey - np.sum(design * spread_out(shift, s.starts, count), axis=1) - s.shade(shades)[0]
        weights, _ = bisquare(residual, used)
    return shift, np.add.reduceat(weights, s.starts) > 0.5 * PATCH_POINTS


def _shown(normal: Array, right: Array) -> Array:
    """Solve each patch's equations (k, 3, 3) and (k, 3); shifts that do not show stay zero."""
    power, axes = np.linalg.eigh(normal)
    amounts = np.einsum("kij,ki->kj", axes, right)
    amounts = np.where(power > ACROSS * power[:, -1:], amounts / np.maximum(power, TINY), 0.0)
    return np.asarray(np.einsum("kij,kj->ki", axes, amounts))
