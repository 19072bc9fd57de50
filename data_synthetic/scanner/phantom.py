"""What a scanner sees of a scene: vessels, bone and their grey values, the wires, and the scan that comes of it."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field

import numpy as np
from numpy.typing import NDArray

from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry import Array

Scan = NDArray[np.int16]
Wires = Sequence[tuple[Array, float]]
"""Points (n, 3) and the radius of every wire."""


@dataclass(frozen=True)
class Greys:
    """Grey values of the materials, noise and blur.

    wire : with 0.36 mm of wire in 0.3 mm voxels 6000 gives a contrast-to-noise of 12.
    noise : sd per voxel at a voxel of 0.3 mm. It goes with voxel^-2, as a thin wire's peak does, so that a small study
    differs in sampling, not in contrast to noise.     correlation_voxels : sd of the noise's own smoothing.
    psf_voxels : sd of the point spread.     drift : sd of a frame's gain.
    washout : share of the contrast that is lost while a cone-beam scan turns; the ideal scanner sees the mean.
    """

    background: float = 100.0
    contrast: float = 1000.0
    bone: float = 1300.0
    wire: float = 6000.0
    noise: float = 100.0
    psf_voxels: float = 0.8
    correlation_voxels: float = 0.5
    drift: float = 0.005
    washout: float = 0.0


@dataclass(frozen=True, eq=False)
class Phantom:
    """Vessels and what lies beside them, without a wire.     bone_gap_mm : what bone keeps from the lumen."""

    anatomy: Anatomy
    _: KW_ONLY
    bone: Anatomy | None = None
    bone_gap_mm: float = 1.2
    greys: Greys = field(default_factory=Greys)
