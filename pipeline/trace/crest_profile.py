"""How bright the image is along a path and on beyond its apparent end, where the wire may go on."""

from dataclasses import dataclass

import numpy as np

from pipeline.model import Array, arc_length
from pipeline.trace.link import extended, resampled
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction

BACK_VOXELS = 14.0
"""How much of the wire before its apparent end tells where it ends."""
AHEAD_VOXELS = 8.0
"""How far ahead of the apparent end the wire is looked for along its tangent."""
SAMPLES = 4
"""Of the profile in a voxel."""


@dataclass(frozen=True, eq=False)
class CrestProfile:
    """Points ``line`` (n, 3) of a path drawn out by AHEAD_VOXELS, its arc length (n,) and the image's grey (n,) there.

    blur : standard deviation of a step of brightness along the line.     voxel : its edge. All lengths in mm.
    """

    line: Array
    arc: Array
    grey: Array
    blur: float
    voxel: float

    @staticmethod
    def of(image: Subtraction, points: Array, blur_mm: float) -> "CrestProfile":
        """Along the path ``points`` (n, 3). blur_mm : of the wire across."""
        step = image.voxel / SAMPLES
        line = resampled(extended(points, AHEAD_VOXELS * image.voxel, step), step)
        blur = float(np.hypot(CREST_VOXELS * image.voxel, blur_mm))
        return CrestProfile(line, arc_length(line), image.along(line), blur, image.voxel)

    @property
    def own(self) -> int:
        """How many samples lie on the path itself; four at least."""
        return max(4, len(self.line) - round(AHEAD_VOXELS * SAMPLES))

    @property
    def usual(self) -> float:
        """The median grey of the path itself."""
        return max(float(np.median(self.grey[: self.own])), 1e-9)

    def until(self, end: float) -> Array:
        """The points of the line up to an arc length."""
        return np.asarray(self.line[self.arc <= end])
