"""Trivial predictors: what anybody would guess without a simulator. Skill is measured against them.

The paths are told where the wire ends up (the deepest traced tip), which a simulator is not: beating them is not easy,
and that is the point. Those in ``TOLD`` see something of the frame itself, or of a later one: they are printed beside
the others, and skill is never measured against them. ``register`` adds one, with its column.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pipeline.arrays.grids import around, wall_of_grid
from pipeline.arrays.polyline import at_arc, samples, smooth, to_length
from pipeline.compare.branches import branches_of
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import VesselAxis, module_of, point_to_curve, rms, scored
from pipeline.compare.pinned import pinned
from pipeline.compare.taut import pulled_tight
from pipeline.compare.ways import cheapest_ways, nearest
from pipeline.model import Array, Clamp, Lumen
from reports.schema import ERRORS, predictor
from solver import Grid, GuideWire, Status, VesselWall, relax

CENTRE_POWER = 3
"""Cost = (clearance + voxel)^-3: high enough to hold the path on the medial line in bends (at 2 it cuts corners)."""
TIE = 0.01
"""By so much more a voxel at the wall costs the shortest path than one on the axis. From voxel to voxel many ways are
equally short, and may lie a millimetre apart: the last digit of a voxel size chose between them. They are pulled tight
after that."""
ROOM_MM = 8.0
"""Paths are looked for in the traced wires' box and this much around it: a detour outside is no predictor."""
HARD_WALL_N_MM2 = 100.0
"""With EI = 10 N mm^2 a wire sinks in by less than 0.05 mm: bending alone decides."""


@dataclass(frozen=True, eq=False)
class Clues:
    """What a predictor may know of a case: lumen, clamp, the wire's radius, and the deepest traced wire (n, 3)."""

    lumen: Lumen
    clamp: Clamp
    radius_mm: float
    deepest_mm: Array

    @cached_property
    def room(self) -> Grid:
        """The signed distance, cropped around the traced wires: for a circle of Willis a tenth of the memory."""
        return around(self.lumen.distance, np.vstack([self.clamp.entry_mm, self.deepest_mm]), ROOM_MM)

    @cached_property
    def centreline(self) -> Array | None:
        """The lumen's centreline (n, 3) from the entry towards the deepest tip; None where they are not joined."""
        voxel = float(self.room.spacing_mm.mean())
        return self._path(0.0, lambda clearance: (np.maximum(clearance, 0) + voxel) ** -CENTRE_POWER)

    @cached_property
    def shortest(self) -> Array | None:
        """The shortest path (n, 3) that leaves the wire's radius to the wall."""
        path = self._path(self.radius_mm, lambda clearance: 1.0 + TIE * (1.0 - clearance / clearance.max()))
        return None if path is None else pulled_tight(path, self.room, self._room_mm(self.radius_mm))

    def _room_mm(self, wanted_mm: float) -> float:
        """What a path leaves to the wall: as much as wanted, or half of the greatest depth."""
        return min(wanted_mm, 0.5 * float(-self.room.values.min()))

    def _path(self, room_mm: float, cost: Callable[[Array], Array]) -> Array | None:
        """The cheapest path through voxels that are further from the wall than ``room_mm`` or half the greatest."""
        depth = -self.room.values
        open_to = depth > np.float64(self._room_mm(room_mm))
        costs = np.full(depth.shape, np.inf)
        costs[open_to] = cost(depth[open_to].astype(np.float64))
        path = voxel_path(self.room, costs, self.clamp.entry_mm, self.deepest_mm[-1])
        return None if path is None else smooth(path, 0.5 * float(self.room.spacing_mm.mean()))

    @cached_property
    def way(self) -> VesselAxis:
        """The vessel's axis and its branches around the traced wires."""
        return VesselAxis(self.centreline, branches_of(self.room, self.clamp.entry_mm))

    def known_ways(self) -> None:
        """Compute once what all frames share but ``shortest``, before these are shared among processes."""
        _ = self.way, self.hard_wall

    def take_shortest(self, path: Array | None) -> None:
        """Keep the shortest path, which may have been found in another process."""
        self.__dict__["shortest"] = path

    @cached_property
    def straight_wire(self) -> GuideWire:
        """A wire that is straight at rest."""
        return GuideWire(segment_mm=1.0, radius_mm=self.radius_mm, bending_stiffness_N_mm2=10.0)

    @cached_property
    def hard_wall(self) -> VesselWall:
        """A hard wall around the traced wires, for ``straight_wire``."""
        return wall_of_grid(self.room, HARD_WALL_N_MM2)


@dataclass(frozen=True, eq=False)
class PredictorInputs:
    """What a predictor may see besides the depth.

    previous_mm, following_mm : (n, 3) the last trusted trace before this frame, and the first one after it.
    tip_mm : (3,) the traced tip of this frame.     simulated : our solver's wires with a part of the input left out, by
    the name of the predictor.
    """

    previous_mm: Array | None = None
    following_mm: Array | None = None
    tip_mm: Array | None = None
    simulated: Mapping[str, Array] = field(default_factory=dict)


