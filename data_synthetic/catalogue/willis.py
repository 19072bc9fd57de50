"""The circle of Willis: the anatomy of the work that this project validates."""

from dataclasses import replace
from typing import Any

import numpy as np

from data_synthetic.anatomy.tubes import Anatomy, ball, sweep
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from data_synthetic.catalogue.scene import Setup, scene, spread

CENTRE_MM = np.array([0.0, -2.0, -2.0])

SIPHON_MM = np.array([-14.0, -8.0, -14.0])
CLOSE: dict[str, Any] = {"fov_mm": 52.8, "size": 176}
"""A field of view about one carotid, for scenes that are run small."""
ENTRY_ARC_MM = 17.0
"""Into the carotid, at the foot of the petrous bend: an entry tilted by 2 degrees has a short lever there."""
ROLL_DEG = 95.0
"""The roll that leads into a terminus aneurysm without a snap; tried on seeds 0 to 9."""


def skull_base() -> Anatomy:
    """Bone-bright neighbours: petrous bones, clivus, clinoids. They are cut back where a vessel passes."""
    bones = [sweep("clivus", [[0.0, -1.0, -14.0], [0.0, 8.0, -24.0], [0.0, 14.0, -36.0]], 4.0)]
    for side, x in (("right", 1.0), ("left", -1.0)):
        petrous = np.array([[-30.0, 8.0, -20.0], [-21.0, 5.0, -19.0], [-13.0, 3.0, -17.0]])
        bones.append(sweep(f"{side}.petrous", petrous * [x, 1.0, 1.0], [5.0, 4.5, 2.5]))
        bones.append(ball(f"{side}.clinoid", np.array([-12.5, -17.0, 1.0]) * [x, 1.0, 1.0], 2.6))
        bones.append(ball(f"{side}.sphenoid", np.array([-16.0, -24.0, -6.0]) * [x, 1.0, 1.0], 4.5))
    return Anatomy(tuple(bones))


def willis_setup(
    rng: np.random.Generator, frames: int, plan: WillisPlan, past_mm: float, roll_deg: float = ROLL_DEG
) -> Setup:
    """Enter the right carotid and push ``past_mm`` beyond its terminus."""
    anatomy = circle_of_willis(rng, plan)
    carotid = anatomy.tube("right.ICA")
    depths = spread(10.0, carotid.length_mm - ENTRY_ARC_MM + past_mm, frames)
    return Setup(anatomy, carotid, ENTRY_ARC_MM, depths, (roll_deg,) * frames, CENTRE_MM, bone=skull_base())


@scene("circle-of-willis", tries="load segment trace simulate compare report", fov_mm=76.8, size=256, frames=30)
def terminus(rng: np.random.Generator, frames: int) -> Setup:
    """a whole circle of Willis: through the siphon into an aneurysm of the carotid terminus"""
    return willis_setup(rng, frames, WillisPlan(), 6.0)


@scene("siphon", tries="simulate compare", **CLOSE)
def siphon(rng: np.random.Generator, frames: int) -> Setup:
    """the carotid siphon alone: the tightest turns of the way, nothing else to go wrong"""
    setup = willis_setup(rng, frames, WillisPlan(aneurysm="none"), -4.0)
    return replace(setup, anatomy=Anatomy((setup.tube,)), centre_mm=SIPHON_MM)


@scene("incomplete-circle", tries="segment simulate", **CLOSE)
def incomplete_circle(rng: np.random.Generator, frames: int) -> Setup:
    """a circle with missing vessels and a sidewall aneurysm in the siphon"""
    plan = WillisPlan(aneurysm="sidewall", sac_mm=3.0, missing=("right.PCoA", "left.A1", "left.P1"))
    return replace(willis_setup(rng, frames, plan, -6.0), centre_mm=SIPHON_MM)


@scene("acoa-aneurysm", tries="simulate compare", **CLOSE)
def acoa_aneurysm(rng: np.random.Generator, frames: int) -> Setup:
    """around the sharp turn into A1: stored energy is let go in a snap"""
    # past the snaps at 50, 53, 62 and 68 mm: short of the last one, a hair's breadth decides where the tip is
    setup = willis_setup(rng, frames, WillisPlan(aneurysm="acoa", sac_mm=3.0), 15.0, roll_deg=0.0)
    return replace(setup, centre_mm=np.array([-12.0, -9.0, -9.0]))


@scene("tortuous-vertebral", tries="segment simulate", voxels_across=3.6, **CLOSE)
def tortuous_vertebral(rng: np.random.Generator, frames: int) -> Setup:
    """up a winding vertebral artery into the basilar: another way in"""
    anatomy = circle_of_willis(rng, WillisPlan(aneurysm="none", tortuous_vertebrals=True))
    vertebral, depths, rolls = anatomy.tube("right.vertebral"), spread(8.0, 36.0, frames), (0.0,) * frames
    return Setup(anatomy, vertebral, 14.0, depths, rolls, np.array([-2.0, 6.0, -18.0]), bone=skull_base())
