"""Large motions by SimpleITK: rigid registration of the walls and bones of a frame to those of the reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.motion import Motion
from pipeline.arrays.robust import spread
from pipeline.model import Array, Volume

EDGE_MEDIANS = 3.5
"""Steepness, in medians of it, from which a voxel belongs to a static structure: 5.4 sd of what noise makes."""
EDGE_SHARE = 0.4
"""and in shares of the steepness at the lumen's wall: a quieter scan shall not take the wall's skirts."""
METAL_NOISES = 6.0
"""Excess over the brightest grey that the reference has within reach, in sd of noise, that only metal can be."""
REACH_VOXELS = 4
"""How far the phantom is thought to move when metal is told from a bright wall that moved in."""
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
    wall = wall_steepness * float(np.min(scan.spacing_mm))
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
    method.SetSmoothingSigmasPerLevel([blur * float(np.min(frame.spacing_mm)) for _, blur in LEVELS])
    method.SmoothingSigmasAreSpecifiedInPhysicalUnitsOn()
    start = sitk.Euler3DTransform()
    start.SetCenter(centre_mm.tolist())
    method.SetInitialTransform(start, inPlace=True)
    method.Execute(fixed, moving)
    origin = np.array(start.TransformPoint((0.0, 0.0, 0.0)))
    return Motion(np.reshape(start.GetMatrix(), (3, 3)), origin)
