"""The uncertainty of the inputs: one standard deviation of each, stated in the manifest or a default, and draws."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, Clamp, Wire
from pipeline.simulate.clamp_told import IF_AS_MODELLED
from pipeline.simulate.config import SimulateConfig

LUMEN_VOXELS, LUMEN_NOISE_VOXELS, LUMEN_BIAS_VOXELS = 0.07, 0.1, 0.05
"""Standard deviations of the lumen's surface in voxels: place by place apart from noise (measured with 0.2 to 0.6 mm
voxels); place by place by noise, where the lumen does not come from a scan, which states its own; and common to the
whole surface (measured: 0.03 at most). A right label map is as well known: to 0.1 (docs/howto/scans.md). Of voxels that
are no cubes the longest side counts."""
INSERTION_MM = 0.5
"""Standard deviation of a depth that is read from a scale on the wire's shaft."""
ROLL_DEG = 5.0
REST_CURVATURE, TAPER, WALL_STIFFNESS = 0.05, 0.1, 0.5
"""Relative standard deviations; the last two are of the logarithm."""
UNITS = {"roll_deg": " degrees", "lumen_mm": " mm", "lumen_bias_mm": " mm", "friction": ""}
FRICTION = 0.3
"""Relative to the coefficient that is stated: where none is, none is drawn, and what friction does is model error."""

LUMENS, SIDE_BY_SIDE = 50, 8
"""Fewest draws of the lumen's surface, or one for each member where there are fewer: it makes most of the spread, and
48 members in 6 lumens showed 0.11 mm of a frame's 0.27. Then the most members that share a lumen: as many as are
simulated side by side."""

SOURCES = (
    *("clamp", "depth", "roll", "lumen", "lumen_bias"),
    *("rest_curvature", "taper", "wall_stiffness", "friction"),
)
"""The inputs that are drawn."""


@dataclass(frozen=True, eq=False)
class Sigmas:
    """One standard deviation of every input.

    clamp : (6, 6) covariance, see ``Clamp``.     depth : (stops,), mm, of each by itself; depth_common : of all that
    are stated, together.     said : by source, in words.
    lumen, lumen_bias in mm, roll in degrees, the others as of ``Uncertainty``.
    """

    clamp: Array
    depth: Array
    roll: float
    lumen: float
    lumen_bias: float
    rest_curvature: float
    taper: float
    wall_stiffness: float
    friction: float
    said: dict[str, str]
    depth_common: float = 0.0


class Nominal(NamedTuple):
    """The insertion about which inputs are drawn.

    depth_mm, roll_deg : (stops,) of the whole way of the hand.     config : with the friction.     traced : (stops,)
    which depths are the traces', so that the tip stays where it is seen when the clamp is moved.     roll_sd_deg :
    standard deviation of a fitted roll, None of a stated one.
    """

    clamp: Clamp
    depth_mm: Array
    roll_deg: Array
    config: SimulateConfig
    traced: NDArray[np.bool_]
    roll_sd_deg: float | None = None


class Member(NamedTuple):
    """One insertion of the ensemble: its inputs.

    narrower_mm : common to the whole lumen.     lumen : number of the lumen's surface, and lumen_mm its deviation.
    """

    clamp: Clamp
    depth_mm: Array
    roll_deg: Array
    config: SimulateConfig
    narrower_mm: float
    lumen: int
    lumen_mm: float


def sigmas_of(
    stated: Mapping[str, float | None],
    nominal: Nominal,
    wire: Wire,
    depth_mm: Array,
    voxel_mm: float,
    noise_mm: float | None = None,
    calibrated: Mapping[str, float] | None = None,
) -> Sigmas:
    """The standard deviations of a case: what is stated, else what a calibration or a fit found, else the defaults.

    stated : keys of ``Uncertainty``, and roll_deg.     depth_mm : (stops,) of the depths.     noise_mm : of the
    lumen's surface by the scan's noise.     calibrated : by the same keys; of roll_deg that of the common
    offset, which adds to how far each insertion is turned by mistake.
    """
    found = calibrated or {}
    values, said = {}, {}
    for name, default in _defaults(nominal, wire, voxel_mm, noise_mm).items():
        source, of_roll = _source(name), name == "roll_deg"
        otherwise = "fitted" if of_roll and nominal.roll_sd_deg is not None else "default"
        values[source], told = _known(stated.get(name), found.get(name), (default, otherwise), both=of_roll)
        said[source] = f"{values[source]:.3g}{UNITS.get(name, ' (relative)')}, {told}"
    clamp = nominal.clamp
    known = clamp.covariance is not None
    condition = f" ({IF_AS_MODELLED})" * bool(clamp.note)
    said["clamp"] = f"{clamp.sigma_mm:.3f} mm across and {clamp.sigma_deg:.2f} degrees{condition}" if known else "exact"
    kinds = (("traced", depth_mm[nominal.traced]), ("manifest", depth_mm[~nominal.traced]))
    said["depth"] = " and ".join(f"{float(np.median(some)):.2f} mm, {kind}" for kind, some in kinds if len(some))
    if (common := found.get("insertion_mm", 0.0)) and not nominal.traced.all():
        said["depth"] += f"; {common:.2f} mm, common, calibrated"
    covariance = np.array(clamp.covariance) if known else np.zeros((6, 6))
    return Sigmas(covariance, depth_mm, **values, said=said, depth_common=common)


