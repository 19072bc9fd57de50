"""Is the cross-section of the line round? Two wires side by side are one crest to the eye, midway and as smooth as one.

The second harmonic of grey on a ring about the axis is nothing for a round wire, whatever its blur, and 0.3 of the peak
for two that are 2.7 voxels apart; in contact it is 0.06, twice as bright.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import across, carried, crossed
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
MEDIAN = 0.83
"""Median of a complex number's size over its root mean square, where both parts are noise."""
SURE = 2.0
"""Three standard deviations of the median of n independent ones, over that median, times the square root of n."""
STRETCH_MM, STRETCHED, SURE_STRETCH = 10.0, 0.024, 3.0
"""Length over which alone two wires may lie so that they are seen as two, the mean harmonic there from which they are,
and standard deviations of that mean: bends turn the offset of a copy moved aside into the wires' own direction, and the
rest of the line is as round as one. Right lines have up to 0.015 beyond noise where the background was measured; where
it is modelled 0.032, and stretches are not asked."""
TURNS, TURNING, SURE_TURNING = np.arange(0.22, 0.43, 0.02), 0.012, 4.0
"""Turns per mm, either way round, of two wires that are twisted about each other so closely that OVER_MM averages them
away (pitches of 2.4 to 4.5 mm), the least mean harmonic over STRETCH_MM, turned back, of such a pair, and its standard
deviations. Blur leaves 0.03 of 0.4 mm wires in contact with a pitch of 4 mm and 0.02 with one of 3, 6 standard
deviations and more; right lines had up to 2.7, and 0.008 where noise allows less than 0.005."""
MOST_OF_SCANNER = 0.045
"""The most that a scanner's own blur, sharper along one of its axes than along another, makes of that: a ratio of 1.2
makes 0.04 where the wire lies across. Two wires 0.5 mm apart have up to 0.07."""
TWISTS, SURE_TWISTED = (-0.2, -0.15, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2), 2.7
"""Turns per mm of two wires about each other that are looked for, so near each other that what is averaged over OVER_MM
stays in phase: pitches from 4.5 mm up. Four standard deviations, as the largest of several is taken."""


def _normals(tangents: Array) -> tuple[Array, Array]:
    """Two unit normals (n, 3) each, along a curve with these unit tangents (n, 3), that twist as little as possible."""
    first = carried(tangents, across(tangents[0])[0])
    return first, crossed(tangents, first)


def _directions(points: Array) -> Array:
    """Unit tangents (n, 3) of a curve (n, 3)."""
    t = np.gradient(points, axis=0)
    return np.asarray(t / np.linalg.norm(t, axis=1)[:, None])


def _ring(points: Array, radius: float) -> Array:
    """Points (ANGLES, n, 3) on a ring about each point of a curve (n, 3)."""
    u, v = _normals(_directions(points))
    return points + radius * (np.cos(PHI)[:, None, None] * u + np.sin(PHI)[:, None, None] * v)


def places_around(points: Array, sigma: float) -> Array:
    """Places (ANGLES + 1, n, 3) on a ring of RING_BLURS blurs about each point of a curve (n, 3), and the points."""
    return np.concatenate([_ring(points, RING_BLURS * sigma), points[None]])


def read_around(image: Subtraction, places: Array) -> tuple[Array, Array]:
    """Grey at ``places_around`` a curve of n points: on the rings (ANGLES, n), and on the axis (n,)."""
    grey = image.along(places.reshape(-1, 3)).reshape(len(places), -1)
    return grey[:-1], grey[-1]


def second_harmonic(ring: Array) -> NDArray[np.complex128]:
    """Of grey on rings (ANGLES, n), of each: twice the mean over the angles."""
    return np.asarray(2.0 / ANGLES * np.exp(2j * PHI) @ ring)


@dataclass(frozen=True, eq=False)
class Section:
    """What the cross-section looks like along a curve of n points.

    harmonic : second, of the ring's grey (n,).     grey : on the axis, averaged over OVER_MM (n,).
    step_mm : between points.     window : weights of that average.     noise : root mean square that it makes of
    ``oblong``, where the wire has its usual height.
    """

    harmonic: NDArray[np.complex128]
    grey: Array
    step_mm: float
    window: Array
    noise: float

    def without(self, harmonic: NDArray[np.complex128]) -> "Section":
        """The section less a harmonic (n,) over the grey on the axis that has nothing to do with the wire's shape."""
        return replace(self, harmonic=self.harmonic - harmonic * self.grey)

    @cached_property
    def oblong(self) -> Array:
        """How far out of round it is (n,): the size of the harmonic's mean over the grey's."""
        return self.turned(0.0)

    def turned(self, twist: float) -> Array:
        """The same of a section that turns by so many turns per mm."""
        back = np.exp(-4j * np.pi * twist * self.step_mm * np.arange(len(self.grey)))
        mean = np.convolve(self.harmonic * back, self.window, "same")
        return np.asarray(np.abs(mean) / self._height, float)

    @cached_property
    def _height(self) -> Array:
        return np.maximum(self.grey, max(0.3 * float(np.median(self.grey)), 1e-9))


