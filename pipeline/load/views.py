"""X-ray projections of a wire (projections.json): how each was taken, and the wire's polyline in its pixels.

    {"isocentre_mm": [x, y, z],          LPS; distances are given in mm there
     "leaf_mm": [x, y, z],               where the vessel ends that the wire goes into: all that predictors are told
     "translation": "fitted",            or "none": see ``pipeline.compare.views``
     "frames": [{"matrix": [[...], [...], [...]], "points_px": [[u, v], ...]}, ...]}    from the base to the tip

matrix : 3 x 4, of homogeneous LPS mm to homogeneous pixels. Instead of it a C-arm: "c_arm": {"source_mm": [x, y, z],
"corner_mm": [x, y, z] of pixel (0, 0) on the detector, "u_mm": [x, y, z], "v_mm": [x, y, z] from pixel to pixel}.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationError, model_validator

from pipeline.load.geometry import unusable
from pipeline.load.guard import read_json
from pipeline.model import Array
from pipeline.ranges import Finite, Strict, Vector
from pipeline.wording import said, sentences

Row = tuple[Finite, Finite, Finite, Finite]


class CArm(Strict):
    """A point source and a flat detector, LPS mm."""

    source_mm: Vector
    corner_mm: Vector
    u_mm: Vector
    v_mm: Vector

    @property
    def matrix(self) -> Array:
        """Projection (3, 4) from homogeneous LPS mm to homogeneous pixels."""
        source = np.array(self.source_mm)
        ways = np.column_stack([self.u_mm, self.v_mm, np.array(self.corner_mm) - source])
        inverse = np.linalg.inv(ways)
        return np.column_stack([inverse, -inverse @ source])


def _two(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    if len(set(points)) < 2:
        raise ValueError("a polyline has two different points or more, from the base to the tip")
    return points


class _Frame(Strict):
    matrix: tuple[Row, Row, Row] | None = None
    c_arm: CArm | None = None
    points_px: Annotated[list[tuple[Finite, Finite]], AfterValidator(_two)]

    @model_validator(mode="after")
    def _one_geometry(self) -> "_Frame":
        if (self.matrix is None) == (self.c_arm is None):
            raise ValueError("give one of matrix and c_arm")
        try:
            rays = self.projection[:, :3]
            spread = abs(float(np.linalg.det(rays))) > 1e-12 * float(np.abs(rays).max()) ** 3
        except np.linalg.LinAlgError:
            spread = False
        if not spread:
            raise ValueError("this projection has no point source (parallel rays, or a detector seen edge on)")
        return self

    @property
    def projection(self) -> Array:
        return np.array(self.matrix) if self.c_arm is None else self.c_arm.matrix


class _File(Strict):
    isocentre_mm: Vector
    leaf_mm: Vector
    translation: Literal["fitted", "none"] = "fitted"
    frames: Annotated[list[_Frame], Field(min_length=1)]


@dataclass(frozen=True, eq=False)
class View:
    """One projection: matrix (3, 4) of homogeneous LPS mm to homogeneous pixels, and the wire seen (n, 2) in pixels."""

    matrix: Array
    isocentre_mm: Array
    leaf_mm: Array
    points_px: Array
    fitted: bool


def read_views(path: Path, count: int | None) -> list[View]:
    """One view for each frame; raises LoadError where the file is no such thing, or has another number of them.

    count : None where it is not known.
    """
    expected = '{"isocentre_mm": [x, y, z], "leaf_mm": [x, y, z], "frames": [...]}'
    data = read_json(path, expected)
    if not isinstance(data, dict):
        raise unusable(path, f"cannot be read as projections; expected {expected}")
    try:
        file = _File.model_validate(data)
    except ValidationError as error:
        raise unusable(path, said(*next(sentences(error, data, _File.model_json_schema())))) from None
    if count is not None and len(file.frames) != count:
        raise unusable(path, f"holds {len(file.frames)} frames for {count} depths in insertion_mm; give one for each")
    _require_each_once(path, file.frames)
    centre, leaf, fitted = np.array(file.isocentre_mm), np.array(file.leaf_mm), file.translation == "fitted"
    return [View(f.projection, centre, leaf, np.array(f.points_px, float), fitted) for f in file.frames]


def _require_each_once(path: Path, frames: list[_Frame]) -> None:
    first = [frames.index(frame) for frame in frames]
    again = next((n for n, m in enumerate(first) if m < n), None)
    if again is not None:
        why = f"frame {again} has the projection and points_px of frame {first[again]}, and one picture counts once"
        raise unusable(path, f"{why}; take one of the two out, here and in insertion_mm")
