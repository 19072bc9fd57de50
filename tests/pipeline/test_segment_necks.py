"""A vessel behind a neck of one voxel radius belongs to the lumen, and is said; what touches a flank does not."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.segment.levels import GreyLevels, Vessel
from pipeline.segment.necks import closed_necks
from solver.grid import Grid
from tests.later import later
from tests.studies.seeing import render

H = 0.3
ENTRY = np.array([[0.0, 0.0, 3.0]])


def scan(vessels: list[tuple[np.ndarray, np.ndarray | float, float]], seed: int = 0) -> Volume:
    """Vessels (axis, radius, level) in noise of a tenth of the contrast."""
    rng = np.random.default_rng(seed)
    lattice = render.Lattice.around(np.concatenate([v[0] for v in vessels]), 4.0, H, rng)
    share = np.max([level * render.vessel(lattice, axis, radius) for axis, radius, level in vessels], axis=0)
    return Volume(render.noisy(100.0 + 900.0 * share, 90.0, rng), lattice.spacing, lattice.origin)


def straight(x: float, low: float, high: float) -> np.ndarray:
    z = np.arange(low, high, 0.05)
    return np.stack([np.full(len(z), x), 0.02 * (z - 15) ** 2 / 3, z], axis=1)


def depth(lumen, points):
    grid = lumen.distance
    return grid.values[tuple(np.rint(grid.to_index(points)).astype(int).T)]


@pytest.mark.parametrize("voxels", [0.7, 1.2, *later(0.85, 1.0)])
@pytest.mark.parametrize("seed", [0, *later(1)])
def test_a_stenosis_does_not_end_the_lumen(voxels: float, seed: int) -> None:
    axis = straight(0.0, 0.0, 30.0)
    radius = 1.5 - (1.5 - voxels * H) * np.exp(-(((axis[:, 2] - 15.0) / 2.0) ** 2))
    lumen = segment(scan([(axis, radius, 1.0)], seed), ENTRY)
    inner = slice(40, -40)
    assert np.mean(depth(lumen, axis[inner]) < 0.0) > 0.99
    assert voxels > 1.0 or any("narrows to a radius" in text for text in lumen.warnings)
    behind = (axis[:, 2] > 20) & (axis[:, 2] < 28)
    assert abs(np.mean(depth(lumen, axis[behind])) + 1.5) < 0.25


@pytest.mark.parametrize(("level", "apart"), [(1.0, 3.5), (2.0, 3.6)], ids=["vessel", "bone"])
def test_what_lies_beside_the_vessel_is_not_its_other_part(level: float, apart: float) -> None:
    one, other = straight(0.0, 0.0, 30.0), straight(apart, 0.0, 30.0)
    lumen = segment(scan([(one, 1.4, 1.0), (other, 1.4, level)]), ENTRY)
    assert not any("narrows" in text for text in lumen.warnings)
    grid = lumen.distance
    index = np.rint(grid.to_index(other[100:-100])).astype(int)
    held = np.all((index >= 0) & (index < np.array(grid.shape)), axis=1)
    assert not np.any(grid.values[tuple(index[held].T)] < 0)


@pytest.mark.parametrize(("across", "expected"), [(0.0, 1), (3.6, 0)])
def test_only_parts_that_go_on_as_each_other_are_joined(across: float, expected: int) -> None:
    """A bone beside a siphon was a part of its own below the wall, and a tunnel of 0.5 mm was dug to it."""
    x, y, z = np.meshgrid(*(H * np.arange(n) for n in (44, 30, 100)), indexing="ij")
    first = np.maximum(np.hypot(x - 4.0, y - 4.0) - 1.5, z - 14.0)
    low = 15.0 if across == 0.0 else 0.0
    other = np.maximum(np.hypot(x - 4.0 - across, y - 4.0) - 1.5, low - z)
    distance = np.minimum(first, other).astype(np.float32)
    bright = Grid(np.where(distance < 0, 1000.0, 100.0).astype(np.float32), np.full(3, H))
    vessel = Vessel(
        bright, bright.with_values(distance), GreyLevels(1000.0, 100.0, 1.0, (1.0,)), np.ones(1, np.float32)
    )
    assert len(closed_necks(vessel, 200)) == expected
