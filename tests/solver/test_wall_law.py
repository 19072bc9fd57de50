"""The wall's law stands in one file: with another law put there, energy, forces and the place of rest follow it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import solver
from tests.naive import chain as naive
from tests.solver.scenes import Array

STIFFNESS, SCALE = 5.0, 0.05
LAW = f'''"""A wall that stiffens: ½ k d² (1 + d/{SCALE})."""

from solver._kernels.flags import inlined


@inlined
def energy_per_mm(stiffness, d):
    return 0.5 * stiffness * d * d * (1 + d / {SCALE})


@inlined
def energy(stiffness, length, d):
    return length * energy_per_mm(stiffness, d)


@inlined
def force(stiffness, length, d):
    return stiffness * length * d * (1 + 1.5 * d / {SCALE})


@inlined
def curvature(stiffness, length, d):
    return stiffness * length * (1 + 3 * d / {SCALE})
'''
BENDING, RADIUS, SEGMENT, DEPTH, LOAD = 4.0, 0.3, 1.5, 9.0, [0.05, 0.02, 0.2]
HEIGHT, TILT = 8.0, 0.5
PUSH = 1e-3
"""How far the depth is moved for the slope of the energy, mm."""
CHILD = f"""
import json
import numpy as np
from solver import Grid, GuideWire, VesselWall, relax, __file__
x, _, z = np.meshgrid(*(np.arange(-20.0, 25.0, 4.0),) * 3, indexing="ij")
plane = Grid(z * np.cos({TILT}) + x * np.sin({TILT}) - {HEIGHT}, np.full(3, 4.0), np.full(3, -20.0))
wire, wall = GuideWire({SEGMENT}, {RADIUS}, {BENDING}), VesselWall(plane, {STIFFNESS})
runs = [
    relax(wire, wall, depth_mm={DEPTH} + by, load_N={LOAD}, quadrature="joints", tolerance=1e-12)
    for by in (-{PUSH}, 0.0, {PUSH})
]
print(json.dumps({{
    "from": __file__, "converged": [r.converged for r in runs], "energies": [r.energy_N_mm for r in runs],
    "joints": runs[1].joints_mm.tolist(), "contact": runs[1].contact_force_N.tolist(),
    "reaction": runs[1].reaction_force_N.tolist(), "push": runs[1].push_force_N,
}}))
"""


def stiffening(d: Array) -> Array:
    """The same law for the oracle, over the wall's stiffness."""
    return np.asarray(0.5 * d**2 * (1 + d / SCALE))


def distance(p: Array) -> Array:
    """The plane wall's signed distance."""
    return np.asarray(p[:, 2] * np.cos(TILT) + p[:, 0] * np.sin(TILT) - HEIGHT)


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a copy of the solver says in which that one file is another one; plain Python, nothing is compiled."""
    folder = tmp_path_factory.mktemp("law")
    copy = folder / "solver"
    shutil.copytree(Path(solver.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "_kernels" / "wall_law.py").write_text(LAW, encoding="utf-8")
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", CHILD], cwd=folder, env=environment, capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    assert Path(said["from"]).is_relative_to(folder)
    assert all(said["converged"])
    return said


def oracle(law: Any) -> tuple[Array, float]:
    """Joints and energy of the minimum that scipy finds with a law."""
    k = round(DEPTH / SEGMENT)
    length, zero, base = np.full(k, SEGMENT), np.zeros(k), np.eye(3)
    cell = np.append(0.5 * SEGMENT, np.full(k - 1, SEGMENT))
    load = np.zeros((k + 1, 3))
    load[-1] = LOAD

    def total(u: Array) -> float:
        return naive.energy(
            u, BENDING / cell, zero, zero, length, base, (0, 0, 0), distance, STIFFNESS, RADIUS, load, law
        )  # fmt: skip

    controls, energy = naive.minimum(k, 2, total, np.zeros((k, 3)))
    return naive.joints_of(controls, zero, length, base, (0, 0, 0)), energy


@pytest.mark.slow
def test_the_wire_rests_where_the_new_law_has_its_minimum(other: dict[str, Any]) -> None:
    joints, energy = oracle(stiffening)
    assert other["energies"][1] == pytest.approx(energy, rel=1e-6)
    np.testing.assert_allclose(other["joints"], joints, rtol=0.0, atol=1e-4)
    # and by far not where Hooke's law has it
    assert np.abs(oracle(naive.hooke)[0] - joints).max() > 0.02


def test_forces_are_minus_the_gradient_of_the_new_energy(other: dict[str, Any]) -> None:
    joints, contact = np.array(other["joints"]), np.array(other["contact"])
    weight = np.append(np.full(len(joints) - 2, SEGMENT), 0.5 * SEGMENT)

    def wall_energy(x: Array) -> float:
        return STIFFNESS * float(weight @ stiffening(np.maximum(distance(x[1:]) + RADIUS, 0.0)))

    assert np.linalg.norm(contact, axis=1).max() > 0.1, "the scene must touch the wall"
    for place in np.ndindex(joints.shape):
        step = np.zeros_like(joints)
        step[place] = 1e-6
        slope = (wall_energy(joints + step) - wall_energy(joints - step)) / 2e-6
        # the wall's coefficients are of single precision: 1e-6 mm at 20 mm, times the law's curvature
        assert contact[place] == pytest.approx(-slope, abs=2e-5)
    # in balance with the load and the introducer; the hand's force is the slope of the energy in the depth
    np.testing.assert_allclose(contact.sum(axis=0) + LOAD + other["reaction"], 0.0, rtol=0.0, atol=1e-7)
    low, _, high = other["energies"]
    assert other["push"] == pytest.approx((high - low) / (2 * PUSH), rel=1e-4)
