"""A C-arm run: its geometry, line integrals through volumes, and filtered back-projection, all by RTK.

RTK (itk-rtk, extra [conebeam]): Rit et al., J. Phys. Conf. Ser. 489 (2014) 012079. Short scan with Parker weights
(Med Phys 9 (1982) 254), FDK (JOSA A 1 (1984) 612), projections after Joseph (IEEE TMI 1 (1982) 192).
"""

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from data_synthetic.geometry import Array, ScanGrid, Volume

ABSENT = "scanner conebeam: itk-rtk is not installed; it comes with the extra: pip install 'wireval[conebeam]'"
"""What is said where RTK is missing."""
MARGIN = 1.16
"""The detector sees the volume's width and a sixth more: what lies further out is cut off, as a head is."""
BODY = 0.625
"""Radius of the phantom's body, an upright cylinder, over the width of the field of view: it is truncated."""
TRUNCATION = 0.2
"""Share of the detector's width over which cut-off projections are rolled down before they are filtered."""


BORDER = 2
"""Empty voxels left about a box that is projected: at a volume's border Joseph's interpolation loses weight."""


@dataclass(frozen=True)
class Arc:
    """A C-arm run. photons : per pixel without an object.     hann : cut frequency of the ramp's window."""

    projections: int = 110
    degrees: float = 200.0
    pixels: int = 320
    source_to_axis_mm: float = 785.0
    source_to_detector_mm: float = 1200.0
    photons: float = 1.5e4
    hann: float = 0.9


@dataclass(frozen=True, eq=False)
class CArm:
    """A run about the middle of a grid. Volumes are indexed x, y, z, stacks projection, row, column."""

    grid: ScanGrid
    arc: Arc

    @cached_property
    def geometry(self) -> Any:
        """RTK's geometry object."""
        _, rtk = _toolkit()
        geometry, arc = rtk.ThreeDCircularProjectionGeometry.New(), self.arc
        for angle in np.linspace(-0.5 * arc.degrees, 0.5 * arc.degrees, arc.projections):
            geometry.AddProjection(arc.source_to_axis_mm, arc.source_to_detector_mm, float(angle))
        return geometry

    @property
    def width_mm(self) -> float:
        """Widest edge of the field of view."""
        return float(np.max(np.array(self.grid.shape) * self.grid.spacing_mm))

    @property
    def pixel_mm(self) -> float:
        """Edge of a detector pixel."""
        arc = self.arc
        return MARGIN * self.width_mm * arc.source_to_detector_mm / arc.source_to_axis_mm / arc.pixels

    def paths(self, share: Volume) -> Volume:
        """Path lengths (stack) in mm through shares of voxels of the grid; only the box that is filled is projected."""
        filled = find_objects((share > 0).astype(np.int8))
        if not filled:
            return np.zeros((self.arc.projections, self.arc.pixels, self.arc.pixels), dtype=np.float32)
        low = np.array([max(f.start - BORDER, 0) for f in filled[0]])
        high = np.minimum([f.stop + BORDER for f in filled[0]], share.shape)
        part = share[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
        centre = (0.5 * (low + high - 1) - 0.5 * (np.array(share.shape) - 1)) * self.grid.spacing_mm
        return self.line_integrals(part, self.grid.spacing_mm, centre)

    def line_integrals(self, values: Volume, spacing: Array, centre: Array) -> Volume:
        """Line integrals (stack) of a volume whose middle lies at ``centre`` mm from the grid's."""
        itk, rtk = _toolkit()
        image_type = itk.Image[itk.F, 3]
        shape = (self.arc.projections, self.arc.pixels, self.arc.pixels)
        forward = rtk.JosephForwardProjectionImageFilter[image_type, image_type].New()
        forward.SetInput(0, self._detector_image(np.zeros(shape, dtype=np.float32)))
        forward.SetInput(1, _volume_image(values, spacing, centre))
        forward.SetGeometry(self.geometry)
        forward.Update()
        return np.array(itk.array_from_image(forward.GetOutput()), dtype=np.float32)

    def body_paths(self) -> Volume:
        """Path lengths (1, rows, columns) through the body: the same from every side."""
        arc = self.arc
        offset = (np.arange(arc.pixels) - 0.5 * (arc.pixels - 1)) * self.pixel_mm
        across, along = np.meshgrid(offset, offset)
        # distance of each ray from the axis, and its length per unit of the plane across the axis
        flat = np.hypot(across, arc.source_to_detector_mm)
        miss = arc.source_to_axis_mm * np.abs(across) / flat
        chord = 2.0 * np.sqrt(np.maximum((BODY * self.width_mm) ** 2 - miss**2, 0.0))
        return np.asarray((chord * np.hypot(flat, along) / flat)[None], dtype=np.float32)

    def reconstruct(self, transmission: NDArray[np.floating[Any]]) -> Volume:
        """Attenuation per mm, indexed x, y, z, of a stack of transmitted shares."""
        itk, rtk = _toolkit()
        image_type = itk.Image[itk.F, 3]
        parker = rtk.ParkerShortScanImageFilter[image_type].New()
        parker.SetInput(self._detector_image(-np.log(transmission).astype(np.float32)))
        parker.SetGeometry(self.geometry)
        parker.InPlaceOff()
        empty = np.zeros(self.grid.shape, dtype=np.float32)
        fdk = rtk.FDKConeBeamReconstructionFilter[image_type].New()
        fdk.SetInput(0, _volume_image(empty, self.grid.spacing_mm, np.zeros(3)))
        fdk.SetInput(1, parker.GetOutput())
        fdk.SetGeometry(self.geometry)
        fdk.GetRampFilter().SetTruncationCorrection(TRUNCATION)
        fdk.GetRampFilter().SetHannCutFrequency(self.arc.hann)
        fdk.Update()
        return np.ascontiguousarray(itk.array_from_image(fdk.GetOutput()).transpose(2, 0, 1))

    def _detector_image(self, stack: Volume) -> Any:
        """An image of a stack, its middle on the central ray."""
        half = 0.5 * (self.arc.pixels - 1) * self.pixel_mm
        return _image(stack, np.array([self.pixel_mm, self.pixel_mm, 1.0]), np.array([-half, -half, 0.0]))


def _toolkit() -> tuple[Any, Any]:
    """itk and its RTK module, imported when first asked for: it takes seconds and 1.6 GB of disk."""
    try:
        with warnings.catch_warnings():
            # SWIG's types warn while they load; where warnings are errors that ends in a crash of the interpreter
            warnings.simplefilter("ignore")
            import itk
            from itk import RTK

            _ = itk.Image, RTK.ThreeDCircularProjectionGeometry
    except ImportError as problem:
        raise ImportError(ABSENT) from problem
    return itk, RTK


def _volume_image(values: Volume, spacing: Array, centre: Array) -> Any:
    """RTK turns about its second axis: x, y, z become its first, third and second."""
    origin = centre - 0.5 * (np.array(values.shape) - 1) * spacing
    return _image(values.transpose(1, 2, 0), spacing[[0, 2, 1]], origin[[0, 2, 1]])


def _image(values: Volume, spacing: Array, origin: Array) -> Any:
    """An itk image of an array whose last axis is the image's first."""
    image = _toolkit()[0].image_from_array(np.ascontiguousarray(values))
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(origin.tolist())
    return image
