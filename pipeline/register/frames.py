"""Frames put back into their place: the phantom's motion found, the geometry corrected, and all of it said."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pipeline.arrays.resample import sampled
from pipeline.load import Box, Header, scans
from pipeline.load.config import LoadConfig
from pipeline.model import Lumen, Volume
from pipeline.register import Anchor, Registration, anchor, register
from pipeline.run.frame import Frame
from pipeline.trace.config import TraceConfig


@dataclass(frozen=True, eq=False)
class Place:
    """Where frames belong: ``anchor`` None where there is nothing to register to, and ``reason`` says why."""

    lumen: Lumen
    box: Box
    load: LoadConfig
    trace: TraceConfig
    anchor: Anchor | None
    reason: str = ""


def place_of(
    lumen: Lumen, box: Box, reference: Volume | None, load: LoadConfig, trace: TraceConfig, own_curves: bool
) -> Place:
    """The place of a case's frames; reference : the wire-free scan's crop of ``box``."""
    reason = ""
    if own_curves:
        reason = "no registration applied: the curves are the manifest's own, taken to lie where the reference does"
    elif trace.register == "off":
        reason = "no registration applied: switched off (trace.register)"
    elif reference is None:
        reason = "no registration applied: no reference scan; frames are taken to lie where frame 0 does"
    to = anchor(reference, lumen) if reference is not None and not reason else None
    return Place(lumen, box, load, trace, to, reason)


def put_in_place(frame: Volume, header: Header, place: Place) -> tuple[Volume, Volume, Registration | None]:
    """The frame to trace, the frame to look at, and how it lay.

    The first keeps its grey values and has the geometry that it would have had the phantom not moved; it is read anew
    where the moved lumen asks for other voxels. The second is interpolated onto the reference's lattice.
    """
    if place.anchor is None:
        return frame, frame, None
    found = register(frame, place.anchor, place.trace.register_skip_voxels)
    if not found.applied:
        return frame, frame, found
    box = scans.lumen_box(header, place.lumen, found.motion)
    moved = frame if box == place.box else scans.load_crop(header, box, place.load)
    here = found.motion.undone(moved)
    shown = sampled(here, frame, float(frame.values.min()))
    return (
        here,
        Volume(shown.values, shown.spacing_mm, shown.origin_mm, shown.direction, frame.assumed),
        found,
    )


def counters_of(found: Registration | None) -> dict[str, float]:
    """What was done and what was left out, for the case's counters."""
    if found is None:
        return {"registration_left_out": 1}
    return {"registration_applied": found.applied, "registration_skipped": not found.applied}


def said(place: Place, frames: list[Frame]) -> tuple[list[str], list[str]]:
    """Assumptions and warnings of the report: skipped frames in one sentence, registered ones one by one."""
    if place.anchor is None:
        return [place.reason], []
    known = [(f.index, f.registration) for f in frames if f.registration is not None]
    still = [(r.moved_voxels, n) for n, r in known if not r.applied and r.trusted]
    texts = [f"frame {n}: {r.sentence}" for n, r in known if r.applied]
    if still:
        most, where = max(still)
        texts.insert(
            0,
            f"no registration applied to {len(still)} of {len(frames)} frames: the phantom moved {most:.2f} voxel at "
            f"most (frame {where}), below trace.register_skip_voxels = {place.trace.register_skip_voxels}",
        )
    return texts, [f"frame {n}: {r.sentence}" for n, r in known if not r.trusted]


def record(found: Registration | None) -> dict[str, Any] | None:
    """The transform of one frame for result.json: reference -> frame, p -> rotation @ p + shift (LPS mm)."""
    if found is None:
        return None
    return {
        "applied": found.applied,
        "moved_voxels": found.moved_voxels,
        "left_voxels": found.left_voxels,
        "centre_shift_mm": found.centre_shift_mm,
        "angle_deg": found.motion.angle_deg,
        "rotation": found.motion.rotation,
        "shift_mm": found.motion.shift_mm,
    }
