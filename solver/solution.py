"""What a relaxation returns: how it ended, every status with the sentence that the user reads, and the wire."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple, Self

import numpy as np

from solver import _tolerances as tol
from solver._kernels.records import PLACE, WORK
from solver.grid import Array, frozen
from solver.self_contact import self_overlap_mm


class Status(Enum):
    """Outcome of one depth; the name is its identifier, the value its sentence."""

    CONVERGED = "the wire is at rest: a minimum of the energy within solver.tolerance"
    MAX_ITERATIONS = (
        "stopped at the iteration limit; raise solver.max_iterations, loosen solver.tolerance or, with friction, take "
        "solver.step_mm = 0.02"
    )
    STALLED = (
        "the energy can no longer be lowered but the wire is not at rest within solver.tolerance; "
        "loosen solver.tolerance, or lower the ratio of wall to bending stiffness"
    )
    FRICTION = "the friction forces did not settle; lower wall.friction, or take solver.step_mm = 0.05 or 0.02"
    FOLDED = "the wire folded at a joint (turned by more than 90 degrees); use shorter segments or smaller steps"
    LEFT_GRID = "the wire left the wall's grid; give a larger grid, or check entry point and direction"
    THROUGH_WALL = (
        "the wire would come through the wall into another vessel; check entry and lumen (vessels that touch, a piece "
        "that is missing), raise the wall's stiffness or shorten solver.segment_mm"
    )
    ENTRY_OUTSIDE = "the entry point lies outside the lumen; check entry_mm and the registration of the wall"
    ENTRY_IN_SEPTUM = (
        "the entry point lies in a wall with lumen on both sides: which vessel is not known; move entry_mm into it"
    )
    TOO_LONG = "the depth needs more joints than allowed; use longer segments or raise max_joints"
    NON_FINITE = "the energy became infinite or undefined; check stiffnesses and loads"

    @property
    def identifier(self) -> str:
        """The short name used in tables."""
        return self.name.lower()


class Snap(NamedTuple):
    """The wire gave way between two depths, mm, and jumped to another shape.

    moved_mm : largest displacement of a joint.
    other_mm : distance, mm, to a second shape at rest on the other side whose energy is the same to 0.1 %; 0 where none
    was found. Which of the two the wire took is arbitrary, and what follows holds for that side alone until both meet
    again.
    """

    from_mm: float
    to_mm: float
    released_N_mm: float
    moved_mm: float
    other_mm: float = 0.0


_NAMES = PLACE.names or ()
_OF_PLACE = itemgetter(
    *map(_NAMES.index, ("energy", "dissipated", "since_doubt", "rubbed", "stored", "passed", "snaps"))
)


@dataclass(frozen=True, eq=False)
class Solution:
    """A wire at one depth. It is at rest if ``converged``; else it is the last good state, and ``sentence`` says why.

    joints_mm : (k + 1, 3) LPS from the entry to the tip, read-only.
    frames : (k + 1, 3, 3); the columns are material axes 1 and 2 and the direction of the segment before the joint.
    energy_N_mm : the total, including loads and weight, with heights and loads counted from the entry.
    bending_energy_N_mm, wall_energy_N_mm : parts of it.
    friction_energy_N_mm : lost to friction since the depth before, over all steps; not a part of energy_N_mm.
    contact_force_N : (k + 1, 3), the force of the wall on the wire at each joint.
    reaction_force_N : (3,), the force of the introducer on the wire.     reaction_torque_N_mm : its torque about the
    axis.
    push_force_N : the axial force of the hand, dU/d(depth). In lumens with less room for the wire than about a voxel it
    is wrong, even of the wrong sign, with segments whose shapes are right; compare it with that of segments of
    0.0625 mm.
    max_penetration_mm : deepest overlap of the wire's hull with the wall, of the places in which its forces are summed.
    Above the wire's radius its axis lies in the wall: the distance, its unit or the wall's stiffness is wrong, and
    push_force_N is none of a vessel.
    counts : in the order of ``_kernels.records.COUNTERS``; ``work`` has them by name.
    start_energy_N_mm : the total energy at the start of the last relaxation.
    least_pivot : how far the wire is from giving way, the least value over all joints. A joint's value is the stiffness
    that is left when all joints beyond it are free to follow, over its own stiffness. It is 1 for a free wire and 0
    where the wire snaps; below 0.5 the wire is soft; below 0.05 it nearly gives way, or is free to turn about the axis
    of a round vessel; above 1 a wall holds it. With a finite torsional stiffness the twist of shaft and wire counts as
    one more joint, of value 1/(1 - C dT/d(roll)) with its compliance C and the torque T of the hand: 0.5 where the tip
    turns twice as far as the hand, 0 where it whips. NaN where ``relax`` ends in a state that is not at rest.
    dissipated_N_mm : the work of the hand since the depth before, minus the change of energy; friction_energy_N_mm is a
    part of it. The work is integrated by the trapezium rule over each step, so where the push force jumps (a jump of
    rest curvature or stiffness passes the entry) it is off by half the jump times the step and may be negative. So it
    is where a catheter alone moves in a bend: by 3e-3 N mm in steps of 1 mm, by 2e-4 in steps of 0.1 mm. In ``relax``
    no hand works and it is 0: friction_energy_N_mm is what friction took on the way from the start shape.
    snaps : the snaps since the depth before. A wound shaft that unwinds in one push may be among them.
    uncertain : shorter steps may lead elsewhere. Here, or a few mm before (longer while the wire stays soft), it
    snapped, was about to snap, took one of two equally good sides, or went elsewhere in long steps than in short ones.
    A whip while rolling to which long and short steps lead alike is in snaps alone.
    radius_mm : the radius of the wire.
    passed_itself_mm : the least depth at which a strand of the wire passed through another one, which no energy
    forbids; inf where none did. It stays until the wire is pulled back so far that the hind one of the strands has left
    the lumen: until then the wire may lie as no real one could, free of itself as it is.
    """

    joints_mm: Array
    frames: Array
    energy_N_mm: float
    bending_energy_N_mm: float
    wall_energy_N_mm: float
    friction_energy_N_mm: float
    status: Status
    iterations: int
    contact_force_N: Array
    reaction_force_N: Array
    reaction_torque_N_mm: float
    push_force_N: float
    max_penetration_mm: float
    depth_mm: float
    roll_deg: float
    counts: tuple[int, ...]
    start_energy_N_mm: float
    least_pivot: float = 1.0
    dissipated_N_mm: float = 0.0
    snaps: tuple[Snap, ...] = ()
    uncertain: bool = False
    radius_mm: float = 0.0
    passed_itself_mm: float = math.inf

    @classmethod
    def assembled(
        cls, arrays: list[Array], notes: tuple[Any, ...], snaps: Any, ended: tuple[Status, int, float, float, float]
    ) -> Self:
        """A solution from joints, frames and forces, and what the kernels noted.

        notes : ``records.PLACE``, ``REPORT``, ``ENERGIES`` and ``COUNTERS``.     snaps : (n,) of ``records.SNAP``; the
        first ``PLACE.snaps`` are valid.     ended : status, iterations, depth, mm, roll, degrees, wire's radius, mm.
        """
        place, (start, penetration, push, force, torque, *_, pivot), (bending, wall, *_), counts = notes
        energy, dissipated, since_doubt, rubbed, stored, passed, snapped = _OF_PLACE(place)
        for array in (*arrays, reaction := np.array(force)):
            array.setflags(write=False)
        solution = object.__new__(cls)
        # a frozen dataclass sets its fields one by one, which takes 2 µs of the 40 that a step may take
        vars(solution).update(
            joints_mm=arrays[0],
            frames=arrays[1],
            energy_N_mm=energy,
            bending_energy_N_mm=bending + stored,
            wall_energy_N_mm=wall,
            friction_energy_N_mm=rubbed,
            status=ended[0],
            iterations=ended[1],
            contact_force_N=arrays[2],
            reaction_force_N=reaction,
            reaction_torque_N_mm=float(torque[2]),
            push_force_N=push,
            max_penetration_mm=penetration,
            depth_mm=ended[2],
            roll_deg=ended[3],
            counts=counts,
            start_energy_N_mm=start + stored,
            least_pivot=pivot,
            dissipated_N_mm=dissipated,
            snaps=tuple(Snap(*snaps.item(n)) for n in range(snapped)) if snapped else (),
            uncertain=since_doubt < tol.DOUBT_LASTS_MM,
            radius_mm=ended[4],
            passed_itself_mm=passed,
        )
        return solution

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Freeze what was unpickled."""
        vars(self).update(frozen(state))

    @property
    def work(self) -> Mapping[str, float]:
        """Counters of what was computed and what was proven unnecessary, by name."""
        work = {name: float(count) for name, count in zip(WORK, self.counts, strict=False)}
        looked = sum(count for name, count in work.items() if name.startswith("wall_look_ups"))
        work["wall_look_ups_done_fraction"] = work["wall_look_ups"] / looked if looked else 0.0
        work["start_energy_N_mm"] = self.start_energy_N_mm
        return work

    @property
    def largest_turn_deg(self) -> float:
        """Largest angle between two segments that meet, the introducer being the first; 0 for no wire.

        Beyond 30 degrees a chain is no smooth wire: its bending energy is off by 2 % and more.
        """
        along = self.frames[:, :, 2]
        sine = np.linalg.norm(np.cross(along[:-1], along[1:]), axis=1)
        turns = np.degrees(np.arctan2(sine, np.sum(along[:-1] * along[1:], axis=1)))
        return float(turns.max(initial=0.0))

    @cached_property
    def self_overlap_mm(self) -> float:
        """How deep the wire overlaps itself, mm: the energy has no self-contact. Computed when it is first read."""
        return self_overlap_mm(self.joints_mm, self.radius_mm)

    def __repr__(self) -> str:
        """Status, depth, tip and push."""
        name, tip = self.status.identifier, ", ".join(f"{x:.2f}" for x in self.joints_mm[-1])
        doubt = ", uncertain" if self.uncertain else ""
        return f"Solution({name} at {self.depth_mm:g} mm{doubt}, tip [{tip}] mm, push {self.push_force_N:.3g} N)"

    @property
    def converged(self) -> bool:
        """The wire is at rest."""
        return self.status is Status.CONVERGED

    @property
    def sentence(self) -> str:
        """The status in words."""
        return self.status.value
