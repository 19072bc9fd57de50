"""Settings of the wire's centreline."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from pipeline.ranges import Axis, Millimetres, NonNegative, Number

MOST_APART = 3.0
"""Slice distance over pixel size from which no curve is accepted: of 22 wires in slices of 2 mm and pixels of 0.5 mm,
with insertion_mm stated, 5 had the stated length and 3 of these were over 1.5 pixels off, at the tip or all along."""


@dataclass(frozen=True)
class TraceConfig:
    """The wire's centreline."""

    length_tolerance_mm: NonNegative = 2.0
    """Largest accepted disagreement between the traced length and the manifest's insertion_mm."""
    ridge_voxels: Annotated[float, Field(ge=0.3, le=5), Number] = 0.7
    """Blur (voxels) in which crests are looked for. It widens by itself where contrast is low."""
    longest_gap_mm: Millimetres = 5.0
    """Longest gap between two pieces of wire that is bridged."""
    rotation_axis: Axis | tuple[()] = ()
    """Axis (LPS) about which the scanner turned. Empty: the scan's third axis, as rotational scans are stored."""
    in_plane_deg: Annotated[float, Field(ge=0, le=90), Number] = 10.0
    """The cone's half angle: points whose tangent is nearer than this to the plane of rotation are flagged."""
    register: Literal["auto", "off"] = "auto"
    """auto (frames are registered to the reference scan where the phantom moved) or off (a motion is told)."""
    register_skip_voxels: NonNegative = 0.1
    """A phantom that moved by less than this everywhere on the lumen's wall is taken not to have moved."""
