"""The guide wire: radius, and stiffness and rest shape as functions of the distance from its tip."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solver._kernels.chain import segments_at
from solver._kernels.data import Profile
from solver.errors import refuse
from solver.grid import Array, read_only

Quantity = float | ArrayLike | Callable[[Array], ArrayLike]

CALLABLE_REACH_MM = 2000.0
CALLABLE_STEP = 0.25


def _table(name: str, value: Quantity, segment_mm: float) -> tuple[Array, Array]:
    """Abscissae (n,) and values (n,) of a number, a profile array or a callable of the distance from the tip."""
    if callable(value):
        at = np.arange(0.0, CALLABLE_REACH_MM, CALLABLE_STEP * segment_mm)
        return at, np.broadcast_to(np.asarray(value(at), dtype=np.float64), at.shape).copy()
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0:
        return np.zeros(1), array.reshape(1).copy()
    if array.ndim != 2 or array.shape[1] != 2 or len(array) == 0:
        allowed = "a number, rows of [distance from tip mm, value], or a callable"
        refuse("wire", name, array.tolist(), allowed, "write [[0.0, a], [30.0, b]]")
    if np.any(np.diff(array[:, 0]) < 0) or array[0, 0] < 0:
        refuse("wire", name, array[:, 0].tolist(), "distances from the tip that never fall, from 0", "sort the rows")
    return array[:, 0].copy(), array[:, 1].copy()


@dataclass(frozen=True, eq=False)
class GuideWire:
    """A wire as a chain of rigid segments; every profile is a function of the distance from the tip in mm.

    segment_mm : length of a segment.     radius_mm : radius of the outer hull.
    bending_stiffness_N_mm2, rest_curvature_per_mm : a number, rows [distance from tip, value] (linear between,
    constant beyond, two equal distances make a jump), or a callable of an array of distances.
    torsional_stiffness_N_mm2 : inf is ideal torque control (the seed's assumption).
    Positive rest curvature bends the wire towards material axis 1.
    """

    segment_mm: float
    radius_mm: float
    bending_stiffness_N_mm2: Quantity
    rest_curvature_per_mm: Quantity = 0.0
    torsional_stiffness_N_mm2: float = math.inf
    profile: Profile = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check and tabulate the profiles."""
        if not (math.isfinite(self.segment_mm) and self.segment_mm > 0):
            refuse("wire", "segment_mm", self.segment_mm, "a positive length", "1.0 is a good start")
        if not (math.isfinite(self.radius_mm) and self.radius_mm >= 0):
            refuse("wire", "radius_mm", self.radius_mm, "a length of 0 or more", "0.18 is a 0.014 inch wire")
        if not self.torsional_stiffness_N_mm2 > 0:
            refuse("wire", "torsional_stiffness_N_mm2", self.torsional_stiffness_N_mm2, "above 0, or inf", "use inf")
        bend_at, bend = _table("bending_stiffness_N_mm2", self.bending_stiffness_N_mm2, self.segment_mm)
        rest_at, rest = _table("rest_curvature_per_mm", self.rest_curvature_per_mm, self.segment_mm)
        if not np.all(np.isfinite(bend)) or np.any(bend <= 0):
            refuse("wire", "bending_stiffness_N_mm2", bend.min(), "positive everywhere", "0.5 to 40 is usual")
        if not np.all(np.isfinite(rest)) or np.any(np.abs(rest) * self.segment_mm > math.pi / 2):
            allowed = f"up to {math.pi / 2 / self.segment_mm:.3g} per mm at segment_mm = {self.segment_mm:g}"
            refuse("wire", "rest_curvature_per_mm", np.abs(rest).max(), allowed, "shorten segment_mm")
        arrays = [read_only(a, np.float64) for a in (bend_at, bend, rest_at, rest)]
        profile = Profile(arrays[0], arrays[1], arrays[2], arrays[3], float(self.torsional_stiffness_N_mm2))
        object.__setattr__(self, "profile", profile)

    @property
    def straight(self) -> bool:
        """The rest shape has no curvature: rolling such a wire changes nothing."""
        return not bool(np.any(self.profile.rest))

    @property
    def twists(self) -> bool:
        """The torsional stiffness is finite (and the rest shape curved: otherwise no torque arises)."""
        return math.isfinite(self.torsional_stiffness_N_mm2)

    def segments_at(self, depth_mm: float) -> tuple[int, float]:
        """Number of segments at a depth and length of the first one, which is ½ to 1½ segments long."""
        count, first = segments_at(float(depth_mm), float(self.segment_mm))
        return int(count), float(first)

    def arcs_at(self, depth_mm: float) -> Any:
        """Arc lengths (k + 1,) of the joints from the entry, mm, at a depth."""
        k, first = self.segments_at(depth_mm)
        return np.concatenate([[0.0], first + self.segment_mm * np.arange(k)]) if k else np.zeros(1)
