"""The catalogue of named scenes: every one is here because something goes wrong without it."""

from __future__ import annotations

from data_synthetic.scene import Scene, Study
from data_synthetic.scenes import SCENES
from data_synthetic.study import make_study, psf_scanner

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


def build(
    name: str,
    *,
    frames: int | None = None,
    size: int | None = None,
    voxel_mm: float | None = None,
    seed: int = 0,
    scanner: str = "psf",
    truth_step_mm: float = 0.2,
) -> Study:
    """A study in memory.

    frames, size : default to the scene's own.     voxel_mm : defaults to the scene's field of view over ``size``.
    truth_step_mm : node spacing of the true wire; tests take 0.4.
    """
    if scanner != "psf":
        msg = f"synthetic scene {name}: scanner: got {scanner!r}; allowed: psf"
        raise ValueError(msg)
    return make_study(
        describe(name),
        frames=frames,
        size=size,
        voxel_mm=voxel_mm,
        seed=seed,
        truth_step_mm=truth_step_mm,
        scanner=psf_scanner,
    )
