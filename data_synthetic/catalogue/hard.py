"""Scans that go wrong: what a scanner, a phantom or a person does to an otherwise simple scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy, sweep
from data_synthetic.catalogue.plain import plain_setup
from data_synthetic.catalogue.scene import Scene, Setup
from data_synthetic.rod.replay import rotate
from data_synthetic.scanner import Greys


def _bend(frames: int, **changes: object) -> Setup:
    return replace(plain_setup(shapes.bend(), frames, 38.0), **changes)  # type: ignore[arg-type]


def _bony(_rng: np.random.Generator, frames: int) -> Setup:
    outer = np.array([[-6.0, 0.0, -4.0], [-4.6, 0.0, 8.0], [2.0, 0.0, 16.0]])
    return _bend(frames, bone=Anatomy((sweep("bone", outer, 3.2),)), bone_gap_mm=0.25)


def _missing(_rng: np.random.Generator, frames: int) -> Setup:
    return _bend(frames, visible=tuple(i != frames // 2 for i in range(frames)))


def _missing_statuses(frames: int) -> tuple[str, ...]:
    return tuple("trace_low_contrast" if i == frames // 2 else "ok" for i in range(frames))


def _two(_rng: np.random.Generator, frames: int) -> Setup:
    setup = plain_setup(shapes.bifurcation(), frames, 30.0)
    left = setup.anatomy.tube("left").points_mm
    # a second wire, left behind, along the trunk and the other branch
    trunk = np.array([[-1.1, 0.3, z] for z in np.linspace(-10.0, -1.0, 10)])
    return replace(setup, others=((np.concatenate([trunk, left[8:-12]]), setup.wire.radius_mm),))


def _tail(_rng: np.random.Generator, frames: int) -> Setup:
    setup = _bend(frames)
    back = setup.entry_mm - np.linspace(12.0, 0.0, 25)[:, None] * setup.direction
    return replace(setup, others=((back, setup.wire.radius_mm),))


def _moved(rng: np.random.Generator, frames: int) -> Setup:
    shift = rng.normal(0.0, 0.35, (frames, 3))
    return _bend(frames, motion_mm=np.clip(shift, -0.6, 0.6))


def _anisotropic(_rng: np.random.Generator, frames: int) -> Setup:
    return _bend(frames, spacing_ratio=(0.8, 0.8, 1.6))


def _oblique(_rng: np.random.Generator, frames: int) -> Setup:
    axes = np.column_stack([rotate(e, [1.0, 2.0, -1.0], np.radians(35.0)) for e in np.eye(3)])
    return _bend(frames, axes=axes)


def _low_dose(_rng: np.random.Generator, frames: int) -> Setup:
    return _bend(frames, greys=Greys(noise=250.0))


def _washed_out(_rng: np.random.Generator, frames: int) -> Setup:
    return _bend(frames, greys=Greys(contrast=500.0, drift=0.03, washout=0.1))


HARD = (
    Scene(
        "bone-wall",
        "bone a quarter of a millimetre from the lumen, where the wire touches",
        48.0,
        160,
        6,
        _bony,
    ),
    Scene(
        "missing-wire",
        "one frame shows no wire: it must say so and not spoil the others",
        48.0,
        160,
        5,
        _missing,
        _missing_statuses,
    ),
    Scene(
        "two-wires",
        "a second wire left in the trunk: only one of them is meant",
        48.0,
        160,
        5,
        _two,
        "trace_ambiguous",
    ),
    Scene(
        "introducer",
        "the wire is seen before its entry, too: only what lies beyond counts",
        48.0,
        160,
        5,
        _tail,
    ),
    Scene(
        "moved-phantom",
        "the phantom was nudged between scans: the reference does not fit",
        48.0,
        160,
        5,
        _moved,
    ),
    Scene("anisotropic", "slices twice as thick as pixels are wide", 48.0, 160, 5, _anisotropic),
    Scene("oblique", "a scan whose axes are not the patient's", 48.0, 160, 5, _oblique),
    Scene(
        "low-dose",
        "a contrast to noise of five: little more than can be followed at all",
        48.0,
        160,
        5,
        _low_dose,
    ),
    Scene("washed-out", "thin contrast that changes from frame to frame", 48.0, 160, 5, _washed_out),
)
