"""The scan around a traced wire, pulled straight along it: what the viewer shows behind errors of a tenth of a mm."""

import numpy as np
from scipy.ndimage import map_coordinates

from pipeline.arrays.polyline import at_arc, carried, tangents
from pipeline.model import Array, Volume, arc_length
from pipeline.run.projections import shades
from reports.frames_file import Straightened

STEP_VOXELS = 0.75  # of the smallest side of a voxel: finer shows nothing more
ACROSS = 25  # samples, 9 voxels to either side: the vessel around the wire
MOST_PLANES = 300  # 190 kB a frame, as much as its projections
_AHEAD_MM = 0.5  # tangents run from this far behind to this far ahead: noise of the trace would tilt the planes


def straightened(volume: Volume, curve_mm: Array, window: tuple[float, float]) -> Straightened:
    """The scan on planes across a curve (n, 3), LPS mm; 8 bit within the grey-value ``window``.

    Axes: along the curve, then two directions across it, which follow it without twist.
    """
    length = float(arc_length(curve_mm)[-1])
    across = STEP_VOXELS * volume.voxel_mm
    along = max(across, length / MOST_PLANES)
    arc = np.arange(0.0, length, along)
    heading = tangents(curve_mm, arc, _AHEAD_MM)
    first = carried(heading, np.eye(3)[np.argmin(np.abs(heading[0]))])
    second = np.cross(heading, first)
    offsets = across * (np.arange(ACROSS) - ACROSS // 2)
    # every plane's points: (planes, samples along the first direction, along the second, 3)
    planes = offsets[:, None, None] * first[:, None, None] + offsets[:, None] * second[:, None, None]
    index = volume.to_index(at_arc(curve_mm, arc)[:, None, None] + planes)
    values = map_coordinates(volume.values, np.moveaxis(index, -1, 0), np.float32, order=1, cval=window[0])
    return Straightened(shades(values, window), along, across, first[0])
