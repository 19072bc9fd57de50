"""The circle of Willis with both carotid siphons and an aneurysm.

Diameters in mm, mean (sd). Rai et al., J NeuroIntervent Surg 5 (2013) 371: cavernous ICA 5.0 (0.6), ICA terminus
3.6 (0.4), M1 3.1 (0.4). Rai et al., J NeuroIntervent Surg 5 (2013) 597: distal vertebral 2.8 (0.6), distal basilar
3.1 (0.5). Alastruey et al., J Biomech 40 (2007) 1794: A1 2.34, A2 2.40, ACoA 1.48 (length 3), PCoA 1.46 (length 15),
P1 2.14 (length 5), P2 2.10, basilar length 29. Where no spread is given, 15 % is taken. LPS mm, about the sella.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_synthetic.anatomy.tubes import Anatomy, Tube, ball, sweep
from data_synthetic.geometry import Array

DIAMETERS_MM = {
    "cavernous": (5.0, 0.6),
    "terminus": (3.6, 0.4),
    "M1": (3.1, 0.4),
    "A1": (2.34, 0.35),
    "A2": (2.40, 0.36),
    "ACoA": (1.48, 0.22),
    "PCoA": (1.46, 0.22),
    "P1": (2.14, 0.32),
    "P2": (2.10, 0.31),
    "basilar": (3.1, 0.5),
    "vertebral": (2.8, 0.6),
}
SPREAD_LIMIT = 1.0
"""Diameters are normal, cut at this many published sd: a vessel far from its mean would be another scene."""
CENTRELINES = Path(__file__).with_name("willis.csv")
"""Control points of every vessel in its own direction, LPS mm: of the right side (x < 0) where it has two."""
BOTH_SIDES = ("ICA", "M1", "A1", "A2", "PCoA", "P1", "P2", "vertebral")

SWING_MM = np.array([[0.0, 0.0, 0.0], [-3.0, -2.0, 0.0], [1.5, 1.5, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
"""What a tortuous vertebral artery adds to its control points: V4 swings out and back."""


@dataclass(frozen=True)
class WillisPlan:
    """Which variant to build. missing : tube names left out, for example ("left.PCoA",).

    aneurysm : "terminus", "acoa", "sidewall" or "none".     sac_mm : radius of the sac.     jitter_mm : sd of the
    control points, so that no two seeds share an anatomy.     spread : share of the published sd with which diameters
    are drawn; half of it keeps a catalogue scene the same situation from seed to seed.
    """

    aneurysm: str = "terminus"
    sac_mm: float = 4.0
    jitter_mm: float = 0.3
    spread: float = 0.5
    missing: tuple[str, ...] = ()
    tortuous_vertebrals: bool = False


def circle_of_willis(rng: np.random.Generator, plan: WillisPlan) -> Anatomy:
    """A seeded anatomy; the right carotid is the tube ``right.ICA``, entered from below."""
    mean, sd = np.array(list(DIAMETERS_MM.values())).T
    drawn = mean + sd * np.clip(rng.normal(0.0, plan.spread, len(mean)), -SPREAD_LIMIT, SPREAD_LIMIT)
    radius = dict(zip(DIAMETERS_MM, (0.5 * drawn).tolist(), strict=True))
    rows = np.loadtxt(CENTRELINES, dtype=str, delimiter=",", skiprows=1)
    points = {name: rows[rows[:, 0] == name, 1:].astype(np.float64) for name in np.unique(rows[:, 0]).tolist()}
    if plan.tortuous_vertebrals:
        points["vertebral"] += SWING_MM
    wide, end = radius["cavernous"], radius["terminus"]
    # petrous from 0.9 of the cavernous size, cavernous at its own, tapering to the terminus
    carotid = np.interp(np.arange(len(points["ICA"])), [0, 8, 10, 14], [0.9 * wide, wide, wide, end])
    middle = np.r_[0.95 * end, np.full(len(points["M1"]) - 1, radius["M1"])]
    radii: dict[str, float | Array] = {**radius, "ICA": carotid, "M1": middle}
    tubes: list[Tube] = []
    jitter = {name: rng.normal(0.0, plan.jitter_mm, (60, 3)) for name in ("right", "left")}
    for side, sign in (("right", 1.0), ("left", -1.0)):
        for name in BOTH_SIDES:
            # ends that meet others are not moved
            moved = points[name].copy()
            moved[1:-1] += jitter[side][: len(moved) - 2]
            tubes.append(sweep(f"{side}.{name}", moved * [sign, 1.0, 1.0], radii[name]))
    tubes.append(sweep("ACoA", points["ACoA"], radius["ACoA"]))
    tubes.append(sweep("basilar", points["basilar"], np.linspace(1.1, 1.0, 5) * radius["basilar"]))
    tubes += _aneurysm(plan, tubes[0], points["ACoA"][1], radius)
    return Anatomy(tuple(t for t in tubes if t.name not in plan.missing))


def _aneurysm(plan: WillisPlan, carotid: Tube, acoa_mm: Array, radius: dict[str, float]) -> list[Tube]:
    """A saccular aneurysm: a short neck and a ball; ``acoa_mm`` is the middle of the anterior communicating artery."""
    places = {
        "terminus": (carotid.points_mm[-1], carotid.tangents[-1], 0.85 * radius["terminus"]),
        "acoa": (acoa_mm, np.array([0.0, -0.6, 0.8]), radius["ACoA"]),
        "sidewall": (*_sidewall(carotid), 0.7 * radius["cavernous"]),
    }
    if plan.aneurysm == "none":
        return []
    root, axis, neck = places[plan.aneurysm]
    centre = root + (plan.sac_mm - 0.5) * axis
    return [
        sweep("neck", np.array([root, root + 0.5 * (centre - root), centre]), neck, blend_mm=0.8),
        ball("sac", centre, plan.sac_mm, blend_mm=1.2),
    ]


def _sidewall(carotid: Tube) -> tuple[Array, Array]:
    """Root and outward axis on the outer wall of the genu."""
    i = int(0.86 * len(carotid.points_mm))
    turn = carotid.tangents[i + 4] - carotid.tangents[i - 4]
    outward = -turn / np.linalg.norm(turn)
    return carotid.points_mm[i] + 0.5 * carotid.radii_mm[i] * outward, outward
