"""Vessels that can be drawn on paper; every one starts below z = 0 and leads upwards, +z, at the origin."""

import numpy as np

from data_synthetic.anatomy.tubes import Anatomy, ball, sweep
from data_synthetic.geometry import ends_of

INLET_MM = 12.0
"""Straight vessel below the origin, so that the entry lies well inside it."""
INLET = np.column_stack([np.zeros((9, 2)), np.linspace(-INLET_MM, -0.5, 9)])


def straight(length_mm: float = 40.0) -> Anatomy:
    """A straight tube along z, of 2 mm radius."""
    points = np.concatenate([INLET, [[0.0, 0.0, z] for z in np.linspace(1.0, length_mm, 20)]])
    return Anatomy((sweep("vessel", points, 2.0),))


def bend(angle_deg: float = 90.0, turn_mm: float = 12.0, radius_mm: float = 2.0) -> Anatomy:
    """A bend towards +x by ``angle_deg`` on a circle of radius ``turn_mm``, then straight on."""
    angle = np.radians(np.linspace(0.0, angle_deg, max(8, int(angle_deg / 6))))
    arc = np.column_stack([turn_mm * (1 - np.cos(angle)), 0 * angle, turn_mm * np.sin(angle)])
    out = np.array([np.sin(angle[-1]), 0.0, np.cos(angle[-1])])
    tail = arc[-1] + np.linspace(1.0, 18.0, 12)[:, None] * out
    return Anatomy((sweep("vessel", np.concatenate([INLET, arc, tail]), radius_mm),))


def s_curve() -> Anatomy:
    """Two opposite bends in one plane, by 70 degrees each on a radius of 10 mm."""
    angle = np.radians(np.linspace(0.0, 70.0, 14))
    first = 10.0 * np.column_stack([1 - np.cos(angle), 0 * angle, np.sin(angle)])
    # the second bend is the first one turned by half a turn about its end
    second = 2.0 * first[-1] - first[::-1][1:]
    tail = second[-1] + np.linspace(1.0, 10.0, 8)[:, None] * [0.0, 0.0, 1.0]
    return Anatomy((sweep("vessel", np.concatenate([INLET, first, second, tail]), 2.0),))


def helix() -> Anatomy:
    """A helix about an axis along z, entered along its own tangent: 1.25 turns of 8 mm radius, 24 mm apart."""
    turn_mm, turns, rise = 8.0, 1.25, 24.0 / (2.0 * np.pi)
    angle = np.linspace(0.0, 2.0 * np.pi * turns, int(24 * turns))
    curve = np.column_stack([turn_mm * (1 - np.cos(angle)), turn_mm * np.sin(angle), rise * angle])
    tangent = np.array([0.0, turn_mm, rise]) / np.hypot(turn_mm, rise)
    inlet = np.linspace(-INLET_MM, -1.0, 9)[:, None] * tangent
    return Anatomy((sweep("vessel", np.concatenate([inlet, curve]), 1.8),))


def bifurcation(angle_deg: float = 35.0, branch_mm: float = 1.6) -> Anatomy:
    """A Y in the x-z plane: the trunk ends at the origin, branches ``right`` and ``left`` leave towards +x and -x."""
    radius_mm, angle, steps = 2.2, np.radians(angle_deg), np.linspace(0.0, 28.0, 14)
    tubes = [sweep("trunk", np.concatenate([INLET, [[0.0, 0.0, 0.0]]]), radius_mm)]
    bent = angle * np.clip(steps / 8.0, 0.0, 1.0)
    middle = 0.5 * (bent[1:] + bent[:-1])
    x, z = (ends_of(np.diff(steps) * part) for part in (np.sin(middle), np.cos(middle)))
    for name, side in (("right", 1.0), ("left", -1.0)):
        points = np.concatenate([[[0.0, 0.0, -2.0]], np.column_stack([side * x, 0 * x, z])])
        tubes.append(sweep(name, points, np.r_[radius_mm * 0.9, np.full(len(x), branch_mm)]))
    return Anatomy(tuple(tubes))


def stenosed() -> Anatomy:
    """A gently bent tube whose radius of 2 mm falls to 0.6 mm over a few mm."""
    at_mm = 8.0
    before, behind = np.linspace(-INLET_MM, at_mm - 5.0, 10), np.linspace(at_mm + 5.0, 34.0, 12)
    z = np.concatenate([before, at_mm + np.array([-3.0, 0.0, 3.0]), behind])
    x = np.where(z > 0, 0.006 * np.maximum(z, 0.0) ** 2, 0.0)
    radii = np.where(np.abs(z - at_mm) < 0.1, 0.6, 2.0)
    return Anatomy((sweep("vessel", np.column_stack([x, 0 * x, z]), radii),))


def side_aneurysm() -> Anatomy:
    """A gently bent tube with a sac on its outer side."""
    radius_mm, sac_mm = 1.8, 3.5
    vessel = bend(angle_deg=50.0, turn_mm=25.0, radius_mm=radius_mm).tubes[0]
    i = int(0.5 * len(vessel.points_mm))
    inward = vessel.tangents[i + 6] - vessel.tangents[i - 6]
    outward = -inward / np.linalg.norm(inward)
    root = vessel.points_mm[i]
    centre = root + (0.6 * radius_mm + sac_mm) * outward
    neck = sweep("neck", np.array([root, 0.5 * (root + centre), centre]), 1.5)
    return Anatomy((vessel, neck, ball("sac", centre, sac_mm)))


def end_aneurysm() -> Anatomy:
    """A straight tube that opens into a wide sac."""
    return Anatomy((straight(length_mm=6.0).tubes[0], ball("sac", [0.0, 0.0, 12.0], 7.0, blend_mm=1.0)))


def kissing(wall_mm: float = 0.15) -> Anatomy:
    """Two bent vessels that come as near as ``wall_mm`` and part again; they are not joined."""
    radius_mm = 1.8
    z = np.concatenate([np.linspace(-INLET_MM, -0.5, 9), np.linspace(1.0, 32.0, 20)])
    away = 0.012 * (z - 10.0) ** 2
    half = radius_mm + 0.5 * wall_mm
    vessels = [np.column_stack([side * (half + away), 0 * z, z]) for side in (1.0, -1.0)]
    # a blend width of next to nothing: a shared wall, not a junction
    named = zip(("vessel", "neighbour"), vessels, strict=True)
    return Anatomy(tuple(sweep(name, points, radius_mm, blend_mm=1e-3) for name, points in named))
