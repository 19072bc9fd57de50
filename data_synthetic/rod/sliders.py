"""Springs by which friction holds the nodes of a rod to points of the wall, and which slip at a limit."""

from dataclasses import dataclass

import numpy as np

from data_synthetic.geometry import Array

ELASTIC_SLIP_MM = 2e-3
"""A slider gives by this much before it slips: a fifth of the truth's own accuracy of 0.01 mm."""


@dataclass(frozen=True, eq=False)
class Sliders:
    """limit (n + 1,) = mu N in newton, normal (n + 1, 3), anchor (n + 1, 3): what a node at x is held by."""

    limit: Array
    normal: Array
    anchor: Array

    @staticmethod
    def under(coefficient: float, contact_N: Array, anchor: Array) -> "Sliders":
        """The sliders under given forces (n + 1, 3) of the wall."""
        load = np.linalg.norm(contact_N, axis=1)
        return Sliders(coefficient * load, contact_N / np.maximum(load, 1e-300)[:, None], anchor)

    def stretch(self, points: Array) -> Array:
        """Tangential vectors (n + 1, 3) from anchors to nodes."""
        away = points - self.anchor
        return np.asarray(away - np.sum(away * self.normal, axis=1)[:, None] * self.normal)

    def energy(self, points: Array) -> float:
        """Quadratic up to the elastic slip, linear beyond; N mm."""
        size = np.linalg.norm(self.stretch(points), axis=1)
        held = np.where(size < ELASTIC_SLIP_MM, 0.5 * size**2 / ELASTIC_SLIP_MM, size - 0.5 * ELASTIC_SLIP_MM)
        return float(self.limit @ held)

    def add(self, points: Array, gradient: Array, bands: Array) -> None:
        """Add gradient and Hessian of ``energy``; node 0 is clamped."""
        stretch = self.stretch(points)
        size = np.linalg.norm(stretch, axis=1)
        slides = size > ELASTIC_SLIP_MM
        stiffness = self.limit / np.maximum(size, ELASTIC_SLIP_MM)
        gradient.reshape(-1, 4)[:, 1:] += (stiffness[:, None] * stretch)[1:]
        along = np.where(slides[:, None], stretch / np.maximum(size, ELASTIC_SLIP_MM)[:, None], 0.0)
        block = np.eye(3) - self.normal[:, :, None] * self.normal[:, None, :] - along[:, :, None] * along[:, None, :]
        block *= stiffness[:, None, None]
        node = 4 * np.arange(len(points) - 1)
        for a in range(3):
            for b in range(a + 1):
                bands[a - b, node + 1 + b] += block[1:, a, b]
