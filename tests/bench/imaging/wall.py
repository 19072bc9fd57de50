"""Signed distance of analytic tubes and tori, read between the nodes through the solver's own interpolation."""

from __future__ import annotations

import numpy as np

from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.segment.config import SegmentConfig
from solver import VesselWall
from tests.pipeline import phantoms

VOXEL = 0.3


def torus(tube, ring):
    """Signed distance function of a torus about z."""

    def distance(p):
        flat = np.hypot(p[..., 0], p[..., 1]) - ring
        return np.hypot(flat, p[..., 2]) - tube

    return distance


def cylinder(radius):
    """Signed distance function of an endless tilted tube."""
    axis = np.array([0.3, 0.5, 0.81])
    axis /= np.linalg.norm(axis)

    def distance(p):
        along = p @ axis
        return np.linalg.norm(p - along[..., None] * axis, axis=-1) - radius

    return distance


def bifurcation(radius):
    """Two tubes that leave one at 60 degrees (union; its edge is sharp, so errors there are the blur's)."""
    arms = [np.array(v) / np.linalg.norm(v) for v in ((0, 0, -1.0), (0.5, 0, 0.87), (-0.5, 0, 0.87))]

    def distance(p):
        parts = []
        for arm in arms:
            along = np.maximum(p @ arm, 0)
            parts.append(np.linalg.norm(p - along[..., None] * arm, axis=-1) - radius)
        return np.min(parts, axis=0)

    return distance


def measure(shape_distance, half, seed_point, noise, seed, config=None):
    """Wall rms, bias and 95th percentile (voxel) and mean gradient angle (deg) between the nodes near the wall."""
    n = int(2 * half / VOXEL)
    origin = np.full(3, -half) + 0.07
    index = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1)
    exact = shape_distance(index * VOXEL + origin)
    clean = 100.0 + 900.0 * phantoms.partial_volume(exact, VOXEL)
    grey = phantoms.scan(clean, 0.8, noise, seed)
    lumen = segment(Volume(np.asfortranarray(grey), [VOXEL] * 3, origin), np.array([seed_point]), config)
    wall = VesselWall(lumen.distance, 1.0)
    rng = np.random.default_rng(seed)
    points = rng.uniform(-half + 2.0, half - 2.0, (600_000, 3))
    points = points[np.abs(shape_distance(points)) < VOXEL][:20_000]
    value, gradient, _ = wall.look_up(points)
    error = (value - shape_distance(points)) / VOXEL
    step = 1e-4
    normal = np.stack(
        [shape_distance(points + step * e) - shape_distance(points - step * e) for e in np.eye(3)], axis=1
    )
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    gradient /= np.linalg.norm(gradient, axis=1)[:, None]
    angle = np.degrees(np.arccos(np.clip(np.sum(normal * gradient, axis=1), -1, 1)))
    return np.sqrt(np.mean(error**2)), error.mean(), np.percentile(np.abs(error), 95), angle.mean()


def report(quick):
    """Print the table."""
    print(
        "\n## Signed distance within a voxel of the wall, through VesselWall between the nodes (voxel 0.3 mm, PSF 0.8)"
    )
    print("   bars: rms 0.05 voxel without noise, 0.1 at noise of a tenth of the contrast; gradient 1 degree")
    print("   shape              noise    rms     bias    p95   gradient deg")
    scenes = [(f"tube r={r}", cylinder(r), max(8.0, r + 5), (0, 0, 0)) for r in (0.6, 1.0, 2.0, 5.0)]
    scenes += [
        ("torus r=1 R=6", torus(1.0, 6.0), 10.0, (6.0, 0, 0)),
        ("torus r=2 R=8", torus(2.0, 8.0), 13.0, (8.0, 0, 0)),
        ("bifurcation r=1.5", bifurcation(1.5), 10.0, (0, 0, -3.0)),
    ]
    if not quick:
        scenes += [
            ("tube r=3.5", cylinder(3.5), 9.0, (0, 0, 0)),
            ("torus r=0.6 R=5", torus(0.6, 5.0), 8.0, (5.0, 0, 0)),
        ]
    for name, distance, half, seed_point in scenes:
        for noise in (0.0, 90.0):
            rms, bias, p95, angle = measure(distance, half, seed_point, noise, 100)
            print(f"   {name:18s} {noise:5.0f}  {rms:6.3f}  {bias:+6.3f}  {p95:5.3f}  {angle:6.2f}")
        rms, bias, p95, angle = measure(distance, half, seed_point, 90.0, 100, SegmentConfig(scale=2))
        print(f"     segment.scale = 2  90  {rms:6.3f}  {bias:+6.3f}  {p95:5.3f}  {angle:6.2f}")
    report_branches()


AXIS = np.array([0.95, 0.2, 0.25]) / np.linalg.norm([0.95, 0.2, 0.25])


def branch(radius, cnr, seed):
    """Radius found (voxel) and share of the axis inside, of a branch off a tube of 2 mm, between the nodes."""
    low = np.array([-4.93, -7.43, -8.93])
    points = np.stack(np.indices((70, 50, 60)), axis=-1) * VOXEL + low
    off = np.linalg.norm(points - np.clip(points @ AXIS, 0.0, 15.0)[..., None] * AXIS, axis=-1)
    exact = np.minimum(np.hypot(points[..., 0], points[..., 1]) - 2.0, off - radius)
    grey = phantoms.scan(100.0 + 900.0 * phantoms.partial_volume(exact, VOXEL), 0.8, 900.0 / cnr, seed)
    lumen = segment(Volume(np.asfortranarray(grey), [VOXEL] * 3, low), [[0.0, 0.0, 0.0]])
    wall = VesselWall(lumen.distance, 1.0)
    place = np.arange(3.5, 13.5, 0.1)[:, None] * AXIS
    u = np.cross(AXIS, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(AXIS, [0.0, 0.0, 1.0]))
    sides = [s * w for w in (u, np.cross(AXIS, u)) for s in (1.0, -1.0)]
    away = np.mean([wall.look_up(place + (radius + 0.4) * w)[0] for w in sides])
    return (radius + 0.4 - away) / VOXEL, np.mean(wall.look_up(place)[0] < 0)


def report_branches():
    """Print what is kept of branches of one to four voxels across."""
    print("\n## Branches off a tube of 2 mm, contrast over noise 9 and 18, seeds 100-102, through VesselWall")
    print("   radius drawn   CNR   radius found   share of the axis inside (voxels)")
    for radius in (0.5, 0.67, 0.83, 1.0, 1.33, 1.67, 2.0):
        for cnr in (9, 18):
            found = np.array([branch(radius * VOXEL, cnr, seed) for seed in range(100, 103)])
            got, kept = found[:, 0].mean(), found[:, 1].mean()
            print(f"   {radius:12.2f}  {cnr:4d}   {got if kept > 0.5 else np.nan:12.2f}   {kept:6.2f}")
