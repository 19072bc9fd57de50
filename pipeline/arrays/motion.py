"""A rigid motion: how the phantom lies in one scan, as a rotation and a shift against the reference scan."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from pipeline.model import Array, Volume
from solver.grid import read_only


@dataclass(frozen=True, eq=False)
class Motion:
    """The phantom's point at ``p`` in the reference scan lies at ``rotation @ p + shift_mm`` in the frame (LPS mm)."""

    rotation: Array = field(default_factory=lambda: np.eye(3))
    shift_mm: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "rotation", read_only(self.rotation, np.float64))
        object.__setattr__(self, "shift_mm", read_only(self.shift_mm, np.float64))

    @staticmethod
    def about(centre_mm: ArrayLike, rotation_rad: ArrayLike, shift_mm: ArrayLike) -> Motion:
        """A turn by the rotation vector (3,) about a centre, then a shift (3,)."""
        turn = Rotation.from_rotvec(np.asarray(rotation_rad, float)).as_matrix()
        centre = np.asarray(centre_mm, float)
        return Motion(turn, centre + np.asarray(shift_mm, float) - turn @ centre)

    def moved(self, points_mm: ArrayLike) -> Array:
        """Where points (..., 3) of the reference scan lie in the frame."""
        return np.asarray(np.asarray(points_mm, float) @ self.rotation.T + self.shift_mm)

    def then(self, later: Motion) -> Motion:
        """This motion followed by another."""
        return Motion(later.rotation @ self.rotation, later.moved(self.shift_mm))

    def after(self, earlier: Motion) -> Motion:
        """What this motion adds to an earlier one: ``earlier.then(m.after(earlier))`` is ``m``."""
        turn = self.rotation @ earlier.rotation.T
        return Motion(turn, self.shift_mm - turn @ earlier.shift_mm)

    def displacement_mm(self, points_mm: ArrayLike) -> Array:
        """How far (..., 3) each point moves."""
        return np.asarray(self.moved(points_mm) - np.asarray(points_mm, float))

    @property
    def angle_deg(self) -> float:
        """Size of the rotation."""
        return float(np.degrees(Rotation.from_matrix(self.rotation).magnitude()))

    def undone(self, frame: Volume) -> Volume:
        """The frame's voxels where they lie in the phantom as the reference shows it: a new geometry, same values."""
        origin = self.rotation.T @ (frame.origin_mm - self.shift_mm)
        return replace(frame, origin_mm=origin, direction=self.rotation.T @ frame.direction)
