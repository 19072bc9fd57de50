"""Binary STL: a triangle surface for programs that print, mesh or simulate. LPS mm, normals outward."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from reports.atomic import write_bytes
from reports.export.vtp import checked_surface

_HEADER = b"wireval; lengths in mm; SPACE=LPS"  # 3D Slicer reads the axes from here; must not begin with "solid"
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])


def write_surface_stl(path: Path, vertices_mm: ArrayLike, triangles: ArrayLike) -> None:
    """Write vertices (n, 3) in LPS mm and triangles (t, 3) of vertex indices."""
    vertices, faces = checked_surface(path, vertices_mm, triangles)
    content = np.zeros(len(faces), dtype=_TRIANGLE)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    content["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    content["corners"] = corners
    write_bytes(path, _HEADER.ljust(80) + len(faces).to_bytes(4, "little") + content.tobytes())
