"""What a relaxation computed and what it proved unnecessary, by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from solver._kernels.data import (
    CHEAP,
    CLEAR,
    FORESEEN,
    FULL,
    IDLE,
    LEVENBERG,
    RESTED,
    ROLLOUTS,
    ROLLS,
    SMOOTH,
    STILL,
    STRAIGHT,
    SWEEPS,
    TABLED,
    TWISTLESS,
)

NAMES = {
    "wall_look_ups": FULL,
    "wall_look_ups_cheap": CHEAP,
    "wall_look_ups_proven_unnecessary": CLEAR,
    "sweeps": SWEEPS,
    "rollouts": ROLLOUTS,
    "levenberg": LEVENBERG,
    "rest_shapes": IDLE,
    "rolls_proven_idle": ROLLS,
    "sweeps_without_roll": STRAIGHT,
    "starts_foreseen": FORESEEN,
    "joints_left_still": STILL,
    "starts_at_rest": RESTED,
    "relaxations_without_friction": SMOOTH,
    "relaxations_without_twist": TWISTLESS,
    "joints_without_profile_look_up": TABLED,
}


def work_of(counts: Sequence[int], start_energy: float) -> Mapping[str, float]:
    """Counters by name, and the energy in N mm that the last relaxation began with."""
    work = {name: float(counts[place]) for name, place in NAMES.items()}
    looked = counts[FULL] + counts[CHEAP] + counts[CLEAR]
    work["wall_look_ups_done_fraction"] = counts[FULL] / looked if looked else 0.0
    work["start_energy_N_mm"] = start_energy
    return work