def _defaults(nominal: Nominal, wire: Wire, voxel_mm: float, noise_mm: float | None) -> dict[str, float]:
    """Standard deviations of what is neither stated nor calibrated, by the keys of ``Uncertainty``, and roll_deg."""
    noise = LUMEN_NOISE_VOXELS * voxel_mm if noise_mm is None else noise_mm
    return {
        "roll_deg": (ROLL_DEG if nominal.roll_sd_deg is None else nominal.roll_sd_deg) * wire.curved,
        "lumen_mm": float(np.hypot(LUMEN_VOXELS * voxel_mm, noise)),
        "lumen_bias_mm": LUMEN_BIAS_VOXELS * voxel_mm,
        "rest_curvature": REST_CURVATURE * wire.curved,
        "taper": TAPER * isinstance(wire.bending_stiffness_N_mm2, list),
        "wall_stiffness": WALL_STIFFNESS,
        "friction": FRICTION * (nominal.config.friction or 0.0),
    }


def _known(
    stated: float | None, calibrated: float | None, otherwise: tuple[float, str], *, both: bool
) -> tuple[float, str]:
    """The standard deviation of an input, and whence it is. both : what a calibration found adds to the rest."""
    own, told = otherwise if stated is None else (stated, "stated")
    if calibrated is None or not (both or stated is None):
        return own, told
    return (float(np.hypot(own, calibrated)), f"{told} and calibrated") if both else (calibrated, "calibrated")


def _source(name: str) -> str:
    """A key of ``Uncertainty`` as a source: without its unit."""
    return name.removesuffix("_mm").removesuffix("_deg")


def members_per_lumen(count: int) -> int:
    """How many of ``count`` members share a lumen."""
    return min(max(count // LUMENS, 1), SIDE_BY_SIDE)


def drawn(nominal: Nominal, sigmas: Sigmas, count: int, per_lumen: int, seed: int = 0) -> list[Member]:
    """Members of an ensemble. per_lumen : how many of them share one draw of the lumen's surface.

    Every member has its own generator: a larger ensemble begins with the members of a smaller one.
    """
    members = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        clamp, along = _moved(nominal.clamp, sigmas.clamp, rng)
        depth = nominal.depth_mm + sigmas.depth * rng.standard_normal(len(sigmas.depth)) - along * nominal.traced
        roll, narrower, curvature, taper, wall, friction = rng.standard_normal(6)
        old = nominal.config
        config = replace(
            old,
            rest_curvature_scale=old.rest_curvature_scale * max(1.0 + sigmas.rest_curvature * curvature, 0.0),
            taper_scale=old.taper_scale * float(np.exp(sigmas.taper * taper)),
            wall_scale=old.wall_scale * float(np.exp(sigmas.wall_stiffness * wall)),
            friction=max((old.friction or 0.0) + sigmas.friction * friction, 0.0),
        )
        depth = depth + sigmas.depth_common * rng.standard_normal() * ~nominal.traced
        bias, rolls = sigmas.lumen_bias * narrower, nominal.roll_deg + sigmas.roll * roll
        surface = number // per_lumen if sigmas.lumen else 0
        members.append(Member(clamp, np.maximum(depth, 0.1), rolls, config, bias, surface, sigmas.lumen))
    return members


def _moved(clamp: Clamp, covariance: Array, rng: np.random.Generator) -> tuple[Clamp, float]:
    """A clamp drawn about another, and how far its entry lies along the wire, mm."""
    variances, axes = np.linalg.eigh(covariance)
    step = axes @ (np.sqrt(np.maximum(variances, 0.0)) * rng.standard_normal(6))
    direction = clamp.direction + step[3:]
    moved = replace(clamp, entry_mm=clamp.entry_mm + step[:3], direction=direction / np.linalg.norm(direction))
    return moved, float(step[:3] @ clamp.direction)


def alone(sigmas: Sigmas, source: str) -> Sigmas:
    """The standard deviations with all inputs but one exact; draws of that one stay the same."""
    kept = (source, "depth_common") if source == "depth" else (source,)
    return replace(exact(sigmas), **{name: getattr(sigmas, name) for name in kept})


def exact(sigmas: Sigmas) -> Sigmas:
    """The standard deviations with all inputs exact."""
    none: dict[str, Any] = {name: 0.0 * getattr(sigmas, name) for name in (*SOURCES, "depth_common")}
    return replace(sigmas, **none)
