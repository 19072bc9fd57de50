"""What a study needs to be one: at least one frame, voxels that show lumen and wire, a scan that holds the way."""

import importlib.util
import math
from dataclasses import dataclass

import numpy as np

from data_synthetic.catalogue.scene import NamedScene, Setup
from data_synthetic.geometry import arc_lengths
from data_synthetic.scanner.c_arm import ABSENT

BONE_WIRES = 1.8
"""Wire diameters that a voxel beside bone may be wide. A wire's peak falls with the voxel's area, what bone leaves in
the difference of two scans does not: a wire of 0.36 mm is traced with voxels of 0.65 mm, and lost from 0.75 mm on."""


MOST = {"frames": 10_000, "size": 1500, "seed": 2**63 - 1}
"""Largest numbers of a study. A scan of 1500 voxels along each axis takes 65 GiB of memory while it is made (20 bytes a
voxel), as much as a large workstation has."""


@dataclass(frozen=True)
class Wanted:
    """The numbers of a study; those that are None are the scene's own, the voxel its field of view over ``size``."""

    frames: int | None = None
    size: int | None = None
    voxel_mm: float | None = None
    seed: int = 0

    def of(self, scene: NamedScene) -> tuple[int, int, float]:
        """Frames, size and voxel in mm for a scene."""
        size = scene.size if self.size is None else self.size
        return self.frames or scene.frames, size, self.voxel_mm or scene.fov_mm / max(size, 1)

    def problems(self, scene: NamedScene | None = None, scanner: str = "psf") -> list[str]:
        """A sentence for everything that cannot be meant or done, known before any truth is computed.

        scene : whose lumen and wire the pipeline shall find in the scans; None where nobody wants to (small tests).
        """
        found = []
        if scanner == "conebeam" and importlib.util.find_spec("itk") is None:
            found.append(ABSENT)
        # with a scene, _too_small tells what size it needs
        least_size = -math.inf if scene is not None else 1
        for name, value, least in (("frames", self.frames, 1), ("size", self.size, least_size), ("seed", self.seed, 0)):
            if value is not None and value < least:
                found.append(f"{name}: got {value}; allowed: {least} or more; leave it out for the default")
            elif value is not None and value > MOST[name]:
                memory = " (65 GiB of memory)" if name == "size" else ""
                got = value if value < 1e20 else "a number of more than 20 digits"
                found.append(f"{name}: got {got}; allowed: up to {MOST[name]}{memory}; give less or leave it out")
        if self.voxel_mm is not None and not 0 < self.voxel_mm < math.inf:
            found.append(f"voxel-mm: got {self.voxel_mm:g}; allowed: above 0; leave it out for the default")
        # a real scan is as large as it is
        return found if found or scene is None or scene.scan is not None else self._too_small(scene)

    def _too_small(self, scene: NamedScene) -> list[str]:
        """What keeps lumen and wire of a scene from being found, at most one sentence."""
        frames, size, voxel = self.of(scene)
        setup = scene.plan(np.random.default_rng([self.seed, 1]), frames)
        largest, needs = largest_voxel(scene, setup)
        if self.voxel_mm is None:
            least = scene.fov_mm / largest
        elif voxel > largest:
            allowed = f"allowed for {scene.name}: up to {largest:.2f} for {needs}; give less or leave it out"
            return [f"voxel-mm: got {voxel:g}; {allowed}"]
        else:
            least, needs = width_of_way(setup) / voxel, "a scan that holds the wire's way"
        smallest = math.ceil(least - 1e-9)  # not one more where rounding made a whole number larger
        if size >= smallest:
            return []
        allowed = f"allowed for {scene.name}: {smallest} or more for {needs}; give more or leave it out"
        return [f"size: got {size}, voxels of {voxel:.2f} mm; {allowed}"]


def largest_voxel(scene: NamedScene, setup: Setup) -> tuple[float, str]:
    """The widest voxel in mm with which the scene's lumen and wire are found, and what needs it."""
    calibre = 2.0 * float(np.median(setup.tube.radii_mm[setup.ahead]))
    lumen, beside_bone = calibre / scene.voxels_across, BONE_WIRES * 2.0 * setup.wire.radius_mm
    if setup.bone is not None and beside_bone < lumen:
        return beside_bone, f"voxels no wider than {BONE_WIRES:g} wires beside bone"
    return lumen, f"{scene.voxels_across:g} voxels across a lumen of {calibre:.1f} mm"


def width_of_way(setup: Setup) -> float:
    """Edge in mm of the least cube about the scan's middle that holds the entered vessel, as far as the wire goes."""
    points, radii = setup.tube.points_mm[setup.ahead], setup.tube.radii_mm[setup.ahead]
    reached = arc_lengths(points) <= max(setup.depths_mm)
    away = np.abs((points - setup.centre_mm) @ (np.eye(3) if setup.axes is None else setup.axes))
    return 2.0 * float(np.max((away + radii[:, None])[reached]))
