"""The pictures that are kept of each frame: their grey values end at the wire's."""

from __future__ import annotations

import numpy as np

from pipeline.model import Volume
from pipeline.run.projections import grey_window, projections


def _scan(wire_voxels: int) -> tuple[Volume, np.ndarray]:
    """Bone of 1400 in half of the scan, and a short wire of 1900 that runs straight up in it; with noise."""
    values = np.random.default_rng(0).normal(100.0, 20.0, (60, 60, 60)).astype(np.float32)
    values[:30] += 1300.0
    values[15, 20, :wire_voxels] += 500.0
    volume = Volume(values, np.full(3, 0.3), np.zeros(3))
    wire = np.column_stack([np.full(wire_voxels, 15.0), np.full(wire_voxels, 20.0), np.arange(wire_voxels)])
    return volume, 0.3 * wire


def test_a_wire_seen_from_its_end_stands_out_from_bone() -> None:
    """The window ended below its one pixel in a thousand: bone and wire were equally white."""
    volume, wire = _scan(20)
    for half_a_voxel in (0.0, 0.14):
        window = grey_window(volume, wire + half_a_voxel)
        assert 1800 < window[1] < 2000
        side = projections(volume, window)[1]
        assert np.median(side[15, :20]) > 240
        assert np.median(side[:30, 30:]) < 200


def test_where_no_wire_is_known_the_brightest_pixels_are_not_cut_off() -> None:
    volume, _ = _scan(20)
    assert grey_window(volume)[1] > 1650
    assert grey_window(volume, np.zeros((0, 3))) == grey_window(volume)
