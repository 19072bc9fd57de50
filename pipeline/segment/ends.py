"""A lumen that ends though its vessel goes on: a dark band across it (beside a clip, say) leaves no grey to follow.

Such an end is blunt: the vessel is as wide there as before. Rays from the wall find what is bright again ahead of it;
around what is found, both are looked at in a ball of a few radii: whether they lie in line, are as wide and as bright.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.grids import spelt
from pipeline.arrays.jets import smooth_voxels
from pipeline.arrays.polyline import across
from pipeline.segment.levels import BRIGHTER, Index, Vessel
from pipeline.segment.necks import runs_along
from solver.grid import Array

AHEAD_MM = 6.0
"""Longest gap: the shadow of a clip or a coil is a few mm wide."""
NEAREST = 2
"""Voxels off the wall, any wall, within which nothing is looked for: that is the wall's own blur."""
PLACES = 5_000
"""Places on the wall that are looked at, or so; 8 lie on the end of a vessel of 1 mm among 2000 mm^2."""
DARK = 0.25
"""Share of the contrast below which there is a gap: between a vessel and its branch there is none."""
WITHIN = 3, 4, 5
"""Voxels into what a ray has met, from which its grey is taken: half of the tries were at bone beside a vessel."""
LEAST_RADIUS = 2.0
"""Radius in voxels from which an end is a vessel's: thinner branches fade and come again with the noise."""
INWARDS = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32])
"""Voxels inwards of the wall at which the vessel's radius is looked for, as long as the depth rises."""
TURNS, REACHES = np.array([0, 3, 1, 4, 2, 5]) / 6, 4.0
"""Directions along the wall, half turns, and the ball in which the way ahead is found, radii."""
FLANK, BELOW = 2.2, 0.6
"""How far along the wall, and below it (radii), the lumen is on both sides of a place on a flank, not of an end."""
HALF, AROUND = 16, 3.5
"""Half width of the ball in steps of its lattice, and in radii beyond the gap's middle."""
BLUNT = 0.75
"""Radius at the end over that before it: a cone that closes within 4 radii has 0.4, a dome 1."""
ALIKE = 0.6, 1.5
"""Radius of what lies ahead over the vessel's."""
AS_BRIGHT = 0.6
"""Contrast of what lies ahead, least, of the vessel's."""
MOST_TRIED = 8
"""Ends that are looked at."""


def _depth(vessel: Vessel, at: Array) -> Array:
    """Depth below the wall (...) mm at places (..., 3), voxels of the scan; negative outside, and off the box."""
    held, flat = _flat(at - vessel.corner, vessel.distance.shape)
    return np.where(held, -vessel.distance.values.reshape(-1)[flat], -np.inf)


def _grey(vessel: Vessel, at: Array) -> Array:
    """Smoothed grey (n,) at places (n, 3), voxels, over the contrast; 0 off the scan."""
    held, flat = _flat(at, vessel.scan.shape)
    share = np.zeros(len(at))
    share[held] = vessel.levels.share(smooth_voxels(vessel.scan.values, vessel.taps, flat[held]))
    return share


def _flat(at: Array, shape: tuple[int, ...]) -> tuple[NDArray[np.bool_], Index]:
    """Which places (..., 3) lie in a box, and the flat indices of the voxels nearest to them; 0 where they do not."""
    i, j, k = np.moveaxis(np.rint(at).astype(np.int64), -1, 0)
    held = (i >= 0) & (j >= 0) & (k >= 0) & (i < shape[0]) & (j < shape[1]) & (k < shape[2])
    return held, np.where(held, (i * shape[1] + j) * shape[2] + k, 0)


class _Rays(NamedTuple):
    """Places (n, 3) on the wall, voxels; ways ahead (n, 3), voxels per mm; mm to what is bright; the radius, mm."""

    at: Array
    normal: Array
    gap: Array
    radius: Array

    def of(self, kept: NDArray[np.bool_]) -> "_Rays":
        """Some of them."""
        return _Rays(*(column[kept] for column in self))