Guess = Callable[[Clues, float, PredictorInputs], Array | None]
"""From the clues, a depth (mm) and what is seen to a wire (m, 3), or None."""


def of_path(path: Array | None, depth_mm: float) -> Array | None:
    """A path cut at, or continued straight to, a depth."""
    return None if path is None or len(path) < 2 else to_length(path, depth_mm)


def min_bending(clues: Clues, depth_mm: float, _seen: PredictorInputs = PredictorInputs()) -> Array | None:
    """The curve of least bending in the lumen: a straight wire laid on the centreline and let go."""
    start = of_path(clues.centreline, depth_mm)
    if start is None:
        return None
    solution = relax(
        clues.straight_wire,
        clues.hard_wall,
        depth_mm=depth_mm,
        entry_mm=start[0],
        entry_direction=clues.clamp.direction,
        start_mm=start,
    )
    # beyond the room it is a poor guess, but one
    at_rest = solution.converged or solution.status is Status.LEFT_GRID
    return np.asarray(solution.joints_mm) if at_rest else None


def to_this_tip(clues: Clues, depth_mm: float, seen: PredictorInputs) -> Array | None:
    """The curve of least bending whose tip is held at the frame's own."""
    start = min_bending(clues, depth_mm)
    if start is None or seen.tip_mm is None:
        return None
    return pinned(clues.straight_wire, clues.hard_wall, clues.clamp, start, seen.tip_mm)


def between(_: Clues, depth_mm: float, seen: PredictorInputs) -> Array | None:
    """The mean, at equal arc lengths, of the traces before and after this frame: they show where the wire went."""
    sides = [of_path(curve, depth_mm) for curve in (seen.previous_mm, seen.following_mm)]
    arc = samples(depth_mm, 0.5)
    both = [at_arc(curve, arc) for curve in sides if curve is not None]
    return np.asarray(np.mean(both, axis=0)) if len(both) == 2 else None


NULLS: dict[str, Guess] = {
    "centreline": lambda clues, depth, _: of_path(clues.centreline, depth),
    "shortest": lambda clues, depth, _: of_path(clues.shortest, depth),
    "min_bending": min_bending,
    "previous": lambda _, depth, seen: of_path(seen.previous_mm, depth),
    "roll_unknown": lambda _clues, _depth, seen: seen.simulated.get("roll_unknown"),
    "no_tip_curve": lambda _clues, _depth, seen: seen.simulated.get("no_tip_curve"),
    "pinned": to_this_tip,
    "neighbours": between,
}
TOLD = {"pinned": "where this frame's tip is", "neighbours": "the frame after this one"}
"""Predictors that skill is not measured against, and what they are told of the frame or of a later one."""
ANOTHER = "another"
"""Another insertion at the same depth: known once all are done, so it stands in overall.csv alone."""


def rivals() -> list[str]:
    """The predictors that skill may be measured against."""
    return [*(name for name in NULLS if name not in TOLD), ANOTHER]


def register(name: str, label: str, meaning: str, guess: Guess, told: str = "") -> None:
    """Add a predictor; its column ``null_<name>_rms_mm`` is in errors.csv, summary.csv and the pages from then on.

    label : what legends call it.     meaning : one line for the list of columns.     told : as in TOLD; empty: it
    sees neither the frame nor a later one.     What it guesses is never kept from an earlier run.
    """
    ERRORS.add(replace(predictor(name, label, meaning), module=module_of(guess)))
    NULLS[name] = guess
    TOLD.pop(name, None)
    TOLD.update({name: told} if told else {})


def score(
    clues: Clues, depth_mm: float, seen: PredictorInputs, curve_mm: Array, config: CompareConfig
) -> dict[str, float]:
    """Root mean square distance (mm) of every predictor's wire from the traced curve, by the predictor's name.

    Wires are sampled where the simulated one is; a predictor that has no guess has no entry.
    """
    arc = scored(samples(depth_mm, config.sample_mm), config.skip_mm)
    guesses = {name: guess(clues, depth_mm, seen) for name, guess in NULLS.items()}
    return {
        name: rms(point_to_curve(at_arc(wire, arc), curve_mm)[0]) for name, wire in guesses.items() if wire is not None
    }


def voxel_path(clearance: Grid, cost: Array, entry_mm: Array, target_mm: Array) -> Array | None:
    """Cheapest path (n, 3) LPS mm through voxels of finite cost, or None where the two ends are not joined."""
    ways = cheapest_ways(cost, clearance.spacing_mm, clearance.to_index(entry_mm))
    way = None if ways is None else ways.to(nearest(ways.voxels, clearance.to_index(target_mm)))
    return None if way is None else np.vstack([entry_mm, clearance.to_mm(way.astype(float))[1:]])
