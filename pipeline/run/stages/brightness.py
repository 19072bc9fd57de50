"""Frames whose traced line is far brighter, or fainter, than the other frames': another wire, or a second one in it.

The grey of a wire, summed across it, is its material and its cross-section: no blur and no place changes it, and
at one distance from the tip it is the same in every frame of one wire. A scan's scale and thinner contrast medium do
change it, and both show in the grey of the vessel itself.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, Curve, arc_length
from pipeline.run.stages.known import Frame
from reports.case_files import listed

FACTOR = 1.8
"""Times by which a line may be as bright as those of the other frames, or they as it. Frames of one wire had 0.93 to
1.07 in 33 sequences, with a reference and without (scales that drift, medium that changes, phantoms that move, water,
air), one 1.23; right traces in the scenes of ``tests.studies.seeing`` have 0.92 to 1.31 times what they should. Wires
of 0.18 and 0.25 mm differ by 1.9."""
STEP_MM, FEWEST = 0.5, 8
"""Between the places that are compared, by their distance from the tip, and how many of a frame there must be."""
OF_ALL = 3
"""Frames that must show a place for one of them to be the odd one; two frames show that they differ, not which."""
LEAST_LEFT = 0.01
"""Share of its brightness that a wire keeps at the least where thicker medium is expected to hide it."""
MOST_NAMED = 3


def of_another_brightness(frames: Sequence[Frame], radius_mm: float) -> list[str]:
    """A warning where the wire of frames is not as bright as that of the others; empty where nobody knows.

    radius_mm : of the wire that the manifest states.
    """
    shown = {f: curve for f in frames if (curve := f.trusted_curve) is not None and len(curve.brightness)}
    if len(shown) < 2:
        return []
    seen = [_from_tip(curve, frame.catheter_mm) for frame, curve in shown.items()]
    factors = _factors(seen, np.array([curve.contrast for curve in shown.values()]), np.pi * radius_mm**2)
    odd = [f"frame {f.index} {x:.2g} times" for f, x in zip(shown, factors, strict=True) if not _alike(x)]
    if not odd:
        return []
    told = listed(odd, MOST_NAMED)
    return [
        "the traced wire is not as bright per mm in every frame, at equal distances from its tip: in "
        f"{told} as bright as in {'most' if len(seen) > 2 else 'the other'} (allowed {FACTOR:g} times, either "
        "way; the grey of the vessel explains no such factor): another wire, a second device along it, or a catheter "
        "that nobody stated; look at the scans, take the frame out or give it a case of its own"
    ]


def _from_tip(curve: Curve, catheter_mm: float) -> Array:
    """Brightness (m,) of a curve every STEP_MM from its tip back, as far as no catheter lies over it."""
    arc = arc_length(curve.points_mm)
    away = np.arange(STEP_MM, arc[-1] - max(catheter_mm, 0.0), STEP_MM)
    shown = np.interp(arc[-1] - away, arc, curve.brightness)
    flagged = np.interp(arc[-1] - away, arc, np.asarray(curve.flagged, float)) > 0.0
    return np.where(flagged | ~(shown > 0.0), np.nan, shown)


def _alike(factor: float) -> bool:
    """Whether a factor is one that scans of one wire may have; so is NaN, of which nothing is known."""
    return bool(np.isnan(factor) or 1.0 / FACTOR < factor < FACTOR)


def _factors(seen: Sequence[Array], contrast: Array, section_mm2: float) -> Array:
    """By frame, how many times as bright as in most the wire is, beyond what the vessel's grey explains; NaN
    where that is not known.

    contrast : (k,) of the vessel, frame by frame.  section_mm2 : of the wire.
    """
    bright = np.full((len(seen), max(map(len, seen))), np.nan)
    for row, values in zip(bright, seen, strict=True):
        row[: len(values)] = values
    bright = bright[:, np.isfinite(bright).sum(axis=0) >= min(OF_ALL, len(seen))]
    out = np.full(len(seen), np.nan)
    for n in np.flatnonzero(np.isfinite(bright).sum(axis=1) >= FEWEST):
        # of two, the other; of three, all: the median of a right one's others lies midway between right and odd
        those = np.arange(len(seen)) != n if len(seen) < OF_ALL else np.full(len(seen), True)
        at = np.isfinite(bright[n])
        usual, medium = np.nanmedian(bright[those][:, at], axis=0), float(np.nanmedian(contrast[those]))
        out[n] = _unexplained(bright[n, at], _expected(usual, contrast[n], medium, section_mm2))
    return out


def _expected(usual: Array, contrast: float, medium: float, section_mm2: float) -> NDArray[np.float64]:
    """Brightness (3, n) where it was ``usual`` in a vessel of another contrast: of the same scale, of another one, and
    with thinner medium, above which the wire stands out by more.
    """
    scaled = usual * contrast / medium if min(contrast, medium) > 0.0 else usual
    thinner = usual + (medium - contrast) * section_mm2 if np.isfinite(contrast - medium) else usual
    return np.array([usual, scaled, np.maximum(thinner, LEAST_LEFT * usual)])


def _unexplained(bright: Array, expected: Array) -> float:
    """By which factor brightness (n,) lies beyond all that is expected (3, n), median along it; 1 where within."""
    most, least = float(np.median(bright / expected.max(axis=0))), float(np.median(bright / expected.min(axis=0)))
    return most if most > 1.0 else least if least < 1.0 else 1.0
