"""Whether a lumen that the user brings lies where a scan shows the vessel: larger, smaller, or moved aside.

Grey across a wall is a blurred step. Where the wall is off by w along its outward normal n, grey is the step's at
``d - w``, with d the given signed distance: w = larger + n . shift is found by least squares at voxels near the wall.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.special import ndtr

from pipeline.arrays.edges import layer_in
from pipeline.arrays.grids import normals_at, spread
from pipeline.model import Array, Lumen, Volume

NEAR_VOXELS = 3.0
"""The most by which a wall is moved; voxels are looked at up to twice as far outside the given one."""
STARTS = np.arange(-NEAR_VOXELS, NEAR_VOXELS + 0.1)
"""Walls from which it is looked for, voxels outside the given one."""
CLEAR_VOXELS = 1.5
"""Distance from a wall from which its blur leaves grey alone."""
POINTS = 30_000
LEAST_POINTS = 500
BLUR_VOXELS = 0.9
"""The scanner's blur as it is usual; twice as much moves nothing, as a step's middle stays where it is."""
LEAST_NOISES = 2.0
"""Contrast over a voxel's noise below which a scan is not asked."""
ROUNDS = 8
OFF_VOXELS = 0.5
"""From here on the lumen is off: all kinds tell the wall to 0.2 voxel or better (docs/howto/scans.md)."""
FAR_VOXELS = 2.0
"""From here on it is what frames fail by: traces are looked for within a voxel of the wall."""


class LumenDoubt(NamedTuple):
    """What a scan says against a lumen; empty where it says nothing.     far : it is off by FAR_VOXELS or more."""

    told: str = ""
    far: bool = False


def beside_the_wall(lumen: Lumen, scan: Volume) -> LumenDoubt:
    """A sentence where a lumen is larger, smaller or elsewhere than the vessel that a scan without wire shows."""
    voxel = float(np.max(scan.spacing_mm))
    points, normals, distance = _near(lumen, 2.0 * NEAR_VOXELS * voxel)
    index = scan.to_index(points)
    seen = np.all((index > 0) & (index < np.array(scan.shape) - 1), axis=1)
    if np.count_nonzero(seen) < LEAST_POINTS:
        return LumenDoubt()
    grey = ndimage.map_coordinates(scan.values, index[seen].T, order=1, output=np.float64)
    layer = layer_in(distance[seen] / voxel, grey)
    if layer is not None:  # what is darker than the phantom's wall tells nothing of the vessel's
        grey = np.maximum(grey, layer.floor)
    grey = _in_brighter(grey, distance[seen] / voxel)
    found = _offset(grey, normals[seen], distance[seen] / voxel)
    if found is None:
        return LumenDoubt()
    larger, shift = found[0] * voxel, found[1:] * voxel
    off = []
    if abs(larger) > OFF_VOXELS * voxel:
        off.append(f"{abs(larger):.2f} mm {'outside' if larger < 0 else 'inside'} the wall that the scan shows")
    if np.linalg.norm(shift) > OFF_VOXELS * voxel:
        away = ", ".join(f"{-s:.2f}" for s in shift)
        off.append(f"({away}) mm (LPS) away from where the scan shows the vessel")
    if not off:
        return LumenDoubt()
    do = "check its axes (LPS or RAS), registration and unit, whether radii are diameters, and how it was segmented"
    far = bool(max(abs(larger), np.linalg.norm(shift)) >= FAR_VOXELS * voxel)
    return LumenDoubt(f"the given lumen lies {' and '.join(off)}: {do}", far)


def _in_brighter(grey: Array, off: Array) -> Array:
    """Grey (n,) at so many voxels outside a lumen (n,); where it lies in something brighter, as far as if that went on.

    Water in resin in air: from 0 to -1000 is a larger step than from 0 to 300, and was taken for the wall.
    """
    deep = grey[off < -CLEAR_VOXELS]
    beside = [grey[np.abs(off - at) < 0.5] for at in np.arange(0.5, NEAR_VOXELS)]
    if len(deep) < LEAST_POINTS // 10:
        return grey
    inside, around = float(np.median(deep)), max((float(np.median(b)) for b in beside if len(b)), default=-np.inf)
    if around - inside < LEAST_NOISES * spread(deep):
        return grey
    return np.where((off > 0.0) & (grey < inside - 0.5 * (around - inside)), around, grey)


def _near(lumen: Lumen, reach_mm: float) -> tuple[Array, Array, Array]:
    """Voxel centres (n, 3) inside and near the wall, LPS mm, with outward normal (n, 3) and signed distance (n,)."""
    grid = lumen.distance
    index, normals = normals_at(grid, grid.values < reach_mm, POINTS)
    return grid.to_mm(index), normals, grid.values[tuple(index.T)].astype(float)


def _offset(grey: Array, normals: Array, distance: Array) -> Array | None:
    """By how much the seen wall lies outside the given one, and its shift (3,), all in voxels; None where unseen."""
    design = np.concatenate([np.ones((len(grey), 1)), normals], axis=1)
    # from a wall two voxels off no step leads to the right one: its blur does not reach so far
    tries = [(float(np.mean(np.abs(rest))), w) for w in STARTS if (rest := _rest(grey, distance - w)) is not None]
    if not tries:
        return None
    found = np.array([min(tries)[1], 0.0, 0.0, 0.0])
    for _ in range(ROUNDS):
        from_wall = distance - design @ found
        rest = _rest(grey, from_wall)
        if rest is None:  # of a vessel three voxels across too few lie deep in it
            return found
        kept = np.abs(rest) < 3.0 * max(spread(rest), 1e-6)  # a bone, another vessel, a wire
        steep = np.exp(-0.5 * (from_wall / BLUR_VOXELS) ** 2) / (BLUR_VOXELS * np.sqrt(2.0 * np.pi))
        slope = steep[kept, None] * design[kept]
        if not np.any(slope):  # the wall is nowhere near
            return None
        known = slope.T @ slope
        known += 1e-3 * np.trace(known) * np.eye(4)  # a straight tube does not show where along itself it lies
        found = np.clip(found + np.linalg.solve(known, slope.T @ rest[kept]), -NEAR_VOXELS, NEAR_VOXELS)
    return found


def _rest(grey: Array, from_wall: Array) -> Array | None:
    """Grey (n,) in shares of the step less that of a wall at these distances; None where there is no step."""
    levels = _levels(grey, from_wall)
    if levels is None:
        return None
    inside, outside = levels
    return np.asarray((grey - outside) / (inside - outside) - ndtr(-from_wall / BLUR_VOXELS))


def _levels(grey: Array, from_wall: Array) -> tuple[float, float] | None:
    """Grey inside and outside a wall; None where it is no step that could be told from noise."""
    deep, out = from_wall < -CLEAR_VOXELS, from_wall > CLEAR_VOXELS
    if min(np.count_nonzero(deep), np.count_nonzero(out)) < LEAST_POINTS // 10:
        return None
    inside, outside = float(np.median(grey[deep])), float(np.median(grey[out]))
    return None if abs(inside - outside) <= LEAST_NOISES * spread(grey[out]) else (inside, outside)