def section_along(image: Subtraction, points: Array, read: tuple[Array, Array]) -> Section:
    """The section along a curve (n, 3). read : of ``read_around``."""
    ring, grey = read
    step = float(np.mean(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    width = min(len(points), max(1, round(OVER_MM / step)))
    window = np.ones(width) / width
    axis = np.convolve(grey, window, "same")
    independent = max(1.0, min(OVER_MM, width * step) / (INDEPENDENT_VOXELS * image.voxel))
    usual = max(float(np.median(axis)), 1e-9)
    noise = float(image.noise_in(CREST_VOXELS) * np.sqrt(4.0 / ANGLES / independent) / usual)
    return Section(second_harmonic(ring), axis, step, window, noise)


def paired(image: Subtraction, section: Section, length_mm: float) -> float:
    """How far out of round the whole line is, over what one wire's may be: above 1 it is two in contact all along, side
    by side or turned about each other.

    Where the wire is round, the median over the line is that of noise alone.
    """
    independent = max(1.0, length_mm / OVER_MM)
    tried = [(section.oblong, SURE), *((section.turned(twist), SURE_TWISTED) for twist in TWISTS)]
    of_noise = MEDIAN * section.noise
    left = [float(np.median(o)) ** 2 - (of_noise * (1.0 + sure / np.sqrt(independent))) ** 2 for o, sure in tried]
    return float(np.sqrt(max(0.0, *left))) / (PAIRED * (1.0 + _unevenness(image)))


def paired_in_part(image: Subtraction, section: Section, fitted: NDArray[np.complex128], points: Array) -> float:
    """The same over STRETCH_MM alone, where that says most, side by side or closely twisted.

    fitted : harmonic (n,) of the fitted tube, which is not round on the rings of a sharp bend.     points : (n, 3).
    """
    width = round(STRETCH_MM / section.step_mm)
    if width > len(section.grey):
        return 0.0
    window, usual = np.ones(width) / width, max(float(np.median(section.grey)), 1e-9)
    grey = np.maximum(np.convolve(section.grey, window, "valid"), usual)  # that of a coil is its own
    of_noise = section.noise * np.sqrt(OVER_MM / STRETCH_MM) * usual / grey
    rest = section.harmonic - fitted
    rest = rest - _of_the_scanner(rest, section.grey, points)

    def mean(harmonic: NDArray[np.complex128]) -> Array:
        return np.asarray(np.abs(np.convolve(harmonic, window, "valid")) / grey)

    arc = section.step_mm * np.arange(len(rest))
    turning = np.max([mean(rest * np.exp(-4j * np.pi * turns * arc)) for turns in (*TURNS, *-TURNS)], axis=0)
    twisted = float((turning / np.maximum(TURNING, SURE_TURNING * of_noise)).max())
    if image.modelled:  # beside a wall that no reference shows a line is out of round, always the same way
        return twisted
    beyond = np.sqrt(np.maximum(0.0, mean(rest) ** 2 - (SURE_STRETCH * of_noise) ** 2))
    return max(twisted, float(beyond.max()) / (STRETCHED * (1.0 + _unevenness(image))))


def as_sharp(image: Subtraction, points: Array, sigma: float, blur: Array) -> NDArray[np.complex128]:
    """The harmonic (n,) over the grey on the axis of a round wire, points (n, 3), seen by a scanner of uneven blur.

    blur : of ``blur_by_axis``.  One whose square is larger by D across the wire makes exp(-x^2 / 2 s^2) larger by
    x^2 D / 2 s^4.
    """
    u, v = _normals(_directions(points))
    seen, radius = sigma**2 + (CREST_VOXELS * image.voxel) ** 2, RING_BLURS * sigma
    usual = np.exp(-0.5 * radius**2 / seen) * radius**2 / (4.0 * seen**2)
    return np.asarray(usual * (u + 1j * v) ** 2 @ blur)


def _of_the_scanner(harmonic: NDArray[np.complex128], grey: Array, points: Array) -> NDArray[np.complex128]:
    """The part of a harmonic (n,) that a blur which differs along the scan's axes explains best, by least squares.

    Scanners are as sharp along their axis as across it to 10 or 20 %, which makes every round wire as oblong as two.
    """
    u, v = _normals(_directions(points))
    shapes = (u + 1j * v).T ** 2 * grey
    design = np.concatenate([shapes.real, shapes.imag], axis=1).T
    blur = np.linalg.lstsq(design, np.concatenate([harmonic.real, harmonic.imag]), rcond=None)[0]
    return np.asarray(min(1.0, MOST_OF_SCANNER / max(float(np.ptp(blur)), 1e-12)) * blur @ shapes)


def _unevenness(image: Subtraction) -> float:
    return float(np.max(image.spacing) / np.min(image.spacing)) - 1.0


def fills_vessel(image: Subtraction, points: Array, sigma: float) -> bool:
    """Whether the line is as thick as the lumen that it runs in: then it is the vessel itself, brighter than it was.

    A disc of radius r adds r^2 / 4 to the blur's variance; a ring of 1.4 r about a wire lies in its lumen somewhere.
    """
    radius = 2.0 * float(np.sqrt(max(0.0, sigma**2 - image.wall_blur_mm**2)))
    if radius < image.voxel:
        return False
    outside = image.depth_at(_ring(points, 1.4 * radius).reshape(-1, 3)).reshape(ANGLES, -1) > 0
    return bool(np.mean(outside.all(axis=0)) > 0.5)
