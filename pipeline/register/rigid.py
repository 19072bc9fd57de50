"""A rigid motion of the phantom between two scans, and large ones by SimpleITK, where coarse fits find none."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.spatial.transform import Rotation

from pipeline.arrays.grids import spread
from pipeline.model import Array, Volume
from solver.grid import read_only

EDGE_MEDIANS = 3.5
"""Steepness over the scan's median steepness from which a voxel is a static structure: 5.4 sd of what noise makes."""
EDGE_SHARE = 0.4
"""The same over the steepness at the lumen's wall: without it a quiet scan would take the wall's blurred skirts."""
METAL_NOISES = 6.0
"""Excess over the brightest grey within REACH_VOXELS in the reference, in sd of noise, from which a voxel is metal."""
REACH_VOXELS = 4
"""Largest motion of the phantom that is assumed, so that a bright wall that moved is not taken for metal."""
HALO_VOXELS = 2
"""What blur makes of a metal voxel on either side."""
SHARE = 0.25
"""Share of the masked voxels that the metric looks at."""
SEED = 1
"""Regular samples are jittered; a fixed seed makes a run repeatable."""
LEVELS = ((4, 4.0), (4, 2.0), (2, 1.0))
"""Shrink factor and blur (voxels) of each level: the coarsest sees motions of a vessel's width; what the finer one
leaves, a few tenths of a voxel, is left to least squares."""
ITERATIONS = 60


@dataclass(frozen=True, eq=False)
class Motion:
    """The phantom's point at ``p`` in the reference scan lies at ``rotation @ p + shift_mm`` in the frame (LPS mm)."""

    rotation: Array = field(default_factory=lambda: np.eye(3))
    shift_mm: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "rotation", read_only(self.rotation, np.float64))
        object.__setattr__(self, "shift_mm", read_only(self.shift_mm, np.float64))

    @staticmethod
    def about(centre_mm: ArrayLike, rotation_rad: ArrayLike, shift_mm: ArrayLike) -> "Motion":
        """A turn by the rotation vector (3,) about a centre, then a shift (3,)."""
        turn = Rotation.from_rotvec(np.asarray(rotation_rad, float)).as_matrix()
        centre = np.asarray(centre_mm, float)
        return Motion(turn, centre + np.asarray(shift_mm, float) - turn @ centre)

    def moved(self, points_mm: ArrayLike) -> Array:
        """Where points (..., 3) of the reference scan lie in the frame."""
        return np.asarray(np.asarray(points_mm, float) @ self.rotation.T + self.shift_mm)

    def then(self, later: "Motion") -> "Motion":
        """This motion followed by another."""
        return Motion(later.rotation @ self.rotation, later.moved(self.shift_mm))

    def after(self, earlier: "Motion") -> "Motion":
        """What this motion adds to an earlier one: ``earlier.then(m.after(earlier))`` is ``m``."""
        turn = self.rotation @ earlier.rotation.T
        return Motion(turn, self.shift_mm - turn @ earlier.shift_mm)

    def displacement_mm(self, points_mm: ArrayLike) -> Array:
        """How far (..., 3) each point moves."""
        return np.asarray(self.moved(points_mm) - np.asarray(points_mm, float))

    @property
    def angle_deg(self) -> float:
        """Size of the rotation."""
        return float(np.degrees(Rotation.from_matrix(self.rotation).magnitude()))

    def undone(self, frame: Volume) -> Volume:
        """The frame in the reference's coordinates: the same values, with a geometry that takes the motion back."""
        origin = self.rotation.T @ (frame.origin_mm - self.shift_mm)
        return replace(frame, origin_mm=origin, direction=self.rotation.T @ frame.direction)


def _image(values: NDArray[Any], scan: Volume) -> sitk.Image:
    image = sitk.GetImageFromArray(np.ascontiguousarray(values.transpose(2, 1, 0)))
    image.SetSpacing(scan.spacing_mm.tolist())
    image.SetOrigin(scan.origin_mm.tolist())
    image.SetDirection(scan.direction.ravel().tolist())
    return image


def edge_mask(scan: Volume, wall_steepness: float) -> NDArray[np.bool_]:
    """Voxels of walls and bones: where blurred grey is steeper than noise makes it.

    wall_steepness : gradient at the lumen's wall per mm, in the same blur of one voxel.
    """
    steep = ndimage.gaussian_gradient_magnitude(np.asarray(scan.values, np.float32), 1.0)
    wall = wall_steepness * scan.voxel_mm
    return np.asarray(steep > max(EDGE_MEDIANS * float(np.median(steep)), EDGE_SHARE * wall))


def metal_mask(frame: Volume, reference: Volume) -> NDArray[np.bool_]:
    """Voxels of the frame brighter than anything that the reference has nearby, with a halo; one lattice for both."""
    size = 2 * REACH_VOXELS + 1
    ceiling = ndimage.maximum_filter(reference.values, size)
    difference = np.asarray(frame.values, np.float32) - reference.values
    metal = np.asarray(frame.values, np.float32) > ceiling + METAL_NOISES * spread(difference)
    return np.asarray(ndimage.binary_dilation(metal, iterations=HALO_VOXELS) if metal.any() else metal)


def rigid(frame: Volume, reference: Volume, edges: NDArray[np.bool_], centre_mm: Array) -> Motion:
    """The motion of the phantom from the reference to the frame, from rest, by correlation at walls and bones.

    Both scans on one lattice; edges : the reference's (:func:`edge_mask`). Deterministic: regular samples, one thread.
    At rest where too little is seen of the edges for a metric.
    """
    fixed, moving = (_image(np.asarray(v.values, np.float32), v) for v in (reference, frame))
    method = sitk.ImageRegistrationMethod()
    method.SetNumberOfThreads(1)
    method.SetMetricAsCorrelation()
    method.SetMetricFixedMask(_image(edges.astype(np.uint8), reference))
    method.SetMetricMovingMask(_image((~metal_mask(frame, reference)).astype(np.uint8), frame))
    method.SetMetricSamplingStrategy(method.REGULAR)
    method.SetMetricSamplingPercentage(SHARE, SEED)
    method.SetInterpolator(sitk.sitkLinear)
    method.SetOptimizerAsRegularStepGradientDescent(
        learningRate=float(np.max(frame.spacing_mm)), minStep=1e-3, numberOfIterations=ITERATIONS
    )
    method.SetOptimizerScalesFromPhysicalShift()
    method.SetShrinkFactorsPerLevel([shrink for shrink, _ in LEVELS])
    method.SetSmoothingSigmasPerLevel([blur * frame.voxel_mm for _, blur in LEVELS])
    method.SmoothingSigmasAreSpecifiedInPhysicalUnitsOn()
    start = sitk.Euler3DTransform()
    start.SetCenter(centre_mm.tolist())
    method.SetInitialTransform(start, inPlace=True)
    try:
        method.Execute(fixed, moving)
    except RuntimeError as error:
        if "FixedSampledPointSet" not in str(error):
            raise
        return Motion()  # no sample lies on an edge: noise hides them, or metal covers them
    return Motion(np.reshape(start.GetMatrix(), (3, 3)), np.array(start.TransformPoint((0.0, 0.0, 0.0))))
