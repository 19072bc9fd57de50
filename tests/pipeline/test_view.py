"""What 3D Slicer and ParaView are given of the lumen: a closed surface, normals outward, where the voxels end."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from pipeline.model import Lumen
from pipeline.run.stages.known import Frame
from pipeline.run.view import LumenFiles, closed_surface, contact_at
from solver import Grid

SPACING = np.array([0.5, 0.4, 0.6])
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
MIRROR = TURN * [1.0, 1.0, -1.0]


def signed_volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def open_edges(triangles: np.ndarray) -> int:
    """Directed edges without their opposite, or met more than once."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    directed, counts = np.unique(edges, axis=0, return_counts=True)
    pairs = {tuple(e) for e in directed.tolist()}
    return int((counts > 1).sum()) + sum((b, a) not in pairs for a, b in pairs)


def test_forces_of_joints_are_added_up_from_the_first_place_on() -> None:
    """Joints in the clamp's reach are left out; the first place has those of half a step before it, too."""
    joints = np.array([[0.0, 0, z] for z in (0.0, 9.7, 9.8, 10.0, 10.2, 10.6, 11.0)])
    forces = np.outer([64.0, 32.0, 1.0, 2.0, 4.0, 8.0, 16.0], [0.0, 1.0, 0.0])
    frame = cast(Frame, SimpleNamespace(solved=SimpleNamespace(joints_mm=joints, contact_force_N=forces)))
    np.testing.assert_allclose(contact_at(frame, np.array([10.0, 10.5, 11.0])), [7.0, 8.0, 16.0])
    assert np.isnan(contact_at(cast(Frame, SimpleNamespace(solved=None)), np.zeros(2))).all()


@pytest.mark.parametrize("direction", [np.eye(3), TURN, MIRROR])
def test_a_vessel_that_leaves_the_grid_is_closed(direction: np.ndarray) -> None:
    shape = (40, 44, 20)
    x, y, _ = np.meshgrid(*(np.arange(n) * s for n, s in zip(shape, SPACING, strict=True)), indexing="ij")
    distance = np.hypot(x - 10.0, y - 9.0) - 4.0
    vertices, triangles = closed_surface(Grid(distance, SPACING, np.array([5.0, -3.0, 2.0]), direction))
    assert open_edges(triangles) == 0
    # a cylinder over all voxels from face to face
    expected = np.pi * 4.0**2 * shape[2] * SPACING[2]
    assert signed_volume(vertices - vertices.mean(axis=0), triangles) == pytest.approx(expected, rel=0.01)


def test_what_lies_exactly_on_a_voxel_of_the_edge_is_closed_too() -> None:
    distance = np.full((4, 4, 4), 1.0)
    distance[1:, 1:, 1:] = -1.0
    distance[3, 3, :] = 0.0
    vertices, triangles = closed_surface(Grid(distance, np.ones(3), np.zeros(3), np.eye(3)))
    assert open_edges(triangles) == 0
    assert np.all(vertices <= 3.5 + 1e-6)


def test_a_lumen_is_written_beside_the_case_and_what_fails_is_left_to_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    one, other = (Lumen(Grid(np.full((4, 4, 4), -1.0), np.ones(3), np.zeros(3), np.eye(3))) for _ in range(2))
    files = LumenFiles(tmp_path / "view")
    assert not files.there(None)
    files.begin(one)
    assert files.there(one)
    assert not files.there(other)
    assert sorted(p.name for p in (tmp_path / "view").iterdir()) == ["lumen.seg.nrrd", "lumen.stl", "lumen.vtp"]
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    lost = LumenFiles(tmp_path / "file" / "view")
    lost.begin(one)
    assert not lost.there(one)
    assert capfd.readouterr().err == ""