def _end_like(vessel: Vessel, at: Array, normal: Array) -> _Rays:
    """The places that are no flank (nowhere does the lumen go on to both sides of them), and which way they look.

    That is away from the middle of the lumen around: along the vessel, however obliquely it is cut.
    """
    spacing = vessel.scan.spacing_mm
    h = vessel.scan.voxel_mm
    radius, rises = np.zeros(len(at)), np.arange(len(at))
    for mm in h * INWARDS:
        depth = _depth(vessel, at[rises] - mm * normal[rises])
        rises = rises[depth > 0.8 * mm - h]
        radius[rises] = np.maximum(radius[rises], depth[depth > 0.8 * mm - h])
    room = np.min(np.minimum(at, np.array(vessel.scan.shape) - 1.0 - at) * spacing, axis=1)
    left = np.flatnonzero((radius >= h) & (room > FLANK * radius + h))
    mm = normal * spacing
    u, v = np.moveaxis(across(mm), 1, 0)
    low = at - (BELOW * radius)[:, None] * normal
    for turn in np.pi * TURNS:
        aside = (FLANK * radius[left])[:, None] * (np.cos(turn) * u[left] + np.sin(turn) * v[left]) / spacing
        left = left[(_depth(vessel, low[left] + aside) < 0) | (_depth(vessel, low[left] - aside) < 0)]
    ball = (np.indices((5, 5, 5)).reshape(3, -1).T - 2.0) / 2.3
    ball = ball[np.linalg.norm(ball, axis=1) <= 1.0]
    around = REACHES * radius[left, None, None] * ball
    depth = _depth(vessel, at[left, None] + around / spacing)
    heading = -np.einsum("nb,nbx->nx", depth > 0, around)
    heading /= np.maximum(np.linalg.norm(heading, axis=1), 1e-9)[:, None]
    radius = np.maximum(radius[left], depth.max(axis=1, initial=0.0))
    between = heading + mm[left]  # a band is crossed the shortest way along the wall's own direction
    between /= np.maximum(np.linalg.norm(between, axis=1), 1e-9)[:, None]
    ways = np.concatenate([heading, between]) / spacing
    both = _Rays(np.tile(at[left], (2, 1)), ways, np.full(2 * len(left), np.inf), np.tile(radius, 2))
    return both.of(both.radius >= LEAST_RADIUS * h)


def _looked_out(vessel: Vessel, rays: _Rays) -> _Rays:
    """The rays that meet something that is no lumen, bright but no bone, and something dark before."""
    h, left, gap = vessel.scan.voxel_mm, np.arange(len(rays.at)), rays.gap.copy()
    dark = np.zeros(len(left), bool)
    for mm in h * np.arange(NEAREST, int(AHEAD_MM / h) + 1):
        there = rays.at[left] + mm * rays.normal[left]
        share, own = _grey(vessel, there), _depth(vessel, there) > -NEAREST * h
        dark[left] |= share < DARK
        lit = (share > 0.5) & dark[left]
        gap[left[lit & ~own]] = mm
        left = left[~(own | lit)]
    rays = rays._replace(gap=gap).of(np.isfinite(gap))
    beyond = [_grey(vessel, rays.at + (rays.gap + n * h)[:, None] * rays.normal) for n in WITHIN]
    return rays.of(np.mean(beyond, axis=0) < BRIGHTER)


def _part(labels: NDArray[Any], at: Array) -> NDArray[np.bool_]:
    """The labelled part of a ball's lattice that most of some places (n, 3), steps from its middle, lie in."""
    index = np.clip(np.rint(at).astype(np.int64) + HALF, 0, 2 * HALF)
    name = labels[tuple(index.T)]
    most = int(np.bincount(name[name > 0]).argmax()) if name.any() else -1
    return np.asarray(labels == most)


