"""Vessels that can be drawn on paper; every one starts below z = 0 and leads upwards, +z, at the origin."""

import numpy as np

from data_synthetic.anatomy.tubes import Anatomy, ball, sweep
from data_synthetic.geometry import Array, ends_of

INLET_MM = 12.0
"""Straight vessel below the origin, so that the entry lies well inside it."""


def _inlet(count: int = 9) -> Array:
    return np.column_stack([np.zeros((count, 2)), np.linspace(-INLET_MM, -0.5, count)])


def straight(length_mm: float = 40.0, radius_mm: float = 2.0) -> Anatomy:
    """A straight tube along z."""
    points = np.concatenate([_inlet(), [[0.0, 0.0, z] for z in np.linspace(1.0, length_mm, 20)]])
    return Anatomy((sweep("vessel", points, radius_mm),))


def bend(angle_deg: float = 90.0, turn_mm: float = 12.0, radius_mm: float = 2.0) -> Anatomy:
    """A bend towards +x by ``angle_deg`` on a circle of radius ``turn_mm``, then straight on."""
    angle = np.radians(np.linspace(0.0, angle_deg, max(8, int(angle_deg / 6))))
    arc = np.column_stack([turn_mm * (1 - np.cos(angle)), 0 * angle, turn_mm * np.sin(angle)])
    out = np.array([np.sin(angle[-1]), 0.0, np.cos(angle[-1])])
    tail = arc[-1] + np.linspace(1.0, 18.0, 12)[:, None] * out
    return Anatomy((sweep("vessel", np.concatenate([_inlet(), arc, tail]), radius_mm),))


def s_curve(turn_mm: float = 10.0, angle_deg: float = 70.0, radius_mm: float = 2.0) -> Anatomy:
    """Two opposite bends in one plane."""
    angle = np.radians(np.linspace(0.0, angle_deg, 14))
    first = np.column_stack([turn_mm * (1 - np.cos(angle)), 0 * angle, turn_mm * np.sin(angle)])
    # the second bend is the first one turned by half a turn about its end
    second = 2.0 * first[-1] - first[::-1][1:]
    tail = second[-1] + np.linspace(1.0, 10.0, 8)[:, None] * [0.0, 0.0, 1.0]
    return Anatomy((sweep("vessel", np.concatenate([_inlet(), first, second, tail]), radius_mm),))


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
    tubes = [sweep("trunk", np.concatenate([_inlet(), [[0.0, 0.0, 0.0]]]), radius_mm)]
    bent = angle * np.clip(steps / 8.0, 0.0, 1.0)
    middle = 0.5 * (bent[1:] + bent[:-1])
    x, z = (ends_of(np.diff(steps) * part) for part in (np.sin(middle), np.cos(middle)))
    for name, side in (("right", 1.0), ("left", -1.0)):
        points = np.concatenate([[[0.0, 0.0, -2.0]], np.column_stack([side * x, 0 * x, z])])
        tubes.append(sweep(name, points, np.r_[radius_mm * 0.9, np.full(len(x), branch_mm)]))
    return Anatomy(tuple(tubes))


def stenosed(radius_mm: float = 2.0, left: float = 0.3, at_mm: float = 8.0) -> Anatomy:
    """A gently bent tube whose radius falls to ``left`` of itself over a few mm."""
    before, behind = np.linspace(-INLET_MM, at_mm - 5.0, 10), np.linspace(at_mm + 5.0, 34.0, 12)
    z = np.concatenate([before, at_mm + np.array([-3.0, 0.0, 3.0]), behind])
    x = np.where(z > 0, 0.006 * np.maximum(z, 0.0) ** 2, 0.0)
    radii = np.where(np.abs(z - at_mm) < 0.1, left * radius_mm, radius_mm)
    return Anatomy((sweep("vessel", np.column_stack([x, 0 * x, z]), radii),))


def side_aneurysm(radius_mm: float = 1.8, sac_mm: float = 3.5) -> Anatomy:
    """A gently bent tube with a sac on its outer side."""
    vessel = bend(angle_deg=50.0, turn_mm=25.0, radius_mm=radius_mm).tubes[0]
    i = int(0.5 * len(vessel.points_mm))
    inward = vessel.tangents[i + 6] - vessel.tangents[i - 6]
    outward = -inward / np.linalg.norm(inward)
    root = vessel.points_mm[i]
    centre = root + (0.6 * radius_mm + sac_mm) * outward
    neck = sweep("neck", np.array([root, 0.5 * (root + centre), centre]), 1.5)
    return Anatomy((vessel, neck, ball("sac", centre, sac_mm)))


def end_aneurysm(radius_mm: float = 2.0, sac_mm: float = 7.0) -> Anatomy:
    """A straight tube that opens into a wide sac."""
    inlet = straight(length_mm=6.0, radius_mm=radius_mm).tubes[0]
    return Anatomy((inlet, ball("sac", [0.0, 0.0, 5.0 + sac_mm], sac_mm, blend_mm=1.0)))


def kissing(radius_mm: float = 1.8, wall_mm: float = 0.15) -> Anatomy:
    """Two bent vessels that come as near as ``wall_mm`` and part again; they are not joined."""
    z = np.concatenate([np.linspace(-INLET_MM, -0.5, 9), np.linspace(1.0, 32.0, 20)])
    away = 0.012 * (z - 10.0) ** 2
    half = radius_mm + 0.5 * wall_mm
    vessels = [np.column_stack([side * (half + away), 0 * z, z]) for side in (1.0, -1.0)]
    # a blend width of next to nothing: a shared wall, not a junction
    named = zip(("vessel", "neighbour"), vessels, strict=True)
    return Anatomy(tuple(sweep(name, points, radius_mm, blend_mm=1e-3) for name, points in named))
