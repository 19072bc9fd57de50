"""The vessel wall: the signed distance to the lumen, interpolated so that energies can be checked."""

import warnings
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver._kernels.data import Field
from solver._kernels.field import BLOCK, bounds, look_up, prefilter
from solver.creases import creases
from solver.doors import ANYWHERE_MM, FAR_MM, Array, Found, Range, instance, number, numbers
from solver.errors import refuse
from solver.grid import Grid, read_only
from solver.wire import THICKEST_MM

STIFFNESS_N_MM2 = Range(1e-9, 1e9, "0.1 to 100 is usual")
OFFSET_MM = Range(-FAR_MM, FAR_MM, "a tenth of a voxel is usual")
MAKE_A_DISTANCE = (
    "a mask of the lumen is made one by scipy.ndimage: gaussian_filter("
    "distance_transform_edt(~mask, spacing_mm) - distance_transform_edt(mask, spacing_mm), "
    "[min(spacing_mm) / mm for mm in spacing_mm])"
)
SLICES = 16
FLAT, STEEP = 0.5, 1.75
"""Gradients at the wall that no distance in mm has: in voxels of 0.5 mm it is 2, in metres 0.001. A lumen of a voxel's
radius has 1.0, one with noise of half a voxel 1.6."""
NO_LUMEN = 1e-6
"""Of a voxel: what rounding leaves of a distance of 0."""
BAND_MM, LEVEL, CUT_SHARE = 2.0, 0.95, 0.25
"""A distance that goes no farther outside, and in this share of the cells stays within a twentieth of that (a band that
is resampled overshoots), is cut off, as a narrow band is: an axis that is pressed beyond it meets no wall. Cut off at
0.5 and 1.2 mm, stiff wires lay 9 and 23 mm outside, at rest; at 1.5 mm 0.6 mm, as by the whole distance."""


