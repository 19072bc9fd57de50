"""Is the cross-section of the line round? Two wires side by side are one crest to the eye, midway and as smooth as one.

The second harmonic of grey on a ring about the axis is nothing for a round wire, whatever its blur, and 0.3 of the peak
for two that are 2.7 voxels apart; in contact it is 0.06, twice as bright.
"""

import math

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array
from pipeline.trace.profile import INDEPENDENT_VOXELS
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction

ANGLES = 12
PHI = 2 * np.pi * np.arange(ANGLES) / ANGLES
RING_BLURS = 1.4
"""Radius of the ring in blurs of the line: where two strands differ most from one that is as wide."""
OVER_MM = 3.0
"""Length over which the harmonic is averaged: over less, a crossing stands out."""


PAIRED = 0.03
"""Median harmonic from which a line is two wires in contact all along: two have 0.031 and more (0.3 to 0.5 mm wires in
voxels of 0.3 mm), one has 0.022 and less. Uneven voxels make a round wire oblong by 0.018 at 1.6 to 1."""
MEDIAN = 1.18
"""Median of a complex number's size over the standard deviation of its parts."""
SURE = 2.0
"""Three standard deviations of the median of n independent ones, over that median, times the square root of n."""
TWISTS, SURE_TWISTED = (-0.2, -0.15, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2), 2.7
"""Turns per mm of two wires about each other that are looked for, so near each other that what is averaged over OVER_MM
stays in phase: pitches from 4.5 mm up. Four standard deviations, as the largest of several is taken."""


def carried(tangents: Array) -> tuple[Array, Array]:
    """Two unit normals (n, 3) each, along a curve with these unit tangents (n, 3), that twist as little as possible."""
    x, y, z = np.cross(tangents[0], np.eye(3)[int(np.argmin(np.abs(tangents[0])))]).tolist()
    normals = []
    for a, b, c in tangents.tolist():  # arrays of three numbers take five times as long
        along = x * a + y * b + z * c
        x, y, z = x - along * a, y - along * b, z - along * c
        size = math.sqrt(x * x + y * y + z * z)
        x, y, z = x / size, y / size, z / size
        normals.append((x, y, z))
    first = np.array(normals)
    return first, np.cross(tangents, first)


def _ring(points: Array, radius: float) -> Array:
    """Points (ANGLES, n, 3) on a ring about each point of a curve (n, 3)."""
    t = np.gradient(points, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    u, v = carried(t)
    return points + radius * (np.cos(PHI)[:, None, None] * u + np.sin(PHI)[:, None, None] * v)


def read_around(image: Subtraction, points: Array, sigma: float) -> tuple[Array, Array]:
    """Grey on a ring of RING_BLURS blurs about each point of a curve (n, 3), and on its axis: (ANGLES, n) and (n,)."""
    ring = image.along(_ring(points, RING_BLURS * sigma).reshape(-1, 3))
    return ring.reshape(ANGLES, len(points)), image.along(points)


def second_harmonic(ring: Array) -> NDArray[np.complex128]:
    """Of grey on rings (ANGLES, n), of each: twice the mean over the angles."""
    return np.asarray(2.0 / ANGLES * np.exp(2j * PHI) @ ring)


def out_of_round(image: Subtraction, points: Array, read: tuple[Array, Array]) -> tuple[Array, float]:
    """Second harmonic (n,) of the ring's grey over the grey on the axis, along a curve (n, 3), and its noise where the
    wire has its usual height.

    read : of ``read_around``.
    """
    step = _step(points)
    width = _width(points, step)
    independent = max(1.0, min(OVER_MM, width * step) / (INDEPENDENT_VOXELS * image.voxel))
    usual = float(np.median(np.convolve(read[1], np.ones(width) / width, "same")))
    noise = image.noise_in(CREST_VOXELS) * np.sqrt(4.0 / ANGLES / independent) / max(usual, 1e-9)
    return _oblong(points, read, 0.0), float(noise)


def _step(points: Array) -> float:
    return float(np.mean(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def _width(points: Array, step: float) -> int:
    """Points that are averaged over."""
    return min(len(points), max(1, round(OVER_MM / step)))


def _oblong(points: Array, read: tuple[Array, Array], twist: float) -> Array:
    """The size (n,) of the harmonic's mean over the grey's, for a section that turns by so many turns per mm."""
    ring, grey = read
    step = _step(points)
    width = _width(points, step)
    window = np.ones(width) / width
    axis = np.convolve(grey, window, "same")
    turned = second_harmonic(ring) * np.exp(-4j * np.pi * twist * step * np.arange(len(grey)))
    least = max(0.3 * float(np.median(axis)), 1e-9)
    return np.asarray(np.abs(np.convolve(turned, window, "same")) / np.maximum(axis, least), float)


def paired(image: Subtraction, points: Array, read: tuple[Array, Array], noise: float, length_mm: float) -> float:
    """How far out of round the whole line (n, 3) is, over what one wire's may be: above 1 it is two in contact all
    along, side by side or turned about each other.

    read : of ``read_around``.     noise : of ``out_of_round``, whose median over the line is that of noise alone where
    the wire is round.
    """
    independent = max(1.0, length_mm / OVER_MM)
    uneven = float(np.max(image.spacing) / np.min(image.spacing)) - 1.0
    left = []
    for twist in (0.0, *TWISTS):
        sure = SURE_TWISTED if twist else SURE
        of_noise = MEDIAN * noise * (1.0 + sure / np.sqrt(independent))
        left.append(float(np.median(_oblong(points, read, twist))) ** 2 - of_noise**2)
    return float(np.sqrt(max(0.0, *left))) / (PAIRED * (1.0 + uneven))


def fills_vessel(image: Subtraction, points: Array, sigma: float) -> bool:
    """Whether the line is as thick as the lumen that it runs in: then it is the vessel itself, brighter than it was.

    A disc of radius r adds r^2 / 4 to the blur's variance; a ring of 1.4 r about a wire lies in its lumen somewhere.
    """
    radius = 2.0 * float(np.sqrt(max(0.0, sigma**2 - image.wall_blur_mm**2)))
    if radius < image.voxel:
        return False
    outside = image.depth_at(_ring(points, 1.4 * radius).reshape(-1, 3)).reshape(ANGLES, -1) > 0
    return bool(np.mean(outside.all(axis=0)) > 0.5)
