"""Scans that go wrong: what a scanner, a phantom or a person does to an otherwise simple scene."""

from dataclasses import replace

import numpy as np

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy, sweep
from data_synthetic.catalogue.plain import bend, plain_setup
from data_synthetic.catalogue.scene import Setup, scene
from data_synthetic.geometry import rotate
from data_synthetic.scanner import Greys


@scene("bone-wall", tries="segment trace")
def bone_wall(rng: np.random.Generator, frames: int) -> Setup:
    """bone a quarter of a millimetre from the lumen, where the wire touches"""
    outer = np.array([[-6.0, 0.0, -4.0], [-4.6, 0.0, 8.0], [2.0, 0.0, 16.0]])
    return replace(bend.plan(rng, frames), bone=Anatomy((sweep("bone", outer, 3.2),)), bone_gap_mm=0.25)


@scene(
    "missing-wire",
    tries="trace report",
    frames=5,
    expected=lambda n: tuple("trace_low_contrast" if i == n // 2 else "ok" for i in range(n)),
)
def missing_wire(rng: np.random.Generator, frames: int) -> Setup:
    """one frame shows no wire: it must say so and not spoil the others"""
    return replace(bend.plan(rng, frames), visible=tuple(i != frames // 2 for i in range(frames)))


# the wires have to be told from each other
@scene("two-wires", tries="trace report", frames=5, voxels_across=8.5, expected="trace_ambiguous")
def two_wires(_rng: np.random.Generator, frames: int) -> Setup:
    """a second wire left in the trunk: only one of them is meant"""
    setup = plain_setup(shapes.bifurcation(), frames, 30.0)
    left = setup.anatomy.tube("left").points_mm
    # a second wire, left behind, along the trunk and the other branch
    trunk = np.array([[-1.1, 0.3, z] for z in np.linspace(-10.0, -1.0, 10)])
    return replace(setup, others=((np.concatenate([trunk, left[8:-12]]), setup.wire.radius_mm),))


@scene("introducer", tries="trace compare", frames=5)
def introducer(rng: np.random.Generator, frames: int) -> Setup:
    """the wire is seen before its entry, too: only what lies beyond counts"""
    setup = bend.plan(rng, frames)
    back = setup.entry_mm - np.linspace(12.0, 0.0, 25)[:, None] * setup.direction
    return replace(setup, others=((back, setup.wire.radius_mm),))


@scene("moved-phantom", tries="segment trace report", frames=5)
def moved_phantom(rng: np.random.Generator, frames: int) -> Setup:
    """the phantom was nudged between scans: the reference does not fit"""
    return replace(bend.plan(rng, frames), motion_mm=np.clip(rng.normal(0.0, 0.35, (frames, 3)), -0.6, 0.6))


@scene("anisotropic", tries="load segment trace", frames=5)
def anisotropic(rng: np.random.Generator, frames: int) -> Setup:
    """slices twice as thick as pixels are wide"""
    return replace(bend.plan(rng, frames), spacing_ratio=(0.8, 0.8, 1.6))


@scene("oblique", tries="load segment trace compare", frames=5)
def oblique(rng: np.random.Generator, frames: int) -> Setup:
    """a scan whose axes are not the patient's"""
    axes = np.column_stack([rotate(e, [1.0, 2.0, -1.0], np.radians(35.0)) for e in np.eye(3)])
    return replace(bend.plan(rng, frames), axes=axes)


@scene("low-dose", tries="segment trace", frames=5)
def low_dose(rng: np.random.Generator, frames: int) -> Setup:
    """a contrast to noise of five: little more than can be followed at all"""
    return replace(bend.plan(rng, frames), greys=Greys(noise=250.0))


@scene("washed-out", tries="segment trace", frames=5)
def washed_out(rng: np.random.Generator, frames: int) -> Setup:
    """thin contrast that changes from frame to frame"""
    return replace(bend.plan(rng, frames), greys=Greys(contrast=500.0, drift=0.03, washout=0.1))
