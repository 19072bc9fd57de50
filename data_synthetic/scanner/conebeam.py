"""3D rotational X-ray as it is done: projections on an arc, photons counted, filtered back-projection (FDK).

Needs the extra [conebeam] (itk-rtk). Streaks, beam hardening of the metal wire, cone artefacts and truncation are not
drawn but follow from the physics: three energies, attenuation coefficients of the NIST tables (Hubbell and Seltzer
1995), Poisson counts, a short scan, a body wider than the field of view. Contrast may differ from scan to scan and
wash out while the arm turns; a phantom that was moved is projected again where it then lies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter

from data_synthetic.geometry import Array, ScanGrid, Volume
from data_synthetic.scanner.c_arm import Arc, CArm
from data_synthetic.scanner.coverage import bone_coverage, lumen_coverage, splat, wire_particles
from data_synthetic.scanner.phantom import Greys, Phantom, Scan, Wires

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
VESSEL_MM = 5.0
"""Thickness of the vessel in a body of water by which grey values are calibrated."""
FULL, FULL_ARC = Greys(), Arc()
"""The grey values that a full dose of 40 mg iodine per ml at full exposure stands for, and the run that gives them."""


@dataclass(frozen=True, eq=False)
class ConeBeamScanner:
    """Path lengths (projections, rows, columns) of everything that stays, and the run that sees it."""

    arm: CArm
    greys: Greys
    body: Volume
    contrast: Volume
    bone: Volume
    share: Volume

    @staticmethod
    def of(phantom: Phantom, grid: ScanGrid, arc: Arc = FULL_ARC) -> "ConeBeamScanner":
        """Project the phantom once; ImportError says how to get itk-rtk.

        Of its greys, contrast is the share of iodine, noise the exposure (photons go with its inverse square), both
        relative to the ideal scanner's defaults; drift and washout are those of the iodine.
        """
        greys, share = phantom.greys, lumen_coverage(phantom.anatomy, grid)
        arm = CArm(grid, replace(arc, photons=arc.photons * (FULL.noise / greys.noise) ** 2))
        bony = arm.paths(bone_coverage(phantom, grid))
        return ConeBeamScanner(arm, greys, arm.body_paths(), arm.paths(share), bony, share)

    def scan(self, wires: Wires, seed: Sequence[int]) -> Scan:
        """One run with wires, its photons and its dose of iodine drawn from ``seed``."""
        rng = np.random.default_rng(list(seed))
        iodine = self.iodine(1.0 + self.greys.drift * float(rng.normal()))
        seen = rng.poisson(self.counts(self.wire_paths(wires), iodine)).astype(np.float32)
        volume = self.arm.reconstruct(np.maximum(seen, 1.0) / self.arm.arc.photons)
        tissue, scale = self.calibration()
        grey = FULL.background + scale * (volume - tissue)
        return np.asarray(np.clip(np.rint(grey), -32768, 32767), dtype=np.int16)

    def iodine(self, gain: float = 1.0) -> Volume:
        """Concentration (projections, 1, 1) over the full one: it falls steadily while the arm turns."""
        g = self.greys
        full = (g.contrast - g.background) / (FULL.contrast - FULL.background)
        fall = 1.0 - g.washout * np.linspace(0.0, 1.0, self.arm.arc.projections)
        return np.asarray(gain * full * fall[:, None, None], dtype=np.float32)

    def counts(self, wire: Volume | np.float32, iodine: Volume) -> Volume:
        """Expected photons per pixel for path lengths of wire, which takes the place of contrast."""
        mu = ATTENUATION_PER_MM
        dyed = iodine * (self.contrast - wire)
        out = np.zeros_like(dyed)
        for e, weight in enumerate(ENERGY_WEIGHTS):
            paths = mu["body"][e] * self.body + mu["contrast"][e] * dyed
            paths += (mu["bone"][e] - mu["body"][e]) * self.bone + (mu["wire"][e] - mu["body"][e]) * wire
            out += np.float32(weight) * np.exp(-paths)
        return np.asarray(self.arm.arc.photons * gaussian_filter(out, (0.0, BLUR_PIXELS, BLUR_PIXELS)))

    def calibration(self) -> tuple[float, float]:
        """Attenuation per mm of tissue and greys per attenuation, as a technician finds them: a body of water with a
        vessel of full contrast in it. The same for every scan of a study, whatever is in the field of view."""
        width = float(self.body.max())
        through = ENERGY_WEIGHTS * np.exp(-ATTENUATION_PER_MM["body"] * width)
        behind = through * np.exp(-ATTENUATION_PER_MM["contrast"] * VESSEL_MM)
        vessel = -np.log(behind.sum() / through.sum()) / VESSEL_MM
        return float(-np.log(through.sum()) / width), float((FULL.contrast - FULL.background) / vessel)

    def wire_paths(self, wires: Wires) -> Volume | np.float32:
        """Path lengths of wire in mm, from a grid of half voxels around it."""
        return sum((self._wire_path(points, radius) for points, radius in wires), np.float32(0.0))

    def _wire_path(self, points: Array, radius: float) -> Volume:
        """Path lengths of one wire."""
        grid = self.arm.grid
        fine = 0.5 * grid.spacing_mm
        middle = 0.5 * (np.array(grid.shape) - 1)
        particles, volume = wire_particles(points, radius, 0.05 * grid.voxel_mm)
        place = (grid.to_index(particles) - middle) * grid.spacing_mm / fine
        low = np.floor(place.min(axis=0)) - 4
        shape = (np.ceil(place.max(axis=0)) + 5 - low).astype(int)
        share = np.zeros(tuple(shape.tolist()), dtype=np.float32)
        weights = np.full(len(place), volume / np.prod(fine))
        splat(place - low, weights, np.full(3, WIRE_BLUR_VOXELS), share)
        return self.arm.line_integrals(share, fine, (low + 0.5 * (shape - 1)) * fine)
