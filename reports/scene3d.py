"""An optional scene to turn in the browser: lumen, traced and simulated wire with a slider over the frames.

Needs the extra ``report3d`` (plotly). The script is written once per run, beside index.html, and every case's
scene refers to it: 4.8 MB once instead of in each of 300 cases.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from reports.atomic import write_text
from reports.case_files import CaseFiles, thinned
from reports.export.vtp import Index, read_surface_vtp
from reports.figures._style import SIMULATED, TRACED, TRUTH
from reports.frames_file import Array

MISSING = "No 3D scene: plotly is not installed; `pip install wireval[report3d]` adds it."
_SCRIPT = "plotly.min.js"
_MAX_TRIANGLES = 30_000  # about 1 MB of page
_MAX_FRAMES = 40
_COLOURS = {"traced": TRACED, "simulated": SIMULATED, "true": TRUTH}


def write_scene(case: CaseFiles) -> tuple[Path | None, str]:
    """Write scene3d.html into the case's folder; returns its path, or None and a sentence saying why not."""
    try:
        import plotly.graph_objects as go
        from plotly.offline import get_plotlyjs
    except ImportError:
        return None, MISSING
    surface = case.folder / "view" / "lumen.vtp"
    if not case.frames and not surface.exists():
        return None, ""
    wires = _wires(case, go)
    lumen = [_lumen(*decimate(*read_surface_vtp(surface)), go)] if surface.exists() else []
    traces = [*lumen, *(line for lines in wires.values() for line in lines)]
    figure = go.Figure(traces, _layout({frame: len(lines) for frame, lines in wires.items()}, len(lumen)))
    # the run's folder where the case lies in one (OUT/cases/ID), else the case's own
    inside = case.folder.parent.name == "cases"
    script = (case.folder.parent.parent if inside else case.folder) / _SCRIPT
    if not script.exists():
        write_text(script, get_plotlyjs())
    path = case.folder / "scene3d.html"
    source = f"{'../../' if inside else ''}{_SCRIPT}"
    # a fixed id: the same results give the same bytes
    write_text(path, figure.to_html(include_plotlyjs=source, full_html=True, div_id="scene"))
    return path, ""


def decimate(points_mm: Array, corners: Index, max_triangles: int = _MAX_TRIANGLES) -> tuple[Array, Index]:
    """Merge vertices (n, 3) of triangles (t, 3) on ever coarser lattices until few enough are left; for looking."""
    vertices, triangles = points_mm, corners
    size = float(np.ptp(vertices, axis=0).max()) / 400 if len(vertices) else 1.0
    while len(triangles) > max_triangles:
        keys = np.floor(points_mm / size).astype(np.int64)
        _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        vertices = np.zeros((len(counts), 3))
        np.add.at(vertices, inverse.ravel(), points_mm)
        vertices /= counts[:, None]
        merged = inverse.ravel()[corners]
        a, b, c = merged.T
        triangles = merged[(a != b) & (b != c) & (c != a)].astype(np.int64)
        size *= 1.25
    return vertices, triangles


def _wires(case: CaseFiles, go: Any) -> dict[int, list[Any]]:
    """The lines of each frame that has any, evenly thinned to what a slider can show; the last frame's are seen."""
    wires = {}
    for place in thinned(len(case.frames), _MAX_FRAMES):
        number = case.frames[place]
        curves = case.read_frame(number).curves
        drawn = [_line(curves[name], name, go) for name in _COLOURS if name in curves]
        if drawn:
            wires[number] = drawn
    for trace in list(wires.values())[-1] if wires else ():
        trace.visible = True
    return wires


def _line(points: Array, name: str, go: Any) -> Any:
    x, y, z = np.round(points, 3).T
    style = {"color": _COLOURS[name], "width": 6 if name != "true" else 3}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", name=name, line=style, visible=False)


def _lumen(vertices: Array, triangles: Index, go: Any) -> Any:
    x, y, z = np.round(vertices, 3).T
    i, j, k = triangles.T
    return go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, color="#9AA5B1", opacity=0.25, name="lumen", hoverinfo="skip")


def _layout(counts: Mapping[int, int], n_fixed: int) -> dict[str, Any]:
    """Axes and a slider over the frames; counts: the lines of each frame, after ``n_fixed`` that are always seen."""
    owner = np.repeat(list(counts), list(counts.values()))
    seen = {str(number): [True] * n_fixed + (owner == number).tolist() for number in counts}
    steps = [{"method": "restyle", "label": n, "args": [{"visible": v}]} for n, v in seen.items()]
    slider = {"active": len(steps) - 1, "steps": steps, "currentvalue": {"prefix": "frame "}}
    axes = {f"{axis}axis": {"title": {"text": f"{axis} (LPS), mm"}} for axis in "xyz"}
    layout = {"scene": {"aspectmode": "data", **axes}, "sliders": [slider] if steps else [], "height": 720}
    return layout | {"margin": {"l": 0, "r": 0, "t": 20, "b": 50}}
