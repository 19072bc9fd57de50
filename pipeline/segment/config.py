"""Settings of fuzzy connectedness and of the lumen's surface."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SegmentConfig:
    """Fuzzy connectedness and the lumen surface."""

    threshold: float = 0.6
    """Strength of connectedness, 0 to 1, from which a voxel belongs to the lumen."""
    homogeneity_sigma: float | None = None
    """Spread of the homogeneity affinity, grey values; estimated at the seeds when not given."""
    feature_sigma: float | None = None
    """Spread of the object-feature affinity, grey values; estimated at the seeds when not given."""
    adjacency: int = 6
    """Neighbours of a voxel: 6 (faces) or 26."""
    scale: int | None = None
    """Voxels on either side over which grey is averaged before affinities are taken; from the noise when not given."""
    other_seeds_mm: tuple[tuple[float, float, float], ...] = ()
    """Seeds (LPS mm) of what touches the lumen and is not it, such as bone: cut off at the weakest link."""
    margin_mm: float = 5.0
    """Room around the vessel in the box that holds its signed distance."""
    outer_mm: float = 3.0
    """How far outside the wall the distance is exact."""
    least_voxels: int = 200
    """A smaller connected region is no lumen."""
