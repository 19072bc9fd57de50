"""An insertion that is fitted, and the solver's wires for it under many parameters at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.calibrate.unknowns import FRICTION, ROLL, bent, wall_factor
from pipeline.model import Array, Clamp, OverWire, Wall, Wire
from pipeline.simulate import inserted, together
from pipeline.simulate.clamp import STEP_MM, STEP_RAD, TIP_VOXELS, Prior, TracedFrame, depths_from, moved
from pipeline.simulate.config import SolverConfig
from pipeline.simulate.way import Stop, Way
from solver import Insertion, Solution, VesselWall

LUMEN_VOXELS = 0.15
"""Standard deviation, voxels, of the offset of the whole wall from where it was segmented, where the manifest states
none: it is hard to tell from the wall's stiffness."""
WALL_VOXELS = 0.1
"""The same of a segmented wall from place to place."""
OWN = 7
"""Unknowns of an insertion itself: the clamp's place (3) and tilts (2), the wall's offset, its own roll."""
WALL_OFFSET = 5
"""Which of them is the wall's offset."""
OWN_STEPS = np.array([STEP_MM] * 3 + [STEP_RAD] * 2 + [0.02, 1.0])
UNKNOWN_ROLL_DEG = 104.0
"""Standard deviation of a roll of which nothing is known: uniform over a whole turn."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A case with its traces. group : of the cases of one insertion.     vessel : the wall at stiffness 1.
    wall : as stated.     given, prior : clamp.

    seen : the frames that are fitted.     passed : those whose trace is refused, which the wire went through as well.
    roll_free : the roll is not stated.     roll_sigma_deg : how well it is where it is: an offset that all insertions
    share is told from what each was turned by mistake.     lumen_bias_mm, lumen_mm : how well the wall is known, as a
    whole and from place to place, None where that is not stated.     force_N : (frames,) measured push, NaN where it is
    not; force_sigma_N : its standard deviation.
    """

    name: str
    group: str
    vessel: VesselWall
    wire: Wire
    wall: Wall
    given: Clamp
    prior: Prior
    seen: tuple[TracedFrame, ...]
    voxel_mm: float
    roll_free: bool = False
    roll_sigma_deg: float = 0.0
    lumen_bias_mm: float | None = None
    lumen_mm: float | None = None
    catheter: OverWire | None = None
    force_N: Array | None = None
    force_sigma_N: float = 1e-3
    passed: tuple[Stop, ...] = ()

    @property
    def insertion(self) -> tuple[str, bool]:
        """By which its cases are known: a roll that is fitted and one that is stated have no error in common."""
        return self.group, self.roll_free

    @property
    def turned(self) -> bool:
        """Whether its roll is fitted for itself, beside the offset that is common; of a straight wire none is seen."""
        return self.wire.curved and (self.roll_free or self.roll_sigma_deg > 0.0)

    @property
    def sigmas(self) -> Array:
        """Prior standard deviations (OWN + frames,) of what belongs to this insertion alone; 0 is exact."""
        tips = np.hypot([np.nan_to_num(f.curve.tip_sigma_mm) for f in self.seen], TIP_VOXELS * self.voxel_mm)
        roll = UNKNOWN_ROLL_DEG if self.roll_free else self.roll_sigma_deg
        return np.concatenate([self.prior.sigmas, [self.wall_sigmas_mm[0], roll], tips])

    @property
    def wall_sigmas_mm(self) -> tuple[float, float]:
        """Standard deviations of the wall, mm, as a whole and from place to place."""
        bias, local = LUMEN_VOXELS * self.voxel_mm, WALL_VOXELS * self.voxel_mm
        return (
            bias if self.lumen_bias_mm is None else self.lumen_bias_mm,
            local if self.lumen_mm is None else self.lumen_mm,
        )


@dataclass(frozen=True, eq=False)
class Point:
    """Values of all shared parameters by name, and of an insertion's own (OWN + frames,)."""

    shared: Mapping[str, float]
    own: Array


def depths_at(trial: Trial, point: Point) -> list[float]:
    """Depth of each frame, mm from the clamp."""
    return depths_from(moved(trial.given, point.own[:5]), trial.seen, point.own[OWN:])


def insertion_at(trial: Trial, point: Point, solver: SolverConfig) -> Insertion:
    """The insertion with other parameters, before its first push; ValueError where the solver refuses it."""
    stiffness = trial.wall.stiffness_N_mm2 * wall_factor(trial.wall.stiffness_N_mm2, point.shared)
    vessel = trial.vessel.like(stiffness_N_mm2=stiffness, friction=point.shared.get(FRICTION, trial.wall.friction))
    # a wall that is nearer by some length is the same as a wire with a radius larger by it
    wire = replace(trial.wire, radius_mm=max(trial.wire.radius_mm + float(point.own[WALL_OFFSET]), 1e-3))
    return inserted(vessel, bent(wire, point.shared), moved(trial.given, point.own[:5]), solver, 1.0, trial.catheter)


def way_at(trial: Trial, point: Point) -> Way:
    """The way of the hand with other parameters, on which the frames with a trace are read."""
    turn = float(point.own[6]) + (0.0 if trial.roll_free else point.shared.get(ROLL, 0.0))
    each = zip(trial.seen, depths_at(trial, point), strict=True)
    read = [Stop(frame.index, depth, frame.roll_deg, frame.catheter_mm) for frame, depth in each]
    return Way.reading(read, trial.passed, sheathed=trial.catheter is not None).turned(turn)


def replayed(pairs: Sequence[tuple[Trial, Point]], solver: SolverConfig) -> list[list[Solution]]:
    """The wires of many insertions at their traced frames, side by side."""
    insertions = [insertion_at(trial, point, solver) for trial, point in pairs]
    return together(insertions, [way_at(trial, point) for trial, point in pairs], threads=None)
