"""Studies for ``calibrate`` with truth by the independent rod: true insertions, and the files by which they are judged.

No scans: a lumen as a closed surface of the analytic anatomy, and the true wires with noise drawn as traces have it. The
manifest states wire, walls, roll, friction and entry wrongly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from data_synthetic.geometry import normal_to, unit
from data_synthetic.rod.replay import TrueFrame, TrueInsertion
from data_synthetic.rod.rod import Profile, TrueWire
from data_synthetic.rod.truth import at_step, cached_replay

Array = NDArray[np.float64]
NOMINAL = TrueWire()
STIFF, SOFT = 2.0, 0.03
TRACE_SIGMA_MM, TRACE_BELL_MM, TIP_SIGMA_MM = 0.02, 1.3, 0.06
"""As traces of 0.3 mm voxels are off (README): across, per axis; how far that is correlated along; the tip."""
ENTRY_ERROR_MM, DIRECTION_ERROR_DEG, FORCE_SIGMA_N = 0.15, 2.0, 1e-3
FRICTION = 0.05


@dataclass(frozen=True)
class Physics:
    """What is true, relative to what the manifest states."""

    roll_deg: float
    rest: float
    taper: float
    soft: float
    stiff: float
    bending: float
    friction: float = FRICTION

    @staticmethod
    def drawn(seed: int) -> Physics:
        u = np.random.default_rng([seed, 14]).uniform(-1.0, 1.0, 6)
        roll, rest, taper, soft, stiff, bending = u
        factors = np.exp([0.25 * rest, 0.6 * taper, 0.6 * soft, 0.6 * stiff, 0.4 * bending])
        return Physics(25.0 * roll, *map(float, factors))

    @property
    def wire(self) -> TrueWire:
        """The shaft against the tip by ``taper``: the knots between follow in proportion on a logarithmic scale."""
        at, ei = np.array(NOMINAL.bending_N_mm2).T
        share = np.log(ei / ei[0]) / np.log(ei[-1] / ei[0])
        bending: Profile = tuple(zip(at.tolist(), (self.bending * ei * self.taper**share).tolist(), strict=True))
        curved: Profile = tuple((s, self.rest * value) for s, value in NOMINAL.rest_curvature_per_mm)
        return replace(NOMINAL, bending_N_mm2=bending, rest_curvature_per_mm=curved)


@dataclass(frozen=True, eq=False)
class Way:
    """An insertion: into which vessel, from where, how deep, at what stated roll, against which stated wall."""

    name: str
    role: str
    anatomy: Anatomy
    tube: Tube
    entry_arc_mm: float
    depths_mm: tuple[float, ...]
    roll_deg: float
    wall: float = STIFF

    @property
    def start(self) -> tuple[Array, Array]:
        i = round(self.entry_arc_mm / self.tube.step_mm)
        return np.array(self.tube.points_mm[i]), unit(np.array(self.tube.tangents[i]))


def _depths(first: float, last: float, count: int, back: float | None = None, fewer: int = 0) -> tuple[float, ...]:
    there = np.linspace(first, last, count)
    home = [] if back is None else np.linspace(last, back, fewer + 1)[1:]
    return tuple(np.round(np.concatenate([there, home]), 3).tolist())


def ways(seed: int) -> list[Way]:
    """Three insertions to calibrate with, six blind ones in two other anatomies."""
    rng = np.random.default_rng([seed, 15])
    helix, curve = shapes.helix(), shapes.s_curve(turn_mm=10.0)
    bend = shapes.bend(angle_deg=110.0, turn_mm=12.0)
    found = [
        Way("c-helix", "calibration", helix, helix.tubes[0], 4.0, _depths(10, 54, 9, 18, 5), 90.0),
        Way("c-bend", "calibration", bend, bend.tubes[0], 4.0, _depths(12, 44, 8, 18, 4), -40.0),
        Way("c-soft", "calibration", curve, curve.tubes[0], 4.0, _depths(12, 50, 9, 20, 4), 30.0, SOFT),
    ]
    siphon = circle_of_willis(rng, WillisPlan(aneurysm="none"))
    carotid = Anatomy((siphon.tube("right.ICA"),))
    fork = shapes.bifurcation()
    for number in range(3):
        turn, moved = rng.uniform(-45, 45, 2), rng.uniform(-0.5, 0.5)
        last = carotid.tubes[0].length_mm - 17.0 - 4.0 + moved
        found.append(
            Way(f"b-siphon-{number}", "validation", carotid, carotid.tubes[0], 17.0, _depths(10, last, 8), 95 + turn[0])
        )
        side = 180.0 * (number == 1)
        found.append(
            Way(
                f"b-fork-{number}",
                "validation",
                fork,
                fork.tubes[0],
                4.0,
                _depths(9, 30 + moved, 8),
                side + 0.5 * turn[1],
            )
        )
    return found


def truth(way: Way, physics: Physics, step_mm: float = 0.2) -> tuple[TrueFrame, ...]:
    """The true wires of an insertion; its push forces stand beside, see ``push_forces``."""
    wall = way.wall * (physics.soft if way.wall == SOFT else physics.stiff) * physics.bending
    entry, direction = way.start
    axis = normal_to(np.array([1.0, 0.0, 0.0]), direction)
    insertion = TrueInsertion(physics.wire, way.anatomy, wall, entry, direction, axis, friction=physics.friction)
    rolls = [way.roll_deg + physics.roll_deg] * len(way.depths_mm)
    return cached_replay(at_step(insertion, step_mm), way.depths_mm, rolls)
