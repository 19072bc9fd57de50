"""A named situation, and the study that comes out of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.geometry.scan_grid import ScanGrid
from data_synthetic.rod.contact import Wall
from data_synthetic.rod.replay import TrueFrame
from data_synthetic.rod.wire import TrueWire
from data_synthetic.scanner import Greys

Array = NDArray[np.float64]
Wires = Sequence[tuple[Array, float]]


class Scanner(Protocol):
    """Turns wires (points (n, 3), radius) into one volume."""

    def scan(self, wires: Wires, seed: Sequence[int]) -> NDArray[np.int16]:
        """One volume, indexed x, y, z."""
        ...


@dataclass(frozen=True, eq=False)
class Setup:
    """What a scene is made of, before anything is computed.

    depths_mm, rolls_deg : one per frame.     stiffness_N_mm2 : of the wall; 2 is that of a 2 MPa silicone.
    bone_gap_mm : what bone keeps from the lumen.     spacing_ratio : voxel edges relative to the voxel size.
    axes : direction matrix of the scan.     visible : which frames show the wire.     others : more wires, always.
    motion_mm : (frames, 3) shift of the phantom against the reference scan.     wall : when it is not the anatomy.
    friction : Coulomb's coefficient of wire and wall.
    """

    anatomy: Anatomy
    entry_mm: Array
    direction: Array
    depths_mm: tuple[float, ...]
    rolls_deg: tuple[float, ...]
    centre_mm: Array
    material_axis: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    wire: TrueWire = field(default_factory=TrueWire)
    stiffness_N_mm2: float = 2.0
    bone: Anatomy | None = None
    bone_gap_mm: float = 1.2
    greys: Greys = field(default_factory=Greys)
    spacing_ratio: tuple[float, float, float] = (1.0, 1.0, 1.0)
    axes: Array | None = None
    visible: tuple[bool, ...] | None = None
    others: Wires = ()
    motion_mm: Array | None = None
    wall: Wall | None = None
    friction: float = 0.0


@dataclass(frozen=True)
class Scene:
    """A name, one line of why, natural sizes, and how to set it up from a seeded generator and a number of frames.

    fov_mm : edge of the field of view, so that a smaller ``size`` means larger voxels of the same scene.
    expected : the status of every frame that the pipeline should end in (its identifier), or one per frame;
    a bar separates what is equally right.
    """

    name: str
    why: str
    fov_mm: float
    size: int
    frames: int
    setup: Callable[[np.random.Generator, int], Setup]
    expected: str | Callable[[int], Sequence[str]] = "ok"

    def expected_statuses(self, frames: int) -> tuple[str, ...]:
        """One identifier per frame."""
        if isinstance(self.expected, str):
            return (self.expected,) * frames
        return tuple(self.expected(frames))


@dataclass(frozen=True, eq=False)
class Study:
    """Scans with truth, in memory. ``frames()`` makes one volume at a time; ``reference`` is the scan without wire.

    manifest : the [[case]] table, [wires] and [case.wall] as nested dicts.     truth : one TrueFrame per frame,
    in the phantom as the reference shows it (a moved phantom carries its wire along).
    """

    name: str
    why: str
    grid: ScanGrid
    reference: NDArray[np.int16]
    truth: tuple[TrueFrame, ...]
    expected: tuple[str, ...]
    manifest: Mapping[str, Any]
    quality: Mapping[str, float]
    setup: Setup
    make_frame: Callable[[int], NDArray[np.int16]] = field(repr=False)

    def frame(self, number: int) -> NDArray[np.int16]:
        """One frame, indexed x, y, z; the same every time."""
        return self.make_frame(number)

    def frames(self) -> Iterator[NDArray[np.int16]]:
        """All frames, one at a time."""
        return (self.make_frame(i) for i in range(len(self.truth)))


def enter(tube: Tube, arc_mm: float) -> tuple[Array, Array]:
    """Point and unit direction on a tube's centreline, ``arc_mm`` from its beginning."""
    i = min(round(arc_mm / tube.step_mm), len(tube.points_mm) - 1)
    return np.array(tube.points_mm[i]), np.array(tube.tangents[i])


def spread(first_mm: float, last_mm: float, frames: int) -> tuple[float, ...]:
    """Depths at equal steps; a single frame is at the last."""
    return tuple(np.linspace(first_mm, last_mm, frames).tolist()) if frames > 1 else (last_mm,)
