"""Where does a guide wire lie? Given a wire, a wall and a push: the minimum of their energy, and the forces there.

    wire = GuideWire(segment_mm=1.0, radius_mm=0.18, bending_stiffness_N_mm2=10.0)
    wall = VesselWall(Grid(signed_distance, spacing_mm, origin_mm), stiffness_N_mm2=2.0)
    for solution in Insertion(wire, wall, entry_mm, entry_direction).to_depths([10.0, 20.0]):
        solution.joints_mm, solution.status, solution.contact_force_N

The paper is Alderliesten, Konings & Niessen, MICCAI 2002; equation numbers are its numbers. Units: mm, N, rad.

| seed            | here                                                                | unit       | equation      |
|-----------------|---------------------------------------------------------------------|------------|---------------|
| x_i             | Solution.joints_mm[i], State.x                                      | mm         | section 2.1   |
| λ               | GuideWire.segment_mm; Chain.length (the first one takes the rest)   | mm         | section 2.1   |
| θ_i             | State.u[i, :2], a rotation vector in the material frame             | rad        | 1             |
| c_i             | Chain.bend = 1/∫ ds/EI over the joint's cell (half a cell at i = 0) | N mm/rad   | 1, 2          |
| ω_i             | Chain.rest = ∫ κ ds over the joint's cell, about material axis 2    | rad        | 4             |
| κ_torsion       | GuideWire.torsional_stiffness_N_mm2; Chain.twist, State.u[i, 2]     | N mm²; N mm/rad | 5        |
| k, d            | VesselWall.stiffness_N_mm2 (per mm of wire); State.penetration      | N/mm²; mm  | 6             |
| U_Tvw           | Solution.wall_energy_N_mm                                           | N mm       | 7             |
| U_Tb            | Solution.bending_energy_N_mm                                        | N mm       | 2             |
| hull points     | VesselWall.hull: "samples:N", or the deepest one alone, "offset"    | -          | section 2.1   |
| ξ_i, α_i        | the trial state of ``closed_form.propose``                          | mm         | 8, 9          |
| a_i, ψ_i        | ``closed_form.gradients`` (numerator, denominator)                  | rad        | 10, corrected |
| P, Q, S axes    | Solution.frames: columns are material axes 1, 2 and the direction   | -          | 11            |
| ξ_0             | Insertion.to_depths, initial = "translate" or "slide"               | mm         | section 4.1   |
| forced rotation | Insertion.to_depths(roll_deg=...)                                   | deg        | section 4.2   |
| force feedback  | Solution.push_force_N, reaction_force_N, reaction_torque_N_mm       | N; N mm    | its outlook   |

What differs from the seed, and why, is said where it happens, in ``_kernels``: ``chain`` (cells), ``newton`` (the
fast minimiser), ``closed_form`` (eq. 10), ``crossing`` (no tunnelling).
"""

from solver.catheter import Catheter
from solver.grid import Grid
from solver.insertion import Insertion
from solver.insertions import Insertions
from solver.relax import relax
from solver.solution import Snap, Solution, Status
from solver.wall import VesselWall
from solver.warm import warm_up
from solver.wire import GuideWire

__all__ = [
    "Catheter",
    "Grid",
    "GuideWire",
    "Insertion",
    "Insertions",
    "Snap",
    "Solution",
    "Status",
    "VesselWall",
    "relax",
    "warm_up",
]
