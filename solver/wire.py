"""The guide wire: radius, and stiffness and rest shape as functions of the distance from its tip."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solver import _tolerances as tol
from solver._kernels.chain import segments_at
from solver._kernels.data import Profile
from solver.doors import FAR_MM, Array, Found, Range, number, numbers
from solver.errors import refuse
from solver.grid import read_only

Quantity = float | ArrayLike | Callable[[Array], ArrayLike]

_FORMS = "write a number, [[distance from tip mm, value], ...] or a callable of distances"
ANY = Range(-1e12, 1e12, _FORMS, _FORMS)
SEGMENT_MM = Range(1e-3, 20.0, "0.25 to 1 is usual")
"""Longer ones follow no vessel; 50 is 0.5 mistyped."""
THICKEST_MM = 20.0
"""Largest radius of a wire or a catheter, as in a manifest."""
STIFFNESS_N_MM2 = Range(1e-12, 1e12, "0.5 to 40 is usual")
CALLABLE_REACH_MM = 2000.0
CALLABLE_STEP = 0.25


def _table(name: str, value: Quantity, segment_mm: float) -> tuple[Array, Array]:
    """Abscissae (n,) and values (n,) of a number, a profile array or a callable of the distance from the tip."""
    if callable(value):
        at = np.arange(0.0, CALLABLE_REACH_MM, CALLABLE_STEP * segment_mm)
        values = _called(name, value, read_only(at))
        if np.ndim(values) == 0:
            return at, np.full(at.shape, number("wire", name, values, ANY))
        return at, numbers("wire", name, values, at.shape, ANY).copy()
    if isinstance(value, (list, tuple)) or np.ndim(value) > 0:
        rows = numbers("wire", name, value, (None, 2), ANY)
        if len(rows) == 0 or np.any(np.diff(rows[:, 0]) < 0) or rows[0, 0] < 0 or rows[-1, 0] > FAR_MM:
            allowed = f"distances from the tip that never fall, from 0 to {FAR_MM:g} mm"
            refuse("wire", name, rows[:, 0].tolist(), allowed, "write [[0.0, a], [30.0, b]]")
        return rows[:, 0].copy(), rows[:, 1].copy()
    return np.zeros(1), np.array([number("wire", name, value, ANY)])


def _called(name: str, profile: Callable[[Array], ArrayLike], at: Array) -> ArrayLike:
    """The values of a callable at distances (n,); one that takes a distance at a time, as with ``if``, is refused."""
    try:
        return profile(at)
    except (TypeError, ValueError, LookupError, ArithmeticError) as error:
        allowed = "a function that takes an array of distances"
        refuse("wire", name, Found(f"a function that fails with one: {error}"), allowed, "for an if, numpy.where")


@dataclass(frozen=True, eq=False)
class GuideWire:
    """A wire as a chain of rigid segments. Profiles are functions of the distance from the tip in mm.

    segment_mm : length of a segment.     radius_mm : outer radius.
    bending_stiffness_N_mm2, rest_curvature_per_mm : profiles. Each is a number, or rows [distance from tip, value]
    (linear between rows, constant beyond the last, a jump where two distances are equal), or a function that takes an
    array of distances (up to 2000 mm). A positive rest curvature bends the wire towards material axis 1.
    torsional_stiffness_N_mm2 : infinite for ideal torque control, which is the paper's assumption.
    weight_N_per_mm : weight in blood, that is less its buoyancy (7e-6 for 0.36 mm of steel); 0 leaves gravity out.
    """

    segment_mm: float
    radius_mm: float
    bending_stiffness_N_mm2: Quantity
    rest_curvature_per_mm: Quantity = 0.0
    torsional_stiffness_N_mm2: float = math.inf
    weight_N_per_mm: float = 0.0
    profile: Profile = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check and tabulate the profiles."""
        number("wire", "segment_mm", self.segment_mm, SEGMENT_MM)
        number("wire", "radius_mm", self.radius_mm, Range(0.0, THICKEST_MM, "0.18 is a 0.014 inch wire"))
        if not np.array_equal(self.torsional_stiffness_N_mm2, math.inf):  # of any kind of float
            number("wire", "torsional_stiffness_N_mm2", self.torsional_stiffness_N_mm2, STIFFNESS_N_MM2)
        number("wire", "weight_N_per_mm", self.weight_N_per_mm, Range(0.0, 1.0, "0.36 mm of steel weigh 8e-6"))
        bend = _table("bending_stiffness_N_mm2", self.bending_stiffness_N_mm2, self.segment_mm)
        rest = _table("rest_curvature_per_mm", self.rest_curvature_per_mm, self.segment_mm)
        numbers("wire", "bending_stiffness_N_mm2", bend[1], (None,), STIFFNESS_N_MM2)
        steepest = math.pi / 2 / self.segment_mm
        advice = "it is 1/radius, in radians per mm: 0.15 for a J of 6.7 mm; for a tighter bend shorten segment_mm"
        numbers("wire", "rest_curvature_per_mm", rest[1], (None,), Range(-steepest, steepest, advice))
        a, b, c, d = (read_only(array) for array in (*bend, *rest))
        profile = Profile(a, b, c, d, float(self.torsional_stiffness_N_mm2))
        object.__setattr__(self, "profile", profile)
        for name, (at, values) in (("bending_stiffness_N_mm2", bend), ("rest_curvature_per_mm", rest)):
            if np.ndim(getattr(self, name)) > 0:
                # a copy: the caller may still change the array that was given
                object.__setattr__(self, name, read_only(np.column_stack([at, values])))

    def __reduce__(self) -> tuple[type["GuideWire"], tuple[Quantity, ...]]:
        """Pickle the arguments, a callable as the table that was made of it: few callables can be pickled."""
        p, given = self.profile, (self.bending_stiffness_N_mm2, self.rest_curvature_per_mm)
        tables = (np.column_stack([p.stiffness_at, p.stiffness]), np.column_stack([p.rest_at, p.rest]))
        bend, rest = (table if callable(g) else g for g, table in zip(given, tables, strict=True))
        whole = self.torsional_stiffness_N_mm2, self.weight_N_per_mm
        return GuideWire, (self.segment_mm, self.radius_mm, bend, rest, *whole)

    @property
    def straight(self) -> bool:
        """The rest shape has no curvature: rolling such a wire changes nothing."""
        return not bool(np.any(self.profile.rest))

    @property
    def twists(self) -> bool:
        """Whether the torsional stiffness is finite."""
        return math.isfinite(self.torsional_stiffness_N_mm2)

    def segments_at(self, depth_mm: float) -> tuple[int, float]:
        """Number of segments at a depth, and length of the first, mm: ½ to 1½ segments, less if the depth is."""
        most = Range(0.0, tol.MOST_JOINTS * self.segment_mm, "use longer segments")
        count, first = segments_at(number("wire", "depth_mm", depth_mm, most), float(self.segment_mm))
        return int(count), float(first)

    def arcs_at(self, depth_mm: float) -> Any:
        """Arc lengths (k + 1,) of the joints from the entry, mm, at a depth."""
        k, first = self.segments_at(depth_mm)
        return np.concatenate([[0.0], first + self.segment_mm * np.arange(k)]) if k else np.zeros(1)
