"""The optional 3D scene: one script per run, fewer triangles, a sentence where plotly is absent."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from reports import scene3d
from reports.case_files import read_case
from tests.reports.fake_results import FakeCase, write_run


def _sphere(n: int) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, n), np.linspace(0, np.pi, n), indexing="ij")
    points = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1).reshape(-1, 3) * 10
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate(
        [np.column_stack([corner, corner + 1, corner + n]), np.column_stack([corner + 1, corner + n + 1, corner + n])]
    )
    return points, triangles


def test_decimation_keeps_the_shape_and_few_triangles() -> None:
    vertices, triangles = scene3d.decimate(*_sphere(120), 3000)
    assert 500 < len(triangles) <= 3000
    radius = np.linalg.norm(vertices, axis=1)
    assert np.all(np.abs(radius - 10) < 0.5)
    assert triangles.max() < len(vertices)
    points, same = _sphere(10)
    assert len(scene3d.decimate(points, same)[1]) == len(same)
    assert len(scene3d.decimate(np.zeros((0, 3)), np.zeros((0, 3), int))[1]) == 0


def test_without_plotly_a_sentence_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=2),))
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    path, sentence = scene3d.write_scene(read_case(out / "cases" / "c"))
    assert path is None
    assert "report3d" in sentence


def test_one_script_for_all_cases(tmp_path: Path) -> None:
    pytest.importorskip("plotly", reason="the extra report3d is not installed")
    out = write_run(tmp_path / "out", (FakeCase("c", frames=3), FakeCase("d", frames=2, simulated_only=True)))
    for name in ("c", "d"):
        path, _ = scene3d.write_scene(read_case(out / "cases" / name))
        assert path is not None
        text = path.read_text(encoding="utf-8")
        assert 'src="../../plotly.min.js"' in text
        assert path.stat().st_size < 2_000_000
        assert "https://cdn" not in text
    assert len(list(out.rglob("plotly.min.js"))) == 1
