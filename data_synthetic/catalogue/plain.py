"""Vessels that can be drawn on paper: what they should show is known beforehand."""

from dataclasses import replace

import numpy as np

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.catalogue.scene import Setup, scene, spread

ENTRY_ARC_MM = 4.0
"""The entry lies this far inside the vessel's beginning, clear of its rounded end."""


def plain_setup(
    anatomy: Anatomy, frames: int, last_mm: float, *, roll_deg: float = 0.0, first_mm: float = 8.0
) -> Setup:
    """Enter the first tube, push to ``last_mm`` with one roll."""
    points = anatomy.tables.points
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    depths, rolls = spread(first_mm, last_mm, frames), (roll_deg,) * frames
    return Setup(anatomy, anatomy.tubes[0], ENTRY_ARC_MM, depths, rolls, middle)


@scene("straight", tries="simulate compare report", fov_mm=57.6, size=192)
def straight(_rng: np.random.Generator, frames: int) -> Setup:
    """a curved tip in a straight vessel: contact without any turn"""
    return plain_setup(shapes.straight(), frames, 36.0)


# four across are the 48 voxels by which kernels are warmed up: segmented with most seeds, not with all
@scene("bend", tries="segment trace simulate compare report", voxels_across=4.0)
def bend(_rng: np.random.Generator, frames: int) -> Setup:
    """one bend in one plane: bending and wall alone decide"""
    return plain_setup(shapes.bend(), frames, 38.0)


@scene("s-curve", tries="simulate")
def s_curve(_rng: np.random.Generator, frames: int) -> Setup:
    """two opposite bends: the wire cuts both corners"""
    return plain_setup(shapes.s_curve(), frames, 36.0)


@scene("helix", tries="trace simulate")
def helix(_rng: np.random.Generator, frames: int) -> Setup:
    """a curve that no plane holds: roll and torsion of the path matter"""
    return plain_setup(shapes.helix(), frames, 50.0, roll_deg=90.0)


@scene("rough-wall", tries="simulate")
def rough_wall(rng: np.random.Generator, frames: int) -> Setup:
    """the same helix with friction: the wire is left nearly a millimetre from where it would slide to"""
    return replace(helix.plan(rng, frames), friction=0.1)


@scene("bifurcation", tries="segment simulate compare")
def bifurcation(_rng: np.random.Generator, frames: int) -> Setup:
    """the tip takes the branch that it points at"""
    return plain_setup(shapes.bifurcation(), frames, 30.0)


@scene("bifurcation-left", tries="simulate compare")
def bifurcation_left(_rng: np.random.Generator, frames: int) -> Setup:
    """the same fork, rolled by half a turn: the other branch"""
    return plain_setup(shapes.bifurcation(), frames, 30.0, roll_deg=180.0)


@scene("rolled", tries="simulate")
def rolled(_rng: np.random.Generator, frames: int) -> Setup:
    """rolled by 150 degrees while it is pushed: the path of the roll is part of the truth"""
    setup = plain_setup(shapes.bend(angle_deg=60.0), frames, 30.0, first_mm=20.0)
    return replace(setup, rolls_deg=spread(0.0, 150.0, frames))


# its first 1.6 mm of wire have to be told from none
@scene("short-wire", tries="trace simulate compare", fov_mm=36.0, size=120, frames=4, voxels_across=6.0)
def short_wire(_rng: np.random.Generator, frames: int) -> Setup:
    """a wire shorter than three segments: nothing may need more joints than there are"""
    return plain_setup(shapes.straight(length_mm=20.0), frames, 4.0, first_mm=1.6)


@scene("stenosis", tries="segment simulate")
def stenosis(_rng: np.random.Generator, frames: int) -> Setup:
    """a lumen hardly wider than the wire: the wall decides everything"""
    return plain_setup(shapes.stenosed(), frames, 30.0)


@scene("aneurysm-neck", tries="segment simulate")
def aneurysm_neck(_rng: np.random.Generator, frames: int) -> Setup:
    """past the neck of a sidewall aneurysm: the wall gives way to one side"""
    # the hook points away from the neck: towards it, it would fall in
    return plain_setup(shapes.side_aneurysm(), frames, 36.0)


@scene("aneurysm-loop", tries="trace simulate")
def aneurysm_loop(_rng: np.random.Generator, frames: int) -> Setup:
    """pushed on into a wide sac: the wire curls and touches where it will"""
    return plain_setup(shapes.end_aneurysm(), frames, 38.0, first_mm=14.0)


@scene("kissing-vessels", tries="segment simulate")
def kissing_vessels(_rng: np.random.Generator, frames: int) -> Setup:
    """two vessels that share a wall in the image: the wire must stay in its own"""
    return plain_setup(shapes.kissing(), frames, 36.0)