def _is_mask(values: Array, least: float, largest: float) -> bool:
    """Whether values (nx, ny, nz) are a mask, of any two numbers, or the signs of a distance: three values at most.

    Their signs prove nothing: a lumen thinner than a voxel may have no negative value, one of a few voxels only one.
    A distance on four or more voxels along each axis has more than three values, or the same value everywhere.
    """
    if least == largest:
        return least in (0.0, 1.0)
    if least == 0.0 and largest == 1.0 and bool(np.all((values == 0.0) | (values == 1.0))):
        return True
    # each look is at more of them: two are there to be left early, with most grids after the first
    looks = values.reshape(-1)[:: max(1, values.size // 4096)], values[::3, ::3, ::3], values
    return min(values.shape) > 3 and all(np.unique(few).size <= 3 for few in looks)


def _checked(grid: Grid) -> Array:
    """The distances as a new float64 array; ValueError where they cannot be signed distances in mm."""
    if grid.values.dtype.kind != "f":
        found, allowed = Found(f"values of type {grid.values.dtype}"), "floating-point signed distances in mm"
        refuse("wall", "distance", found, allowed, MAKE_A_DISTANCE)
    values = np.array(grid.values, dtype=np.float64, order="C")
    if min(values.shape) < 2:
        refuse("wall", "grid shape", values.shape, "at least 2 voxels along each axis", "pad the distance map")
    # whatever is undefined is so in the sum, which takes no memory
    with np.errstate(invalid="ignore", over="ignore"):
        total = values.sum()
    if not np.isfinite(total) and (bad := ~np.isfinite(values)).any():
        where = [int(i) for i in np.argwhere(bad)[0]]
        got = f"{values[tuple(where)]} at voxel {where} ({int(bad.sum())} such voxels)"
        refuse("wall", "grid values", got, "finite signed distances in mm", "fill or crop these voxels")
    least, largest = float(values.min()), float(values.max())
    if max(-least, largest) > FAR_MM or _is_mask(values, least, largest):
        few = "no more than three " if max(-least, largest) <= FAR_MM else ""
        got = Found(f"{few}values from {least:g} to {largest:g}")
        refuse("wall", "grid values", got, "signed distances in mm, negative inside", MAKE_A_DISTANCE)
    return values


def steepness(values: Array, spacing_mm: Array) -> float:
    """Median gradient of distances (nx, ny, nz) over spacing (3,) where their sign changes; NaN where it never does.

    Looks at SLICES slices: the whole grid would take as long as the spline.
    """
    at = np.arange(0, len(values) - 1, max(1, len(values) // SLICES))
    here = values[at, :-1, :-1]
    beside = values[at + 1, :-1, :-1], values[at, 1:, :-1], values[at, :-1, 1:]
    crossed = np.any([np.signbit(here) != np.signbit(other) for other in beside], axis=0)
    if not crossed.any():
        return float("nan")
    steps = [(other[crossed] - here[crossed]) / h for other, h in zip(beside, spacing_mm, strict=True)]
    return float(np.median(np.linalg.norm(steps, axis=0)))


def _doubts(values: Array, spacing_mm: Array) -> str:
    """What is doubtful in distances (nx, ny, nz): there is no lumen, or the gradient at the wall is not 1; or empty.

    A lumen thinner than a voxel may have no negative value either, so that it is no error.
    """
    least, steep = float(values.min()), steepness(values, spacing_mm)
    if least > -NO_LUMEN * spacing_mm.min():
        return (
            f"the least value is {least:.2g} mm, so that the grid holds no lumen: distances are negative inside; "
            f"{MAKE_A_DISTANCE}; of a distance to a centreline subtract the vessel's radius"
        )
    if FLAT <= steep <= STEEP or np.isnan(steep):
        return _cut_off(values)
    return (
        f"it changes by {steep:.2g} per mm across the wall, a signed distance in mm by 1; is it in voxels or in "
        "metres, or a difference of two distance transforms that was not smoothed (gaussian_filter), is the "
        "spacing right, are the axes x, y, z?"
    )


def _cut_off(values: Array) -> str:
    """That distances (nx, ny, nz) end where a wire may yet be pressed to; empty where they do not."""
    most = float(values.max())
    if not 0.0 < most < BAND_MM:
        return ""
    level = values > LEVEL * most
    for axis in range(3):  # level all over a cell: a whole distance may end level at the grid's side, and goes on there
        level = np.logical_and(*(np.delete(level, end, axis) for end in (0, -1)))
    if np.count_nonzero(level) < CUT_SHARE * level.size:
        return ""
    return (
        f"it is cut off at {most:.2g} mm outside the lumen: a wire that is pressed so deep meets no wall, and comes to "
        "rest far outside; give the distance up to 3 mm (segment.outer_mm of a run)"
    )


def _padded(coefficients: Array) -> NDArray[np.float32]:
    """Coefficients with their ghost layers: c[-1] = 2 c[0] - c[1], which goes on linearly beyond the grid.

    Each layer is made from the two outermost ones: a padded copy of all, in float64, took twice as long as the filter.
    """
    out = np.empty([n + 2 for n in coefficients.shape], np.float32)
    out[1:-1, 1:-1, 1:-1] = coefficients
    for axis, (two, layer) in product(range(3), ((slice(0, 2), 0), (slice(-2, None), -1))):
        all_of = [slice(None)] * axis
        outermost = np.pad(coefficients[(*all_of, two)], 1, mode="reflect", reflect_type="odd")
        out[(*all_of, layer)] = outermost[(*all_of, layer)]
    return out


def _bounds(coefficients: NDArray[np.float32], to_index: Array) -> tuple[float, float]:
    """See the kernel."""
    inside = np.empty([(n - 1) // BLOCK + 1 for n in coefficients.shape], np.uint8)
    gap, slope = bounds(coefficients, to_index, inside)
    return float(gap), float(slope)


@dataclass(frozen=True, eq=False, repr=False)
class VesselWall:
    """The wall of a lumen, given by the signed distance to it in mm, negative inside. Its law is ``_kernels.wall_law``.

    stiffness_N_mm2 : k, in N/mm per mm of wire.     friction : Coulomb's coefficient; 0 costs no time.
    hull : how the overlap d of a round wire with the wall is measured. "offset" takes its deepest point, d = max(0, φ +
    radius). "samples:N" takes the mean over N points around each joint. With the same k, a wall is softer with samples,
    and the more so the less deep the wire is pressed in, since few of the N points are then in the wall.
    Beyond the grid the distance continues linearly. Raises ValueError for NaN or inf in the grid; warns if no value is
    negative, if the slope at the wall shows that the values are no distances in mm, or if these are cut off right
    beyond the wall; ``doubts`` says so, too.
    """

    distance: Grid
    stiffness_N_mm2: float
    friction: float = 0.0
    hull: str = "offset"
    doubts: str = field(init=False)
    middle_mm: Array = field(init=False)
    field: Field = field(init=False)

    def __post_init__(self) -> None:
        """Prefilter the distances into spline coefficients, so that the spline takes the values at the nodes."""
        self._check_law()
        _ = self.samples
        values = _checked(instance("wall", "distance", self.distance, Grid))
        object.__setattr__(self, "doubts", _doubts(values, self.distance.spacing_mm))
        if self.doubts:
            warnings.warn(f"wall: distance: {self.doubts}", stacklevel=3)
        marks = creases(values, self.distance.spacing_mm)
        prefilter(values)
        to_index = np.ascontiguousarray((self.distance.direction / self.distance.spacing_mm).T)
        coefficients = _padded(values)
        gap, slope = _bounds(coefficients, to_index)
        # kernels count from the grid's middle: 1 m from the scanner's origin, rounding doubled the wires in doubt
        middle = np.round(self.distance.to_mm(0.5 * np.array(values.shape)))
        object.__setattr__(self, "middle_mm", read_only(middle))
        origin, spacing = np.array(self.distance.origin_mm) - middle, self.distance.voxel_mm
        object.__setattr__(self, "field", Field(coefficients, to_index, origin, gap, slope, spacing, marks))

    def __repr__(self) -> str:
        """What a prompt and messages show: not its distances."""
        return f"VesselWall({self.stiffness_N_mm2:g} N/mm2, friction {self.friction:g}, {self.hull}, {self.distance!r})"

    def _check_law(self) -> None:
        """Refuse a stiffness or a friction that no wall has."""
        number("wall", "stiffness_N_mm2", self.stiffness_N_mm2, STIFFNESS_N_MM2)
        number("wall", "friction", self.friction, Range(0.0, 10.0, "hydrophilic wires have 0.01 to 0.1"))

    def like(self, *, stiffness_N_mm2: float | None = None, friction: float | None = None) -> "VesselWall":
        """The same lumen with another stiffness or friction: its grid is shared, and not filtered again."""
        other = copy(self)
        for name, value in (("stiffness_N_mm2", stiffness_N_mm2), ("friction", friction)):
            if value is not None:
                object.__setattr__(other, name, value)
        other._check_law()
        return other

    def shifted(self, offset_mm: ArrayLike) -> "VesselWall":
        """The wall with an offset (nx, ny, nz), mm, added to its distance; a positive offset makes the lumen narrower.

        It takes half the time of a new wall, since creases of the distance are assumed to stay where they were: the
        offset must be smooth and small.
        """
        offset = numbers("wall", "offset_mm", offset_mm, self.distance.shape, OFFSET_MM).copy()
        values = self.distance.values + offset
        prefilter(offset)
        coefficients = self.field.coefficients + _padded(offset)
        gap, slope = _bounds(coefficients, self.field.to_index)
        other, moved = copy(self), self.distance.with_values(read_only(values))
        object.__setattr__(other, "distance", moved)
        object.__setattr__(other, "field", self.field._replace(coefficients=coefficients, gap=gap, slope=slope))
        return other

    @cached_property
    def samples(self) -> int:
        """Number of hull points around a joint; 0 is the smooth hull."""
        if isinstance(self.hull, str) and self.hull == "offset":
            return 0
        name, _, count = self.hull.partition(":") if isinstance(self.hull, str) else ("", "", "")
        if name != "samples" or not (
            count.isascii() and count.isdigit() and len(count) <= 3 and 1 <= int(count) <= 256
        ):
            refuse("wall", "hull", self.hull, '"offset" or "samples:N", N from 1 to 256', "samples:16 is usual")
        return int(count)

    def hull_points(self, radius_mm: float) -> tuple[Array, float]:
        """Offsets (h, 2), mm, across a wire of this radius at which the distance is looked up, and mm to add to it."""
        radius_mm = number("wall", "radius_mm", radius_mm, Range(0.0, THICKEST_MM, "0.18 is a 0.014 inch wire"))
        if self.samples == 0:
            return np.zeros((1, 2)), radius_mm
        angle = 2 * np.pi * np.arange(self.samples) / self.samples
        return radius_mm * np.column_stack([np.cos(angle), np.sin(angle)]), 0.0

    def look_up(self, points_mm: ArrayLike) -> tuple[Array, Array, Array]:
        """Distance (n,) mm, gradient (n, 3) and Hessian (n, 3, 3) per mm of the interpolant at points (n, 3)."""
        points = np.atleast_2d(numbers("wall", "points_mm", points_mm, (..., 3), ANYWHERE_MM))
        if points.ndim != 2:
            refuse("wall", "points_mm", points.shape, "points (n, 3)", "reshape them")
        jets = np.zeros((len(points), 10))
        look_up(self.field, np.ascontiguousarray(points - self.middle_mm), jets)
        order = [[4, 7, 8], [7, 5, 9], [8, 9, 6]]
        return jets[:, 0], jets[:, 1:4], jets[:, order]
