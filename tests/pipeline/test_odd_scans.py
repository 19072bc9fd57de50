"""Scans that nobody would scan end in a status. ``make bounds`` looks at a thousand, every index checked."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from pipeline.model import Lumen, Volume
from pipeline.segment._kernels.wall import PAD
from pipeline.status import FrameStatus
from pipeline.trace import trace
from tests.studies.odd_scans import outcome

BEYOND = f"""
import numpy as np
from pipeline.segment._kernels.wall import feet
shape = {2 * PAD + 1}, {2 * PAD + 1}, {2 * PAD + 4}
lattice = np.zeros(shape, np.float32) - np.arange(shape[2], dtype=np.float32)
middle = np.ravel_multi_index(({PAD}, {PAD}, {PAD}), shape)
wall = feet(lattice, -{2 * PAD + 9.0}, np.array([1.0, 1.0, 0.1]), np.array([middle]), np.zeros(shape, np.uint8))
assert np.isnan(wall.distance[0])
"""


@pytest.mark.slow
def test_between_thick_slices_a_foot_is_not_looked_for_beyond_the_box() -> None:
    """Two slices are twenty voxels across them, and the box is padded by four: other memory was read as grey."""
    env = os.environ | {"NUMBA_DISABLE_JIT": "1"}  # compiled code checks no index
    done = subprocess.run([sys.executable, "-c", BEYOND], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    "seed",
    [
        25,  # averages of 6 voxels of it had no lumen left, and the median of nothing was its grey
        80,  # a slab of 2 voxels: averages of 3 of them were a scan without voxels
        116,  # voxels of 2.1 mm: the straight pieces that are looked along had no point
    ],
)
def test_an_odd_scan_ends_in_a_status(seed: int) -> None:
    assert outcome(seed) in FrameStatus.__members__


@pytest.mark.parametrize("known", [True, False])
def test_a_frame_elsewhere_than_its_lumen_is_told(known: bool) -> None:
    """Numpy warned of the mean of nothing, and the frame had "nan grey of noise"."""
    x = np.indices((12, 12, 24)).astype(float)
    distance = 0.3 * (np.hypot(x[0] - 6.0, x[1] - 6.0) - 3.0)
    scan, spacing = Volume(np.where(distance < 0, 1000, 0).astype(np.int16), np.full(3, 0.3)), np.full(3, 0.3)
    lumen = Lumen(Volume(distance.astype(np.float32), spacing))
    frame = Volume(scan.values, spacing, np.array([30.0, 0.0, 0.0]))
    curve = trace(frame, lumen, [1.8, 1.8, 0.0], [0.0, 0.0, 1.0], reference=scan if known else None)
    assert curve.status is FrameStatus.NO_WIRE
    assert "a frame of which no voxel lies in the lumen; expected scan and lumen in one place" in curve.note
