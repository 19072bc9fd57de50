"""How far apart the knots of a fitted curve are, and the tube with which its fit starts."""

import numpy as np

from pipeline.model import Array, arc_length
from pipeline.trace.link import resampled
from pipeline.trace.steps import EVEN, Steps
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube, spline_through, tint_nodes

CLOSEST = 8.0
"""Least distance between knots, voxels, of all but hooks: closer ones only follow the noise."""
IN_HOOKS = 4.5
"""The same of wires with a hook (``bends.HOOK``): half a circle of 2.7 voxels lies between two wide knots, and its tip
was 0.55 voxel off."""
KNOTS_PER_PITCH = 2.0
"""Least distance between knots, in :func:`slice_pitch`: with one knot a slice the curve follows each slice's own error
(0.15 mm of ripple at 2.5 mm slices)."""
FIRST_BLUR = 0.9
"""The wire's blur (voxel) before it is fitted: scanner 0.8, wire and voxel the rest."""


def slice_pitch(image: Subtraction, line: Array) -> float:
    """Length of wire (mm) from one slice to the next along a path (n, 3), where slices are thicker than pixels; else 0.

    Such slices are wider apart than the blur can join: between two of them the grey hardly says how high the wire is.
    """
    if not image.thick_slices:
        return 0.0
    axis = int(np.argmax(image.spacing))
    slices = float(np.sum(np.abs(np.diff(line[:, axis])))) / float(image.spacing[axis])
    return float(arc_length(line)[-1]) / max(slices, 1.0)


def first_tube(image: Subtraction, points: Array, steps: Steps = EVEN, knots: float | None = None) -> Tube:
    """Where the fit starts: a spline along the path, with the amplitude seen there.

    knots : how far apart knots are, whatever the noise.  Noise falls with their distance, a bend's bias
    rises (0.004 / 0.009 / 0.046 voxel at 8 / 10 / 14 voxels for radii of 20 to 40).
    """
    h = image.voxel
    line = resampled(points, 0.5 * h)
    gain = 1.0 + (CREST_VOXELS / FIRST_BLUR) ** 2
    amplitude = max(float(np.median(image.along(line[::4]))) * gain, image.noise)
    knot = knots or float(np.interp(amplitude / image.noise, [4.0, 8.0, 16.0], [12.0, 10.0, CLOSEST]))
    controls = spline_through(line, max(knot * h, KNOTS_PER_PITCH * slice_pitch(image, line)))
    return Tube(controls, np.full(tint_nodes(len(controls) - 3), amplitude), FIRST_BLUR * h, 0.0, steps=steps)
