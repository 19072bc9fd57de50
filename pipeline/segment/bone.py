"""Finds what is brighter than the vessel and touches its wall: calcification, bone or metal.

Between two classes of tissue the wall is the half-level surface; beside a third, brighter one that surface lies too far
out, or there is none. What is hardly brighter has no such limit; it is told by the two greys that the depth then has.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.grids import indices_of, spelt
from pipeline.segment.contact import Contact, how_many, named
from pipeline.segment.groups import two_groups
from pipeline.segment.levels import BRIGHTER, Vessel

SEEN_VOXELS = 5.0
"""How far outside the wall bright voxels are looked for."""
AT_WALL_VOXELS = 1.5
"""Distance from the wall within which something touches it: its blur moves the half-level surface there."""
SIGMAS = 3.0
"""Standard deviations of the mean of 3^3 voxels by which that mean must be above BRIGHTER of the contrast."""
THICK = 2
"""Layers that are eroded: something is left of bone and plaque, nothing of a wire, which is three voxels across."""
DEEP = 2.0
"""Blurs below the wall from which the grey there is the plateau's: 2 % are missing."""
LOOKED_AT, LEAST = 20_000, 100
"""Deep voxels that are looked at, and the least that tell anything."""
GAP = 0.08
"""Least share of the contrast between two groups of greys that are two plateaus, apart by Ashman's D as well."""


def touching(vessel: Vessel) -> tuple[str, ...]:
    """One sentence for the report with the places where something brighter touches the wall, or none."""
    distance, levels = vessel.distance, vessel.levels
    h = distance.voxel_mm
    limit = levels.outside + BRIGHTER * levels.contrast
    bright = (distance.values < SEEN_VOXELS * h) & (vessel.scan.values[vessel.box] > limit)
    near = indices_of(bright)
    # most voxels above the limit are noise: without them the rest lies in a far smaller box
    surely = vessel.grey_around(near) > limit + SIGMAS * levels.noise / np.sqrt(27.0)
    bright[tuple(near.T)], near = surely, near[surely]
    if len(near) == 0:
        return ()
    first = np.maximum(near.min(axis=0) - THICK, 0)
    part = tuple(slice(a, b + 1 + THICK) for a, b in zip(first, near.max(axis=0), strict=True))
    places = _places(bright[part], distance.values[part] < AT_WALL_VOXELS * h)
    if not places:
        return ()
    face = float(np.prod(distance.spacing_mm) ** (2 / 3))
    found = [Contact(distance.to_mm(first + place), count * face) for count, place in places]
    return (
        f"segment: something more than {BRIGHTER:g} times as bright as the vessel (bone, calcification, metal) touches "
        f"its wall in {how_many(places)}; largest at {named(found)}; there the wall may lie too far out: look at"
        " the picture, subtract the bone, or give the lumen as a file (manifest key lumen)",
    )


def _places(bright: NDArray[np.bool_], at_wall: NDArray[np.bool_]) -> list[tuple[int, NDArray[np.float64]]]:
    """Number of voxels at the wall, and their centroid, of each connected bright object that is thick enough."""
    thick_ones = ndimage.binary_erosion(bright, iterations=THICK, border_value=1)
    touched = indices_of(bright & at_wall)
    if len(touched) == 0 or not thick_ones.any():
        return []
    numbers, _ = ndimage.label(bright, np.ones((3, 3, 3)))
    thick = np.unique(numbers[thick_ones])
    of = numbers[tuple(touched.T)]
    groups = [touched[of == n] for n in thick if n]
    return [(len(g), g.mean(axis=0)) for g in groups if len(g)]


def two_greys(vessel: Vessel, blur_mm: float) -> tuple[str, ...]:
    """One sentence for the report where the vessel has two greys, well apart, or none.

    The deep voxels are split and judged by ``two_groups``. blur_mm : the wall's.
    """
    deep = vessel.deep(DEEP * blur_mm, LOOKED_AT)
    if len(deep) < LEAST:
        return ()
    grey = vessel.levels.share(vessel.grey_around(deep))
    kept = grey < BRIGHTER * np.median(grey)  # what is brighter is looked for by ``touching``, and may be a wire
    deep, grey = deep[kept], grey[kept]
    bright, low, high, apart = two_groups(grey)
    if not high - low >= max(GAP, apart):
        return ()
    at = f"[{spelt(vessel.distance.to_mm(np.median(deep[bright], axis=0)))}]"
    share, more = 100 * np.mean(bright), 100 * (high / low - 1)
    return (
        f"segment: the vessel has two greys: {share:.0f} % of its depth are {more:.0f} % brighter than the rest, at "
        f"{at} mm; bone or another vessel may hang together with it: look at the picture, subtract the bone, scan with "
        "smaller voxels, or give the lumen as a file (manifest key lumen)",
    )
