"""The catalogue of named scenes: every one is here because something goes wrong without it.

A new scene is one function in ``plain``, ``hard`` or ``willis``, below the decorator ``scene``.
"""

from data_synthetic.catalogue import hard, plain, willis
from data_synthetic.catalogue.limits import Wanted
from data_synthetic.catalogue.own_scenes import from_anatomy
from data_synthetic.catalogue.real_background import background_scene
from data_synthetic.catalogue.scene import NamedScene, ScannerFactory
from data_synthetic.catalogue.study import Study, insertion_into, prepare
from data_synthetic.scanner import PsfScanner
from data_synthetic.scanner.conebeam import ConeBeamScanner

__all__ = [
    "SCANNERS",
    "Wanted",
    "background_scene",
    "build",
    "describe",
    "from_anatomy",
    "insertion_into",
    "names",
    "prepare",
]

SCANNERS: dict[str, ScannerFactory] = {"psf": PsfScanner.of, "conebeam": ConeBeamScanner.of}
"""What turns a phantom into grey values: the ideal scanner, and 3D rotational X-ray (needs the extra [conebeam])."""
_BY_NAME = {
    scene.name: scene
    for module in (plain, hard, willis)
    for scene in vars(module).values()
    if isinstance(scene, NamedScene)
}


def names() -> tuple[str, ...]:
    """All scene names, in catalogue order."""
    return tuple(_BY_NAME)


def describe(name: str) -> NamedScene:
    """The scene of that name; KeyError with the allowed names otherwise."""
    if name not in _BY_NAME:
        raise KeyError(f"synthetic scene: got {name!r}; allowed: {', '.join(_BY_NAME)}; choose one of these")
    return _BY_NAME[name]


def build(
    name: str | NamedScene,
    *,
    frames: int | None = None,
    size: int | None = None,
    voxel_mm: float | None = None,
    seed: int = 0,
    scanner: str = "psf",
    truth_step_mm: float | None = None,
) -> Study:
    """A study in memory; ValueError where a number cannot be meant.

    name : of a scene, or a scene.     frames, size : default to the scene's own.
    voxel_mm : defaults to the scene's field of view over ``size``.     scanner : one of SCANNERS.
    truth_step_mm : node spacing of the true wire, taken as it is (tests take 0.4); without it the spacing is halved
    until that moves nothing by more than 0.01 mm.
    """
    if scanner not in SCANNERS:
        raise ValueError(
            f"synthetic scene {name}: scanner: got {scanner!r}; allowed: {', '.join(SCANNERS)}; choose one"
        )
    wanted = Wanted(frames, size, voxel_mm, seed)
    problems = wanted.problems()
    if problems:
        raise ValueError("; ".join(problems))
    scene = describe(name) if isinstance(name, str) else name
    return insertion_into(prepare(scene, SCANNERS[scanner], wanted, truth_step_mm), 0)
