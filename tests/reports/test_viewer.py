"""What the viewer in a case's page is given: every frame, curves in LPS mm, scans as small pictures."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from reports import viewer
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
    vertices, triangles = viewer.decimate(*_sphere(120), 3000)
    assert 500 < len(triangles) <= 3000
    radius = np.linalg.norm(vertices, axis=1)
    assert np.all(np.abs(radius - 10) < 0.5)
    assert triangles.max() < len(vertices)
    points, same = _sphere(10)
    assert len(viewer.decimate(points, same)[1]) == len(same)
    assert len(viewer.decimate(np.zeros((0, 3)), np.zeros((0, 3), int))[1]) == 0


def test_every_frame_is_there_with_its_curves_and_errors(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=5, failed=(1,), truth=True),))
    case = read_case(out / "cases" / "c")
    data = viewer.viewer_data(case)
    assert data is not None
    assert [frame["frame"] for frame in data["frames"]] == [0, 1, 2, 3, 4]
    assert [sorted(frame["curves"]) for frame in data["frames"]][:2] == [["simulated", "traced", "true"], []]
    frame, arrays = data["frames"][3], case.read_frame(3)
    assert arrays.simulated_mm is not None
    shown = np.array(frame["curves"]["simulated"]).reshape(-1, 3)
    np.testing.assert_allclose(shown[-1], arrays.simulated_mm[-1], rtol=0.0, atol=6e-4)
    assert len(frame["arc_mm"]) == len(frame["error_mm"])
    assert data["frames"][1]["error_mm"] == []
    worst = case.good.set_index("frame")["p95_mm"].idxmax()
    assert data["frames"][data["start"]]["frame"] == worst


def test_pictures_are_upright_and_shrink_to_the_budget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=2),))
    case = read_case(out / "cases" / "c")
    monkeypatch.setattr(viewer, "_PICTURES_BYTES", 20_000)
    data = viewer.viewer_data(case)
    assert data is not None
    pictures = [uri for frame in data["frames"] for uri in frame["pictures"].values()]
    assert sum(map(len, pictures)) < 24_000
    whole = viewer._jpeg(case.read_frame(0).mips[1], 1.0)
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(whole.partition(",")[2]))))
    mip = case.read_frame(0).mips[1]
    assert image.shape == mip.T.shape
    # the first row of a picture is the top: the greatest z
    assert np.corrcoef(image[0].astype(float), mip[:, -1].astype(float))[0, 1] > 0.8


def test_the_scan_along_the_wire_goes_from_file_to_page(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=3, failed=(1,)),))
    case = read_case(out / "cases" / "c")
    arrays, data = case.read_frame(2), viewer.viewer_data(case)
    assert data is not None
    assert arrays.straightened is not None
    values, along, across, normal = arrays.straightened
    shown = data["frames"][2]["straight"]
    assert data["frames"][1]["straight"] is None
    assert [shown["along_mm"], shown["across_mm"]] == [along, across]
    assert shown["normal"] == pytest.approx(normal, abs=1e-6)
    assert shown["samples"] == values.shape[:2]
    sizes = [Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))).size for uri in shown["slabs"]]
    assert sizes == [values.shape[:2]] * 2
    across_picture = Image.open(io.BytesIO(base64.b64decode(shown["across"].partition(",")[2])))
    assert across_picture.size == (values.shape[2], shown["planes"] * values.shape[1])
    # the last plane, seen along the wire: up is the first direction, right the second
    last = np.asarray(across_picture)[-values.shape[1] :].astype(float)
    assert np.corrcoef(last.ravel(), values[-1][::-1].astype(float).ravel())[0, 1] > 0.9


def test_the_strips_of_a_page_reach_as_far_in_every_frame(tmp_path: Path) -> None:
    """They reached to each frame's largest offset: 5 mm, where one point was so far off."""
    assert viewer.range_mm([0.1] * 19 + [4.0], 0.0) == 0.5
    assert viewer.range_mm([0.1] * 100 + [4.0], 0.0) == 0.1
    assert viewer.range_mm([0.1], 0.3) == 0.5, "a sample of the scan behind"
    assert viewer.range_mm([80.0], 0.3) == viewer.RANGES_MM[-1]
    data = viewer.viewer_data(read_case(write_run(tmp_path, (FakeCase("c", frames=3),)) / "cases" / "c"))
    assert data is not None
    errors = [e for frame in data["frames"] for e in frame["error_mm"] if e is not None]
    assert data["range_mm"] == viewer.range_mm(errors, data["frames"][0]["straight"]["across_mm"])


def test_a_case_without_frames_has_no_viewer(tmp_path: Path) -> None:
    assert viewer.viewer_data(read_case(tmp_path)) is None
