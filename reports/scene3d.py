"""An optional scene to turn in the browser: lumen, traced and simulated wire with a slider over the frames.

Needs the extra ``report3d`` (plotly). The script is written once per run, beside index.html, and every case's
scene refers to it: 4.8 MB once instead of in each of 300 cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.atomic import write_text
from reports.case_files import CaseFiles
from reports.export import PolyData, read_vtp
from reports.figures._style import SIMULATED, TRACED, TRUTH

MISSING = "No 3D scene: plotly is not installed; `pip install wireval[report3d]` adds it."
_SCRIPT = "plotly.min.js"
_MAX_TRIANGLES = 30_000  # about 1 MB of page
_MAX_FRAMES = 40
_CURVES = (
    ("traced_mm", "traced", TRACED),
    ("simulated_mm", "simulated", SIMULATED),
    ("truth_mm", "true", TRUTH),
)


def write_scene(case: CaseFiles) -> tuple[Path | None, str]:
    """Write scene3d.html into the case's folder; returns its path, or None and a sentence saying why not."""
    try:
        import plotly.graph_objects as go
        from plotly.offline import get_plotlyjs
    except ImportError:
        return None, MISSING
    surface = case.folder / "view" / "lumen.vtp"
    frames = _chosen(case)
    if not frames and not surface.exists():
        return None, ""
    traces, groups = _wires(case, frames, go)
    lumen = [_lumen(decimate(read_vtp(surface)), go)] if surface.exists() else []
    figure = go.Figure([*lumen, *traces], _layout(groups, len(lumen)))
    folder = _script_folder(case.folder)
    if not (folder / _SCRIPT).exists():
        write_text(folder / _SCRIPT, get_plotlyjs())
    up = "../../" if folder != case.folder else ""
    path = case.folder / "scene3d.html"
    # a fixed id: the same results give the same bytes
    write_text(path, figure.to_html(include_plotlyjs=f"{up}{_SCRIPT}", full_html=True, div_id="scene"))
    return path, ""


def decimate(surface: PolyData, max_triangles: int = _MAX_TRIANGLES) -> PolyData:
    """Merge vertices on ever coarser lattices until few enough triangles are left. For looking, not measuring."""
    vertices, triangles = surface.points_mm, surface.triangles
    size = float(np.ptp(vertices, axis=0).max()) / 400 if len(vertices) else 1.0
    while len(triangles) > max_triangles:
        vertices, triangles = _merge(surface, size)
        size *= 1.25
    return PolyData(vertices, triangles=triangles)


def _merge(surface: PolyData, size: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    keys = np.floor(surface.points_mm / size).astype(np.int64)
    _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    merged = np.zeros((len(counts), 3))
    np.add.at(merged, inverse.ravel(), surface.points_mm)
    corners = inverse.ravel()[surface.triangles]
    a, b, c = corners.T
    return merged / counts[:, None], corners[(a != b) & (b != c) & (c != a)].astype(np.int64)


def _chosen(case: CaseFiles) -> list[int]:
    """Frames with a wire, evenly thinned to what a slider can show."""
    count = min(len(case.frames), _MAX_FRAMES)
    places = np.unique(np.linspace(0, max(len(case.frames) - 1, 0), count).round().astype(int))
    return [case.frames[i] for i in places]


def _wires(case: CaseFiles, frames: Sequence[int], go: Any) -> tuple[list[Any], list[tuple[int, int]]]:
    """Line traces, and for each frame that has any (frame, number of its traces)."""
    traces: list[Any] = []
    groups = []
    for number in frames:
        frame = case.read_frame(number)
        mine = [(getattr(frame, field), label, colour) for field, label, colour in _CURVES]
        drawn = [_line(points, label, colour, go) for points, label, colour in mine if points is not None]
        if drawn:
            groups.append((number, len(drawn)))
            traces += drawn
    for trace in traces[len(traces) - groups[-1][1] :] if groups else ():
        trace.visible = True
    return traces, groups


def _line(points: NDArray[np.float64], label: str, colour: str, go: Any) -> Any:
    x, y, z = np.round(points, 3).T
    style = {"color": colour, "width": 6 if label != "true" else 3}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", name=label, line=style, visible=False)


def _lumen(surface: PolyData, go: Any) -> Any:
    x, y, z = np.round(surface.points_mm, 3).T
    i, j, k = surface.triangles.T
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color="#9AA5B1", opacity=0.25, name="lumen", hoverinfo="skip"
    )


def _layout(groups: Sequence[tuple[int, int]], n_fixed: int) -> dict[str, Any]:
    owner = np.repeat([number for number, _ in groups], [n for _, n in groups])
    steps = [
        {
            "method": "restyle",
            "label": str(number),
            "args": [{"visible": [True] * n_fixed + (owner == number).tolist()}],
        }
        for number, _ in groups
    ]
    slider = {"active": len(steps) - 1, "steps": steps, "currentvalue": {"prefix": "frame "}}
    axes = {f"{axis}axis": {"title": {"text": f"{axis} (LPS), mm"}} for axis in "xyz"}
    layout = {"scene": {"aspectmode": "data", **axes}, "sliders": [slider] if steps else [], "height": 720}
    return layout | {"margin": {"l": 0, "r": 0, "t": 20, "b": 50}}


def _script_folder(case_dir: Path) -> Path:
    """The run's folder where the case lies in one (OUT/cases/ID), else the case's own."""
    return case_dir.parent.parent if case_dir.parent.name == "cases" else case_dir
