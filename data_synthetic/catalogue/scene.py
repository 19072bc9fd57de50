"""A named situation, and what it is made of before anything is computed."""

import re
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from data_synthetic.anatomy.tubes import Tube
from data_synthetic.geometry import Array, ScanGrid
from data_synthetic.rod.replay import TrueInsertion
from data_synthetic.rod.rod import TrueWire, Wall
from data_synthetic.scanner import Phantom, PsfScanner
from data_synthetic.scanner.conebeam import ConeBeamScanner
from data_synthetic.scanner.phantom import Wires

Scanner = PsfScanner | ConeBeamScanner


def name_after(path: Path) -> str:
    """Name of a scene after a file, of characters that a case's id may have."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", path.name.split(".")[0]).strip("-_")[:90] or "scan"


@dataclass(frozen=True, eq=False)
class Setup(Phantom):
    """What a scene is made of: a phantom, and what is done in it.

    tube, entry_arc_mm : the tube that is entered, how far from its beginning.     depths_mm, rolls_deg : one per frame.
    centre_mm : middle of the scan.     stiffness_N_mm2 : of the wall; 2 is that of a 2 MPa silicone.
    spacing_ratio : voxel edges relative to the voxel size.
    axes : direction matrix of the scan.     visible : which frames show the wire.     others : more wires, always.
    motion_mm : (frames, 3) shift of the phantom against the reference scan.     wall : when it is not the anatomy.
    friction : Coulomb's coefficient of wire and wall.
    """

    tube: Tube
    entry_arc_mm: float
    depths_mm: tuple[float, ...]
    rolls_deg: tuple[float, ...]
    centre_mm: Array
    _: KW_ONLY
    material_axis: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    wire: TrueWire = field(default_factory=TrueWire)
    stiffness_N_mm2: float = 2.0
    spacing_ratio: tuple[float, float, float] = (1.0, 1.0, 1.0)
    axes: Array | None = None
    visible: tuple[bool, ...] | None = None
    others: Wires = ()
    motion_mm: Array | None = None
    wall: Wall | None = None
    friction: float = 0.0

    @property
    def ahead(self) -> slice:
        """The samples of the tube from the entry on."""
        return slice(min(round(self.entry_arc_mm / self.tube.step_mm), len(self.tube.points_mm) - 1), None)

    @property
    def entry_mm(self) -> Array:
        """Where the wire enters."""
        return np.array(self.tube.points_mm[self.ahead][0])

    @property
    def direction(self) -> Array:
        """Unit vector along which the wire enters."""
        return np.array(self.tube.tangents[self.ahead][0])

    def insertion(self) -> TrueInsertion:
        """What the true wire goes through."""
        return TrueInsertion(
            self.wire,
            self.wall or self.anatomy,
            self.stiffness_N_mm2,
            self.entry_mm,
            self.direction,
            self.material_axis,
            friction=self.friction,
        )


ScannerFactory = Callable[[Setup, ScanGrid], Scanner]
Plan = Callable[[np.random.Generator, int], Setup]


def _as_planned(setup: Setup) -> Setup:
    """Nothing is left open."""
    return setup


@dataclass(frozen=True)
class NamedScene:
    """A name, one line of why, natural sizes, and how to plan it from a seeded generator and a number of frames.

    tries : stages of the pipeline that it was made to try.     fov_mm : edge of the field of view, so that a smaller
    ``size`` means larger voxels of the same scene.     voxels_across : how many must fit across the lumen that is
    entered; with five every lumen is segmented, with four and a half that of ``straight`` is not.
    expected : the status of every frame that the pipeline should end in (its identifier), or one per frame; a bar
    separates what is equally right.
    steer : chooses roll and depths where the plan leaves them open.     scan : a real scan brings its own voxels.
    """

    name: str
    why: str
    plan: Plan
    tries: tuple[str, ...] = ()
    fov_mm: float = 48.0
    size: int = 160
    frames: int = 6
    voxels_across: float = 5.0
    expected: str | Callable[[int], Sequence[str]] = "ok"
    steer: Callable[[Setup], Setup] | None = None
    scan: tuple[ScanGrid, ScannerFactory] | None = None

    def setup(self, rng: np.random.Generator, frames: int) -> Setup:
        """The scene with everything chosen that has to be known before the truth is computed."""
        planned = self.plan(rng, frames)
        return planned if self.steer is None else self.steer(planned)

    def with_friction(self, coefficient: float) -> "NamedScene":
        """The scene with Coulomb's friction between true wire and wall, which its manifest states."""
        return replace(self, steer=lambda planned: replace((self.steer or _as_planned)(planned), friction=coefficient))

    def expected_statuses(self, frames: int) -> tuple[str, ...]:
        """One identifier per frame."""
        if isinstance(self.expected, str):
            return (self.expected,) * frames
        return tuple(self.expected(frames))


def scene(name: str, tries: str, **properties: Any) -> Callable[[Plan], NamedScene]:
    """Makes the function below it the plan of a scene, and that function's docstring the scene's ``why``.

    tries : as in NamedScene, one text.     properties : the rest of NamedScene's.
    """
    return lambda plan: NamedScene(name, plan.__doc__ or "", plan, tuple(tries.split()), **properties)


def spread(first_mm: float, last_mm: float, frames: int) -> tuple[float, ...]:
    """Depths at equal steps; a single frame is at the last."""
    return tuple(np.linspace(first_mm, last_mm, frames).tolist()) if frames > 1 else (last_mm,)
