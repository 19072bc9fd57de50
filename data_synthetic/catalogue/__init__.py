"""The catalogue of named scenes: every one is here because something goes wrong without it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from data_synthetic.catalogue.own_anatomy import scene_from_file
from data_synthetic.catalogue.own_background import background_study
from data_synthetic.catalogue.scene import Scene, Study
from data_synthetic.catalogue.scenes import SCENES
from data_synthetic.catalogue.study import ScannerFactory, conebeam_scanner, make_study, psf_scanner

SCANNERS: dict[str, ScannerFactory] = {"psf": psf_scanner, "conebeam": conebeam_scanner}
"""What turns a phantom into grey values."""

_BY_NAME = {scene.name: scene for scene in SCENES}


def names() -> tuple[str, ...]:
    """All scene names, in catalogue order."""
    return tuple(_BY_NAME)


def describe(name: str) -> Scene:
    """The scene of that name; KeyError with the allowed names otherwise."""
    if name not in _BY_NAME:
        msg = f"synthetic scene: got {name!r}; allowed: {', '.join(_BY_NAME)}; choose one of these"
        raise KeyError(msg)
    return _BY_NAME[name]


def from_anatomy(path: str | Path) -> Scene:
    """A scene through the vessels of an .swc tree or a Slicer .mrk.json curve with radii; ``build`` takes it."""
    return scene_from_file(path)


def from_background(path: str | Path, **wanted: Any) -> Study:
    """A study in the real voxels of a scan; ``wanted``: frames, voxel_mm, seed, truth_step_mm."""
    return background_study(path, **wanted)


def build(
    name: str | Scene,
    *,
    frames: int | None = None,
    size: int | None = None,
    voxel_mm: float | None = None,
    seed: int = 0,
    scanner: str = "psf",
    truth_step_mm: float | None = None,
) -> Study:
    """A study in memory.

    name : of a scene, or a scene.     frames, size : default to the scene's own.
    voxel_mm : defaults to the scene's field of view over ``size``.     scanner : one of SCANNERS.
    truth_step_mm : node spacing of the true wire, taken as it is (tests take 0.4); without it the spacing is halved
    until that moves nothing by more than 0.01 mm.
    """
    if scanner not in SCANNERS:
        msg = f"synthetic scene {name}: scanner: got {scanner!r}; allowed: {', '.join(SCANNERS)}; choose one"
        raise ValueError(msg)
    return make_study(
        describe(name) if isinstance(name, str) else name,
        frames=frames,
        size=size,
        voxel_mm=voxel_mm,
        seed=seed,
        truth_step_mm=truth_step_mm,
        scanner=SCANNERS[scanner],
    )
