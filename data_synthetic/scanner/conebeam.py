"""3D rotational X-ray as it is done: projections on an arc, photons counted, filtered back-projection (FDK).

Needs the extra [conebeam] (itk-rtk). Streaks, beam hardening of the metal, cone artefacts and truncation are not drawn
but follow from the physics: three energies, attenuation coefficients of the NIST tables (Hubbell and Seltzer 1995),
Poisson counts, a short scan with Parker weights (Med Phys 9 (1982) 254), FDK (JOSA A 1 (1984) 612).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from data_synthetic.scan_grid import ScanGrid
from data_synthetic.scanner.coverage import bone_coverage, lumen_coverage, splat, wire_particles
from data_synthetic.tubes import Anatomy

Array = NDArray[np.float64]
Volume = NDArray[np.float32]

ENERGY_WEIGHTS = np.array([0.35, 0.40, 0.25])
"""Share of detected photons at 40, 60 and 80 keV: a filtered 90 kVp beam."""

ATTENUATION_PER_MM = {
    "body": np.array([0.02683, 0.02059, 0.01837]),  # water
    "contrast": np.array([0.0884, 0.0303, 0.0140]),  # 40 mg iodine per ml, beyond the water it is mixed with
    "bone": np.array([0.1278, 0.0604, 0.0428]),  # cortical
    "wire": np.array([2.86, 0.950, 0.470]),  # steel
}

BLUR_PIXELS = 0.5
"""sd of the detector's own blur."""

WIRE_BLUR_VOXELS = 0.35
"""sd, in half voxels, with which the wire is laid on its own fine grid, against aliasing."""


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
class ConeBeamScanner:
    """Path lengths (projections, rows, columns) of everything that stays, the run, and how attenuation becomes grey."""

    grid: ScanGrid
    arc: Arc
    geometry: Any
    body: Volume
    contrast: Volume
    bone: Volume
    share: Volume
    greys: tuple[float, float]

    @staticmethod
    def of(
        anatomy: Anatomy, bone: Anatomy | None, gap_mm: float, grid: ScanGrid, arc: Arc | None = None
    ) -> ConeBeamScanner:
        """Project the phantom once; ImportError says how to get itk-rtk."""
        arc = arc or Arc()
        geometry = _geometry(arc)
        share = lumen_coverage(anatomy, grid)
        bony = np.zeros_like(share) if bone is None else bone_coverage(bone, anatomy, gap_mm, grid)
        stacks = [_project(v, grid.spacing_mm, np.zeros(3), grid, arc, geometry) for v in (share, bony)]
        raw = ConeBeamScanner(
            grid, arc, geometry, _cylinder(grid, arc), stacks[0], stacks[1], share, (0.0, 1.0)
        )
        ideal = raw.reconstruct(raw.counts(np.float32(0.0)) / arc.photons)
        tissue = float(np.median(ideal[(share == 0) & (bony == 0)][::50]))
        vessel = float(np.median(ideal[share > 0.99]))
        # tissue at 100, contrast at 1000, as the ideal scanner has it
        return ConeBeamScanner(
            grid, arc, geometry, raw.body, raw.contrast, raw.bone, share, (tissue, 900.0 / (vessel - tissue))
        )

    def scan(self, wires: Sequence[tuple[Array, float]], seed: Sequence[int]) -> NDArray[np.int16]:
        """One run with wires (points (n, 3), radius), its photons drawn from ``seed``."""
        counts = self.counts(self.wire_paths(wires))
        seen = np.random.default_rng(list(seed)).poisson(counts).astype(np.float32)
        volume = self.reconstruct(np.maximum(seen, 1.0) / self.arc.photons)
        tissue, scale = self.greys
        grey = 100.0 + scale * (volume - tissue)
        return np.asarray(np.clip(np.rint(grey), -32768, 32767), dtype=np.int16)

    def counts(self, wire: Volume | np.float32) -> Volume:
        """Expected photons per pixel for path lengths of wire, which takes the place of contrast."""
        mu = ATTENUATION_PER_MM
        out = np.zeros_like(self.body)
        for e, weight in enumerate(ENERGY_WEIGHTS):
            paths = mu["body"][e] * self.body + mu["contrast"][e] * (self.contrast - wire)
            paths += (mu["bone"][e] - mu["body"][e]) * self.bone + (mu["wire"][e] - mu["body"][e]) * wire
            out += np.float32(weight) * np.exp(-paths)
        return np.asarray(self.arc.photons * gaussian_filter(out, (0.0, BLUR_PIXELS, BLUR_PIXELS)))

    def wire_paths(self, wires: Sequence[tuple[Array, float]]) -> Volume | np.float32:
        """Path lengths of wire in mm, from a grid of half voxels around it."""
        if not wires:
            return np.float32(0.0)
        out = np.zeros_like(self.body)
        for points, radius in wires:
            out += self._wire_path(points, radius)
        return out

    def _wire_path(self, points: Array, radius: float) -> Volume:
        fine = 0.5 * self.grid.spacing_mm
        middle = 0.5 * (np.array(self.grid.shape) - 1)
        particles, volume = wire_particles(points, radius, 0.05 * self.grid.voxel_mm)
        place = (self.grid.to_index(particles) - middle) * self.grid.spacing_mm / fine
        low = np.floor(place.min(axis=0)) - 4
        shape = (np.ceil(place.max(axis=0)) + 5 - low).astype(int)
        share = np.zeros(tuple(shape.tolist()), dtype=np.float32)
        splat(place - low, np.full(len(place), volume / np.prod(fine)), np.full(3, WIRE_BLUR_VOXELS), share)
        centre = (low + 0.5 * (shape - 1)) * fine
        return _project(share, fine, centre, self.grid, self.arc, self.geometry)

    def reconstruct(self, transmission: NDArray[np.floating[Any]]) -> Volume:
        """Attenuation per mm, indexed x, y, z."""
        itk, rtk = _toolkit()
        image_type = itk.Image[itk.F, 3]
        lines = _detector_image(-np.log(transmission).astype(np.float32), self.grid, self.arc)
        parker = rtk.ParkerShortScanImageFilter[image_type].New()
        parker.SetInput(lines)
        parker.SetGeometry(self.geometry)
        parker.InPlaceOff()
        empty = _volume_image(np.zeros(self.grid.shape, dtype=np.float32), self.grid.spacing_mm, np.zeros(3))
        fdk = rtk.FDKConeBeamReconstructionFilter[image_type].New()
        fdk.SetInput(0, empty)
        fdk.SetInput(1, parker.GetOutput())
        fdk.SetGeometry(self.geometry)
        fdk.GetRampFilter().SetTruncationCorrection(0.2)
        fdk.GetRampFilter().SetHannCutFrequency(self.arc.hann)
        fdk.Update()
        return np.ascontiguousarray(itk.array_from_image(fdk.GetOutput()).transpose(2, 0, 1))


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
        msg = "scanner conebeam: itk-rtk is not installed; it comes with the extra: pip install 'wireval[conebeam]'"
        raise ImportError(msg) from problem
    return itk, RTK


