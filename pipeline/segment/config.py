"""Settings of fuzzy connectedness and of the lumen's surface."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from pipeline.ranges import Millimetres, Number, Point, Positive, PositiveCount, Reach, Share


@dataclass(frozen=True)
class SegmentConfig:
    """Fuzzy connectedness and the lumen surface."""

    threshold: Share = 0.6
    """Strength of connectedness, 0 to 1, from which a voxel belongs to the lumen."""
    homogeneity_sigma: Positive | None = None
    """Spread of the homogeneity affinity, grey values. Estimated at the seeds when not given."""
    feature_sigma: Positive | None = None
    """Spread of the object-feature affinity, grey values. Estimated at the seeds when not given."""
    adjacency: Literal[6, 26] = 6
    """Neighbours of a voxel: 6 (faces) or 26."""
    # from 3 on the blurred edge of a vessel of 2 mm was taken for branches (1 voxel rms), 20 left a third of a vessel
    scale: Annotated[int, Field(ge=0, le=2), Number] | None = None
    """Voxels on either side over which grey is averaged before affinities are taken. From the noise when not given."""
    other_seeds_mm: tuple[Point, ...] = ()
    """Seeds (LPS mm) of what touches the lumen and is not it, such as bone. It is cut off at the weakest link."""
    margin_mm: Millimetres = 5.0
    """Room around the vessel in the box that holds its signed distance."""
    outer_mm: Reach = 3.0
    """How far outside the wall the distance is exact."""
    least_voxels: PositiveCount = 200
    """Fewest voxels of a lumen. A smaller connected region is none."""
