"""Every setting of a run: one frozen dataclass per stage, one TOML table each, a docstring line per field.

Performance settings live in their own table and never enter a cache key.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class LoadConfig:
    """How scans are read."""

    resample: bool = False
    """Resample a tilted or irregularly spaced series onto a regular grid instead of refusing it."""


@dataclass(frozen=True)
class SegmentConfig:
    """Fuzzy connectedness and the lumen surface."""

    threshold: float = 0.6
    """Strength of connectedness, 0 to 1, from which a voxel belongs to the lumen."""
    homogeneity_sigma: float | None = None
    """Spread of the homogeneity affinity, grey values; estimated at the seeds when not given."""
    feature_sigma: float | None = None
    """Spread of the object-feature affinity, grey values; estimated at the seeds when not given."""
    adjacency: int = 6
    """Neighbours of a voxel: 6 (faces) or 26."""
    scale: int | None = None
    """Voxels on either side over which grey is averaged before affinities are taken; from the noise when not given."""
    other_seeds_mm: tuple[tuple[float, float, float], ...] = ()
    """Seeds (LPS mm) of what touches the lumen and is not it, such as bone: cut off at the weakest link."""
    margin_mm: float = 5.0
    """Room around the vessel in the box that holds its signed distance."""
    outer_mm: float = 3.0
    """How far outside the wall the distance is exact."""
    least_voxels: int = 200
    """A smaller connected region is no lumen."""


@dataclass(frozen=True)
class TraceConfig:
    """The wire's centreline."""

    length_tolerance_mm: float = 2.0
    """Largest accepted disagreement between the traced length and the manifest's insertion_mm."""
    ridge_voxels: float = 0.7
    """Blur (voxels) in which crests are looked for; widened by itself where contrast is low."""
    longest_gap_mm: float = 5.0
    """Longest gap between two pieces of wire that is bridged."""
    rotation_axis: tuple[float, ...] = ()
    """Axis (LPS) about which the scanner turned; empty: the scan's third axis, as rotational scans are stored."""
    in_plane_deg: float = 10.0
    """Points whose tangent is nearer than this to the plane of rotation are flagged: the cone's half angle."""
    register: Literal["auto", "off"] = "auto"
    """auto (frames are registered to the reference scan where the phantom moved) or off."""
    register_skip_voxels: float = 0.1
    """A phantom that moved by less than this everywhere on the lumen's wall is taken not to have moved."""


@dataclass(frozen=True)
class SolverConfig:
    """The energy minimisation."""

    method: str = "newton"
    """newton or closed_form."""
    segment_mm: float = 1.0
    """Length of the wire's rigid segments."""
    hull: str = "offset"
    """offset (the smooth limit) or samples:N."""
    tolerance: float = 1e-9
    """Newton decrement, relative to the energy, at which a step counts as converged."""
    max_iterations: int = 200
    """Iterations allowed for one relaxation."""
    step_mm: float = 1.0
    """Longest insertion step; shortened where the scene asks for it."""
    initial: str = "slide"
    """slide or translate: how the wire is moved before it relaxes."""


@dataclass(frozen=True)
class SimulateConfig:
    """What is simulated."""

    depth: str = "traced"
    """traced (the length found in each frame) or manifest (insertion_mm)."""
    entry: str = "traced"
    """traced (the clamp is measured in the first 8 mm of the traced wires) or manifest (taken as written)."""
    bending_scale: float = 1.0
    """Factor on the wire's bending stiffness, for sensitivity runs."""
    wall_scale: float = 1.0
    """Factor on the wall stiffness, for sensitivity runs."""
    roll_offset_deg: float = 0.0
    """Added to the roll of every frame, for sensitivity runs."""


@dataclass(frozen=True)
class CompareConfig:
    """How curves are compared."""

    sample_mm: float = 0.5
    """Arc-length step at which both curves are sampled, so that segment lengths cannot flatter."""
    bootstrap: int = 2000
    """Resamples behind the 95 % intervals; 0 leaves them out."""


@dataclass(frozen=True)
class Config:
    """All settings of a run."""

    load: LoadConfig = field(default_factory=LoadConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    trace: TraceConfig = field(default_factory=TraceConfig)
    solver: SolverConfig = field(default_factory=SolverConfig)
    simulate: SimulateConfig = field(default_factory=SimulateConfig)
    compare: CompareConfig = field(default_factory=CompareConfig)