def _geometry(arc: Arc) -> Any:
    _, rtk = _toolkit()
    geometry = rtk.ThreeDCircularProjectionGeometry.New()
    for angle in np.linspace(-0.5 * arc.degrees, 0.5 * arc.degrees, arc.projections):
        geometry.AddProjection(arc.source_to_axis_mm, arc.source_to_detector_mm, float(angle))
    return geometry


def _volume_image(values: Volume, spacing: Array, centre: Array) -> Any:
    """RTK turns about its second axis: x, y, z become its first, third and second."""
    itk, _ = _toolkit()
    image = itk.image_from_array(np.ascontiguousarray(values.transpose(1, 2, 0)))
    order = [0, 2, 1]
    origin = centre - 0.5 * (np.array(values.shape) - 1) * spacing
    image.SetSpacing([float(spacing[a]) for a in order])
    image.SetOrigin([float(origin[a]) for a in order])
    return image


def _pixel_mm(grid: ScanGrid, arc: Arc) -> float:
    """The detector sees the volume's width and a sixth more: what lies further out is cut off."""
    width = (
        float(np.max(np.array(grid.shape) * grid.spacing_mm))
        * arc.source_to_detector_mm
        / arc.source_to_axis_mm
    )
    return 1.16 * width / arc.pixels


def _detector_image(stack: Volume, grid: ScanGrid, arc: Arc) -> Any:
    itk, _ = _toolkit()
    image = itk.image_from_array(np.ascontiguousarray(stack))
    pixel = _pixel_mm(grid, arc)
    half = 0.5 * (arc.pixels - 1) * pixel
    image.SetSpacing([pixel, pixel, 1.0])
    image.SetOrigin([-half, -half, 0.0])
    return image


def _project(
    values: Volume, spacing: Array, centre: Array, grid: ScanGrid, arc: Arc, geometry: Any
) -> Volume:
    """Line integrals (projections, rows, columns) of a volume, after Joseph (IEEE TMI 1 (1982) 192)."""
    itk, rtk = _toolkit()
    image_type = itk.Image[itk.F, 3]
    blank = _detector_image(np.zeros((arc.projections, arc.pixels, arc.pixels), dtype=np.float32), grid, arc)
    volume = _volume_image(values, spacing, centre)
    forward = rtk.JosephForwardProjectionImageFilter[image_type, image_type].New()
    forward.SetInput(0, blank)
    forward.SetInput(1, volume)
    forward.SetGeometry(geometry)
    forward.Update()
    return np.array(itk.array_from_image(forward.GetOutput()), dtype=np.float32)


def _cylinder(grid: ScanGrid, arc: Arc) -> Volume:
    """Path lengths through the phantom's body: an upright cylinder a quarter wider than the field of view."""
    radius = 0.625 * float(np.max(np.array(grid.shape) * grid.spacing_mm))
    pixel = _pixel_mm(grid, arc)
    offset = (np.arange(arc.pixels) - 0.5 * (arc.pixels - 1)) * pixel
    across, along = np.meshgrid(offset, offset)
    # distance of each ray from the axis, and its length per unit of the plane across the axis
    flat = np.hypot(across, arc.source_to_detector_mm)
    miss = arc.source_to_axis_mm * np.abs(across) / flat
    chord = 2.0 * np.sqrt(np.maximum(radius**2 - miss**2, 0.0)) * np.hypot(flat, along) / flat
    return np.broadcast_to(chord.astype(np.float32), (arc.projections, arc.pixels, arc.pixels)).copy()
