"""Dead loads: their energy is counted from the entry, so that nothing hangs on where the scan's origin is."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from solver import Grid, GuideWire, Insertion, Insertions, Solution, VesselWall, relax
from tests.solver.scenes import Array

FAR = np.array([300.0, -400.0, 900.0])
"""Where a scan's entry may well lie: 4 mN are 4 N mm from the origin, 60 times the energy of these wires."""


@cache
def vessel(seed: int) -> tuple[GuideWire, Array, Array, Array, Array]:
    """A winding vessel with two bulges: wire, distances in voxels of 0.5 mm and their corner, tip load, N, depths."""
    rng, spacing = np.random.default_rng(seed), 0.5
    s = np.linspace(0.0, 45.0, 300)
    bends = rng.normal(0.0, 0.08, (2, 6))
    at, frame, path = np.zeros(3), Rotation.identity(), [np.zeros(3)]
    for arc in s[:-1]:
        bend = [np.interp(arc / 9.0, range(6), b) if arc >= 4.0 else 0.0 for b in bends]
        frame = frame * Rotation.from_rotvec(s[1] * np.array([*bend, 0.0]))
        at = at + s[1] * frame.as_matrix()[:, 2]
        path.append(at)
    points = np.vstack([-np.linspace(4.0, 0.1, 40)[:, None] * [0.0, 0.0, 1.0], path])
    radius, low = rng.uniform(1.0, 2.0), points.min(axis=0) - 7.0
    axes = [np.arange(a, b, spacing) for a, b in zip(low, points.max(axis=0) + 7.0, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = cKDTree(points).query(nodes)[0] - radius
    for _ in range(2):
        centre = path[rng.integers(90, 300)] + rng.normal(0.0, 1.5, 3)
        distance = np.minimum(distance, np.linalg.norm(nodes - centre, axis=-1) - rng.uniform(2.0, 4.5))
    stiffness = [[0, 0.5], [5, 0.5], [15, float(rng.uniform(1, 8))]]
    curve = [[0, float(rng.uniform(-0.4, 0.4))], [7, float(rng.uniform(-0.3, 0.3))], [7, 0]]
    load = rng.normal(0.0, 0.004, 3)
    return GuideWire(0.5, 0.18, stiffness, curve), distance, low, load, np.cumsum(rng.uniform(0.3, 2.0, 24))


def pushed(seed: int, shift: ArrayLike, **how: Any) -> tuple[Insertion, Array]:
    """That wire with the whole scene moved by ``shift``, mm, and its first twenty depths."""
    wire, distance, low, load, depths = vessel(seed)
    wall = VesselWall(Grid(distance, [0.5] * 3, low + shift), 2.0)
    insertion = Insertion(wire, wall, shift, [0, 0, 1], material_axis=[1, 0, 0], tip_load_N=load, **how)
    return insertion, depths[:20]


def assert_moved(here: list[Solution], there: list[Solution]) -> None:
    """Flags, snaps and energy are the same, and the joints FAR away."""
    for a, b in zip(here, there, strict=True):
        assert (a.status, a.uncertain, len(a.snaps)) == (b.status, b.uncertain, len(b.snaps)), a.depth_mm
        np.testing.assert_allclose(a.joints_mm, b.joints_mm - FAR, rtol=0.0, atol=1e-6)
        assert a.energy_N_mm == pytest.approx(b.energy_N_mm, rel=1e-8)
        assert a.dissipated_N_mm == pytest.approx(b.dissipated_N_mm, abs=1e-8)


@pytest.mark.parametrize("seed", [3095, 3115])
def test_a_moved_scene_is_judged_alike(seed: int) -> None:
    """At FAR the first lay 0.6 mm off and was certain of it, and the second lost its four snaps."""
    (near, depths), (far, _) = pushed(seed, np.zeros(3)), pushed(seed, FAR)
    here, there = list(near.to_depths(depths)), list(far.to_depths(depths))
    assert any(s.uncertain for s in here)
    assert_moved(here, there)


def test_many_wires_at_once_are_judged_as_by_themselves_wherever_they_lie() -> None:
    both = [Insertions([pushed(seed, shift)[0] for seed in (3095, 3115)]) for shift in (np.zeros(3), FAR)]
    depths = [pushed(seed, FAR)[1] for seed in (3095, 3115)]
    for here, there in zip(*(many.to_depths(depths) for many in both), strict=True):
        assert_moved(here, there)


def test_a_straight_pull_is_counted_from_the_entry() -> None:
    """-F L; what loads the entry itself does no work."""
    wire, load = GuideWire(1.0, 0.18, 2.0), np.zeros((21, 3))
    load[0], load[-1] = [1.0, 2.0, 3.0], [0.0, 0.0, 0.01]
    solution = relax(wire, depth_mm=20.0, entry_mm=FAR, entry_direction=[0, 0, 1], load_N=load)
    assert solution.energy_N_mm == pytest.approx(-0.2, rel=1e-12)
