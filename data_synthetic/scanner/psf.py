"""The ideal scanner: partial volume, Gaussian point spread, correlated noise, slow drift of the intensity."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from data_synthetic.geometry import Array, ScanGrid, Volume
from data_synthetic.scanner.coverage import CUT, bone_coverage, lumen_coverage, splat, wire_particles
from data_synthetic.scanner.phantom import Greys, Phantom, Scan, Wires

WIRE_STEP_VOXELS = 0.1
"""Distance between the discs of points that fill the wire; blurred by 0.8 voxel, nothing of it is left to see."""


@dataclass(frozen=True, eq=False)
class PsfScanner:
    """A phantom in front of a scanner: ``sharp`` before and ``blurred`` after the point spread, both without wire."""

    grid: ScanGrid
    greys: Greys
    sharp: Volume
    blurred: Volume

    @staticmethod
    def of(phantom: Phantom, grid: ScanGrid) -> "PsfScanner":
        """Voxelise the phantom once."""
        greys, sharp = phantom.greys, lumen_coverage(phantom.anatomy, grid)
        sharp *= (1.0 - 0.5 * greys.washout) * (greys.contrast - greys.background)
        sharp += greys.background
        # bone shares a voxel with tissue, never with lumen: the gap keeps them apart
        sharp += bone_coverage(phantom, grid) * (greys.bone - sharp)
        blurred = gaussian_filter(sharp, _psf_voxels(grid, greys), truncate=CUT, mode="nearest")
        return PsfScanner(grid, greys, sharp, blurred)

    def scan(self, wires: Wires, seed: Sequence[int]) -> Scan:
        """One volume with wires, indexed x, y, z, its noise drawn from ``seed``."""
        rng = np.random.default_rng(list(seed))
        out = self._noise(rng)
        gain = 1.0 + self.greys.drift * float(rng.normal())
        out += np.float32(gain) * self.blurred
        for points, radius in wires:
            self._paint(out, points, radius, gain)
        return np.clip(np.rint(out, out=out), -32768, 32767).astype(np.int16)

    def _paint(self, out: Volume, points: Array, radius: float, gain: float) -> None:
        """Blur first, then integrate over voxels, as a detector does: no aliasing of a wire thinner than a voxel."""
        particles, volume = wire_particles(points, radius, WIRE_STEP_VOXELS * self.grid.voxel_mm)
        index = self.grid.to_index(particles)
        nearest = np.clip(np.rint(index).astype(np.int64), 0, np.array(self.grid.shape) - 1)
        replaced = self.sharp[tuple(nearest.T)]
        weights = gain * volume / float(np.prod(self.grid.spacing_mm)) * (self.greys.wire - replaced)
        splat(index, weights.astype(np.float64), _psf_voxels(self.grid, self.greys), out)

    def _noise(self, rng: np.random.Generator) -> Volume:
        """Gaussian noise of the asked sd after its own smoothing."""
        sd = self.greys.noise * (0.3 / self.grid.voxel_mm) ** 2
        white = rng.standard_normal(self.grid.shape, dtype=np.float32)
        correlation = self.greys.correlation_voxels
        gaussian_filter(white, correlation, truncate=CUT, mode="wrap", output=white)
        # what is left of the sd: the root of the sum of squares of the three-dimensional kernel
        kernel = gaussian_filter(np.eye(1, 64, 32)[0], correlation, truncate=CUT)
        white *= np.float32(sd / float(np.sum(kernel**2) ** 1.5))
        return white


def _psf_voxels(grid: ScanGrid, greys: Greys) -> Array:
    """sd of the point spread along each axis, voxels: isotropic in mm."""
    return np.asarray(greys.psf_voxels * grid.voxel_mm / grid.spacing_mm)
