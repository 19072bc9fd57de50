"""The insertion replayed many times with other inputs, and how far that spreads the wires."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from pipeline.arrays.grids import around
from pipeline.arrays.polyline import at_arc
from pipeline.budget.inputs import Member
from pipeline.budget.surface import displaced
from pipeline.model import Array, Lumen, OverWire, Wall, Wire
from pipeline.simulate import insertion_of, together, wall_of
from pipeline.simulate.config import SolverConfig
from pipeline.simulate.way import Way
from solver import VesselWall

NARROWEST_MM = 1e-3
ROOM_MM = 6.0
"""Margin of the cropped lumen around the nominal wires: a member's wire may lie elsewhere by that much."""


@dataclass(frozen=True, eq=False)
class Scene:
    """What all members share.

    solver : with the length of the segments.     wires : nominal ones, around which the lumen is cropped.
    way : of the hand, on which the frames with a budget are read.     seed : of the lumens' surfaces.
    """

    wire: Wire
    wall: Wall
    lumen: Lumen
    solver: SolverConfig
    wires: Sequence[Array]
    way: Way
    catheter: OverWire | None = None
    seed: int = 0

    def vessel(self) -> VesselWall:
        """The lumen's wall around the nominal wires."""
        return wall_of(around(self.lumen.distance, np.concatenate(self.wires), ROOM_MM), self.solver.hull)


def replayed(scene: Scene, ensembles: Sequence[Sequence[Member]], arc_mm: Sequence[Array]) -> list[list[Array]]:
    """For each ensemble the wires of each frame that is read (members, n, 3), at arc lengths (n,) from the entry; NaN
    for one that is not at rest.

    Members that share a lumen are simulated side by side, of whichever ensemble; one lumen is held at a time.
    """

    def surface(place: tuple[int, int]) -> tuple[int, float, float]:
        return member(place).lumen, member(place).lumen_mm, _beyond_radius(scene.wire, member(place))

    def member(place: tuple[int, int]) -> Member:
        return ensembles[place[0]][place[1]]

    vessel = scene.vessel()
    found = [[np.full((len(members), len(arc), 3), np.nan) for arc in arc_mm] for members in ensembles]
    places = [(i, n) for i, members in enumerate(ensembles) for n in range(len(members))]
    for (number, sigma, shift), group in groupby(sorted(places, key=surface), key=surface):
        own = list(group)
        lumen = displaced(vessel, number, sigma, scene.seed)
        lumen = lumen.shifted(np.full(lumen.distance.shape, shift)) if shift else lumen
        for (i, n), wires in zip(own, _together(scene, lumen, [member(place) for place in own]), strict=True):
            for frame, wire, arc in zip(found[i], wires, arc_mm, strict=True):
                if wire is not None:
                    frame[n] = at_arc(wire, arc)
    return found


def _beyond_radius(wire: Wire, member: Member) -> float:
    """By how much the lumen is narrower, mm, beyond what the wire's radius can stand for: negative or 0.

    A lumen that is wider by more than the radius would take a wire of less than none.
    """
    return min(wire.radius_mm + member.narrower_mm - NARROWEST_MM, 0.0)


def _together(scene: Scene, vessel: VesselWall, members: Sequence[Member]) -> Iterator[list[Array | None]]:
    """For each member the joints (k, 3) of each frame's wire; None for one that did not come to rest."""
    insertions = []
    for one in members:
        # for contact, a lumen that is narrower by some length is the same as a wire with a radius larger by it
        wire = replace(scene.wire, radius_mm=max(scene.wire.radius_mm + one.narrower_mm, NARROWEST_MM))
        own = wire, scene.wall, vessel, one.clamp, scene.solver, one.config, scene.catheter
        insertions.append(insertion_of(*own))
    ways = [scene.way.otherwise(one.depth_mm.tolist(), one.roll_deg.tolist()) for one in members]
    for wires in together(insertions, ways):
        yield [wire.joints_mm if wire.converged and len(wire.joints_mm) > 1 else None for wire in wires]
