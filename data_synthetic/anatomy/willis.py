"""The circle of Willis with both carotid siphons and an aneurysm.

Diameters in mm, mean (sd). Rai et al., J NeuroIntervent Surg 5 (2013) 371: cavernous ICA 5.0 (0.6), ICA terminus
3.6 (0.4), M1 3.1 (0.4). Rai et al., J NeuroIntervent Surg 5 (2013) 597: distal vertebral 2.8 (0.6), distal basilar
3.1 (0.5). Alastruey et al., J Biomech 40 (2007) 1794: A1 2.34, A2 2.40, ACoA 1.48 (length 3), PCoA 1.46 (length 15),
P1 2.14 (length 5), P2 2.10, basilar length 29. Where no spread is given, 15 % is taken. LPS mm, about the sella.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synthetic.anatomy.tubes import Anatomy, Tube, ball, sweep
from data_synthetic.geometry.vectors import Array

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
"""Diameters are drawn within this many published sd: a vessel far from its mean would be another scene."""

# right side, x < 0; the left side is its mirror image
CAROTID = np.array(
    [
        [-21.0, 4.0, -46.0],
        [-21.0, 4.0, -40.0],
        [-21.2, 4.0, -33.0],
        [-21.0, 3.8, -27.0],
        [-19.8, 2.6, -22.0],
        [-16.6, 0.0, -18.6],
        [-12.8, -2.4, -16.4],
        [-10.4, -5.0, -13.2],
        [-9.6, -8.6, -10.0],
        [-9.4, -13.2, -8.2],
        [-9.4, -18.0, -6.6],
        [-9.7, -21.0, -2.8],
        [-10.2, -20.4, 2.0],
        [-11.0, -17.0, 5.6],
        [-12.0, -13.0, 8.6],
    ]
)
MIDDLE = np.array(
    [
        [-12.0, -13.0, 8.6],
        [-15.6, -13.6, 10.0],
        [-20.0, -13.2, 10.6],
        [-26.0, -11.0, 10.2],
        [-34.0, -7.0, 11.0],
        [-44.0, -3.0, 12.0],
    ]
)
ANTERIOR_1 = np.array([[-12.0, -13.0, 8.6], [-9.0, -15.6, 10.0], [-5.4, -17.4, 11.6], [-2.2, -18.0, 13.4]])
ANTERIOR_2 = np.array(
    [
        [-2.2, -18.0, 13.4],
        [-1.9, -19.4, 17.0],
        [-1.8, -22.0, 23.0],
        [-1.8, -22.4, 30.0],
        [-1.8, -18.0, 38.0],
        [-1.8, -12.0, 44.0],
    ]
)
ANTERIOR_COMMUNICATING = np.array([[-2.2, -18.0, 13.4], [0.0, -18.3, 13.7], [2.2, -18.0, 13.4]])
POSTERIOR_COMMUNICATING = np.array(
    [[-10.8, -17.4, 5.2], [-10.0, -12.0, 5.0], [-9.4, -6.0, 5.4], [-8.6, -0.8, 5.8]]
)
POSTERIOR_1 = np.array([[0.0, 2.0, 3.0], [-3.0, 1.4, 4.6], [-6.0, 0.2, 5.4], [-8.6, -0.8, 5.8]])
POSTERIOR_2 = np.array(
    [
        [-8.6, -0.8, 5.8],
        [-12.6, 2.0, 6.2],
        [-16.0, 8.0, 7.2],
        [-16.5, 15.0, 8.4],
        [-15.0, 24.0, 9.0],
        [-14.0, 44.0, 10.0],
    ]
)
BASILAR = np.array(
    [[0.0, 6.5, -26.0], [0.3, 4.0, -19.0], [0.2, 2.6, -11.0], [0.0, 2.2, -3.0], [0.0, 2.0, 3.0]]
)
VERTEBRAL = np.array(
    [[-12.0, 18.0, -50.0], [-10.0, 15.5, -42.0], [-6.0, 11.5, -35.0], [-2.2, 8.4, -29.5], [0.0, 6.5, -25.0]]
)


@dataclass(frozen=True)
class WillisPlan:
    """Which variant to build. missing : tube names left out, for example ("left.PCoA",).

    aneurysm : "terminus", "acoa", "sidewall" or "none".     sac_mm : radius of the sac.     jitter_mm : sd of the
    control points, so that no two seeds share an anatomy.     spread : share of the published sd with which diameters
    are drawn; half of it keeps a catalogue scene the same situation from seed to seed.     stenosis : share of the
    cavernous radius taken away.
    """

    aneurysm: str = "terminus"
    sac_mm: float = 4.0
    jitter_mm: float = 0.3
    spread: float = 0.5
    stenosis: float = 0.0
    missing: tuple[str, ...] = ()
    tortuous_vertebrals: bool = False


def circle_of_willis(rng: np.random.Generator, plan: WillisPlan | None = None) -> Anatomy:
    """A seeded anatomy; the right carotid is the tube ``right.ICA``, entered from below."""
    plan = plan or WillisPlan()
    radius = {name: 0.5 * _draw(rng, mean, sd, plan.spread) for name, (mean, sd) in DIAMETERS_MM.items()}
    tubes: list[Tube] = []
    joints = {name: rng.normal(0.0, plan.jitter_mm, (60, 3)) for name in ("right", "left")}
    for side, sign in (("right", 1.0), ("left", -1.0)):
        tubes += _one_side(side, np.array([sign, 1.0, 1.0]), radius, joints[side], plan)
    tubes.append(sweep("ACoA", ANTERIOR_COMMUNICATING, radius["ACoA"]))
    tubes.append(sweep("basilar", BASILAR, np.linspace(1.1, 1.0, len(BASILAR)) * radius["basilar"]))
    tubes += _aneurysm(plan, tubes[0], radius)
    return Anatomy(tuple(t for t in tubes if t.name not in plan.missing))


def _draw(rng: np.random.Generator, mean: float, sd: float, spread: float) -> float:
    return mean + sd * float(np.clip(rng.normal(0.0, spread), -SPREAD_LIMIT, SPREAD_LIMIT))


def _one_side(
    side: str, mirror: Array, radius: dict[str, float], noise: Array, plan: WillisPlan
) -> list[Tube]:
    """Carotid, M1, A1, A2, PCoA, P1, P2 and vertebral of one side; ends that meet others are not moved."""

    def vessel(name: str, points: Array, radii: float | Array) -> Tube:
        moved = points.copy()
        moved[1:-1] += noise[: len(points) - 2]
        return sweep(f"{side}.{name}", moved * mirror, radii)

    vertebral = VERTEBRAL.copy()
    if plan.tortuous_vertebrals:
        vertebral = _loop(vertebral)
    return [
        vessel("ICA", CAROTID, _carotid_radii(radius, plan.stenosis if side == "right" else 0.0)),
        vessel("M1", MIDDLE, np.r_[0.95 * radius["terminus"], np.full(len(MIDDLE) - 1, radius["M1"])]),
        vessel("A1", ANTERIOR_1, radius["A1"]),
        vessel("A2", ANTERIOR_2, radius["A2"]),
        vessel("PCoA", POSTERIOR_COMMUNICATING, radius["PCoA"]),
        vessel("P1", POSTERIOR_1, radius["P1"]),
        vessel("P2", POSTERIOR_2, radius["P2"]),
        vessel("vertebral", vertebral, radius["vertebral"]),
    ]


def _carotid_radii(radius: dict[str, float], stenosis: float) -> Array:
    """Petrous as the terminus widened, cavernous at its own size, tapering to the terminus."""
    n = len(CAROTID)
    wide, end = radius["cavernous"], radius["terminus"]
    radii = np.interp(np.arange(n), [0, n - 7, n - 5, n - 1], [0.9 * wide, wide, wide, end])
    radii[n - 8] *= 1.0 - stenosis
    return radii


def _loop(points: Array) -> Array:
    """A V4 segment that swings out and back."""
    swing = np.array([[0.0, 0.0, 0.0], [-3.0, -2.0, 0.0], [1.5, 1.5, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return np.asarray(points + swing)


def _aneurysm(plan: WillisPlan, carotid: Tube, radius: dict[str, float]) -> list[Tube]:
    """A saccular aneurysm: a short neck and a ball."""
    places = {
        "terminus": (carotid.points_mm[-1], carotid.tangents[-1], 0.85 * radius["terminus"]),
        "acoa": (ANTERIOR_COMMUNICATING[1], np.array([0.0, -0.6, 0.8]), radius["ACoA"]),
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