def _goes_on(vessel: Vessel, rays: _Rays) -> float:
    """The radius, mm, of the vessel at an end, if what its rays meet lies in line, is as wide and as bright; or 0."""
    spacing, gap = vessel.scan.spacing_mm, float(rays.gap.min())
    # at an oblique end no ray goes through the vessel's middle
    around = rays.radius.max() * (np.indices((13, 13, 13)).reshape(3, -1).T - 6.0) / 2.0
    radius = float(_depth(vessel, rays.at.mean(axis=0) + around / spacing).max())
    middle = np.mean(rays.at + 0.5 * rays.gap[:, None] * rays.normal, axis=0)
    step = (0.5 * gap + AROUND * radius) / HALF
    ball = np.moveaxis(np.indices((2 * HALF + 1,) * 3), 0, -1) - HALF
    held = np.linalg.norm(ball, axis=-1) <= HALF
    at, depth, grey = middle + ball[held] * step / spacing, np.zeros(held.shape), np.zeros(held.shape)
    depth[held], grey[held] = _depth(vessel, at) / step, _grey(vessel, at)
    first, other = (
        (rays.at + mm[:, None] * rays.normal - middle) * spacing / step
        for mm in (-0.5 * rays.radius, rays.gap + 0.5 * rays.radius)
    )
    own = _part(ndimage.label(depth > 0)[0], first)
    ahead = _part(ndimage.label((grey > 0.5) | (depth > 0))[0], other)
    if not own.any() or not ahead.any() or (ahead & (depth > 0)).any():
        return 0.0
    away, apart = ndimage.distance_transform_edt(~own), ndimage.distance_transform_edt(~ahead)
    width = ndimage.distance_transform_edt(ahead)
    radius, gap = float(depth[own].max()), float(away[ahead].min())
    near = ahead & (away < gap + 2.0 * radius)
    wide = float(width[near].max())
    bright = float(np.median(grey[near & (width > 0.5 * wide)]))
    blunt = float(depth[own & (apart < gap + 1.5 * radius)].max()) > BLUNT * radius
    if not (blunt and ALIKE[0] < wide / radius < ALIKE[1] and AS_BRIGHT < bright < BRIGHTER):
        return 0.0
    here, there = ball[own].astype(float), ball[ahead].astype(float)
    way = there.mean(axis=0) - here.mean(axis=0)
    way /= np.linalg.norm(way)
    return radius * step if all(runs_along(part, np.zeros(3), way) for part in (here, there)) else 0.0


def ends(vessel: Vessel, wall: tuple[Array, Array]) -> tuple[str, ...]:
    """One sentence for the report for each place where the lumen ends and its vessel goes on.

    wall : places (n, 3) on it, mm from the scan's first voxel, and outward normals (n, 3).
    """
    every, spacing = max(1, len(wall[0]) // PLACES), vessel.scan.spacing_mm
    at, normal = (column[::every] / spacing for column in wall)
    rays, said = _looked_out(vessel, _end_like(vessel, at, normal)), []
    for _ in range(MOST_TRIED):
        if not len(rays.at):
            break
        n = int(np.argmin(rays.gap))
        near = np.linalg.norm((rays.at - rays.at[n]) * spacing, axis=1) < 2.0 * rays.radius[n]
        radius = _goes_on(vessel, rays.of(near))
        if radius:
            said.append(_said(vessel.scan.to_mm(rays.at[near].mean(axis=0)), float(rays.gap[n])))
            near = np.linalg.norm((rays.at - rays.at[n]) * spacing, axis=1) < AROUND * radius
        rays = rays.of(~near)
    return tuple(said)


def _said(place_mm: Array, gap_mm: float) -> str:
    """What the report says of an end."""
    where = spelt(place_mm)
    return (
        f"segment: the lumen ends inside the scan at {where} mm, as wide as before, and something as wide and bright "
        f"goes on {gap_mm:.1f} mm ahead: a dark band (beside metal, say) may cut the vessel, and what lies beyond is "
        "missing: look at the picture, name points of lumen_seed_mm on both sides, or give the lumen as a file "
        "(manifest key lumen)"
    )
