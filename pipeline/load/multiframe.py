"""Where every frame of an enhanced multi-frame DICOM file lies (CT, MR, XA and others since DICOM supplement 49).

GDCM takes spacing and direction from the first frames alone: with a frame missing it says 1 mm, it hides a tilt, and
turns a stack written downwards into one with the wrong direction. So the functional groups are read here.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

KEYWORDS = ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing")


@dataclass(frozen=True, eq=False)
class Frames:
    """positions (n, 3) mm and orientation (n, 6) of the frames in the file's order, pixel_mm (n, 2): row, column."""

    positions: NDArray[np.float64]
    orientations: NDArray[np.float64]
    pixels_mm: NDArray[np.float64]


def frames_of(path: Path) -> Frames | None:
    """Where the frames lie, or None for a file that is no enhanced multi-frame DICOM."""
    with path.open("rb") as file:
        if file.read(132)[128:] != b"DICM":
            return None
    from pydicom import dcmread  # a third of a second, for those who have DICOM

    try:
        data = dcmread(path, stop_before_pixels=True)
        groups = data.PerFrameFunctionalGroupsSequence
        common = data.get("SharedFunctionalGroupsSequence", ())
        found = [[_first(name, group, *common) for group in groups] for name in KEYWORDS]
        places, axes, pixels = (np.array(values, float) for values in found)
    except (AttributeError, KeyError, ValueError, TypeError, EOFError, struct.error):
        return None
    good = places.shape[1:] == (3,) and axes.shape[1:] == (6,) and pixels.shape[1:] == (2,)
    return Frames(places, axes, pixels) if good else None


def _first(keyword: str, *groups: Any) -> Any:
    """The value of an element in the first group that has it, however deep; raises KeyError where none has."""
    for group in groups:
        for element in group.iterall():
            if element.keyword == keyword:
                return element.value
    raise KeyError(keyword)
