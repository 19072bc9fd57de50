"""The kernels are Python first: with NUMBA_DISABLE_JIT=1 the same insertion ends in the same wire."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from solver import GuideWire, Insertion, VesselWall
from tests.solver.scenes import Array, bend_distance, sampled

ROOT = Path(__file__).resolve().parents[2]
CHILD = "import json; from tests.solver import test_plain_python as t; print(json.dumps(t.inserted().tolist()))"


def inserted() -> Array:
    """Joints of a short, curved, twisting wire that rubs along the beginning of a bend, on a coarse grid."""
    grid = sampled(lambda p: bend_distance(p, radius=12.0, inlet=2.0), 1.0, (-4, -4, -4), (10, 4, 16))
    wire = GuideWire(2.0, 0.2, 1.0, 0.02, torsional_stiffness_N_mm2=3.0)
    insertion = Insertion(wire, VesselWall(grid, 2.0, friction=0.1), [0, 0, 0], [0.1, 0.3, 1], step_mm=2.0)
    *_, last = insertion.to_depths([4.0, 8.0, 10.0], roll_deg=20.0)
    assert last.converged, last.sentence
    assert last.max_penetration_mm > 0.01, "the scene must touch the wall"
    assert last.friction_energy_N_mm > 0.0
    return last.joints_mm


def test_compiled_kernels_do_what_their_python_says() -> None:
    done = subprocess.run(
        [sys.executable, "-c", CHILD],
        cwd=ROOT,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # the compiler may fuse multiply and add: each sum differs in its last place, and the steps taken are the same
    np.testing.assert_allclose(json.loads(done.stdout), inserted(), rtol=0.0, atol=1e-9)
