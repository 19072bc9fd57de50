"""Puts frames back into their place: finds the phantom's motion, corrects the geometry, and reports both."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.arrays.grids import sampled
from pipeline.model import Curve, Lumen, Volume
from pipeline.register import Anchor, Registration, Rest, anchor, register
from pipeline.register.rigid import Motion
from reports.alike import frames_in_words
from reports.case_files import frames_named

HIDES = (
    "the vessel's wall hardly shows a motion of the phantom along, or about, the vessel itself, as that of a straight "
    "tube: it is taken to have made none; what it made is in lengths and depths"
)


@dataclass(frozen=True, eq=False)
class Alignment:
    """How the frames of a case are registered: to ``anchor``, or, where that is None, not at all, for this ``reason``.

    skip_voxels : a phantom that moved by less than this everywhere is taken not to have moved.
    """

    anchor: Anchor | None
    skip_voxels: float
    reason: str = ""


def alignment_of(
    lumen: Lumen, reference: Volume | None, skip_voxels: float, *, switched_on: bool, own_curves: bool
) -> Alignment:
    """The alignment of a case's frames. reference : the wire-free scan, at least the box that holds the lumen."""
    if own_curves:
        reason = "the curves are the manifest's own, taken to lie where the reference does"
    elif not switched_on:
        reason = "switched off (trace.register)"
    elif reference is None:
        reason = "no reference scan; frames are taken to lie where frame 0 does"
    else:
        return Alignment(anchor(reference, lumen), skip_voxels)
    return Alignment(None, skip_voxels, f"no registration applied: {reason}")


def put_in_place(
    frame: Volume, alignment: Alignment, read_moved: Callable[[Motion], Volume]
) -> tuple[Volume, Volume, Registration | None]:
    """The frame to trace, the frame to show, and its registration.

    The first keeps its grey values and gets the geometry that it would have if the phantom had not moved;
    ``read_moved`` reads the voxels that the moved lumen needs. The second is interpolated onto the reference's lattice.
    """
    found = None if alignment.anchor is None else register(frame, alignment.anchor, alignment.skip_voxels)
    if found is None or not found.applied:
        return frame, frame, found
    here = found.motion.undone(read_moved(found.motion))
    shown = sampled(here, frame, float(frame.values.min())).values
    return here, replace(frame, values=shown, made_of=None), found


def counters_of(found: Registration | None) -> dict[str, float]:
    """What was done and what was left out, for the case's counters."""
    if found is None:
        return {"registration_left_out": 1}
    return {"registration_applied": found.applied, "registration_skipped": not found.applied}


def sentences_of(
    alignment: Alignment, found: Mapping[int, Registration | None], *, wall_right: bool = True
) -> tuple[list[str], list[str]]:
    """Assumptions and warnings of the report: skipped frames in one sentence, registered ones one by one.

    found : of each frame, by its number.     wall_right : whether the lumen is the vessel's. A wall that is not fits no
    motion of the phantom: "it is soft and bends" sent users to scan it anew.
    """
    if alignment.anchor is None:
        return [alignment.reason], []
    known = [(n, r) for n, r in found.items() if r is not None]
    still = [(r.moved_voxels, n) for n, r in known if not r.applied and r.trusted]
    texts = [f"frame {n}: {r.sentence}" for n, r in known if r.applied and not r.doubt]
    if still:
        most, where = max(still)
        shown = " as far as its wall shows" * alignment.anchor.hides
        texts.insert(
            0,
            f"no registration applied to {len(still)} of {len(found)} frames: the phantom moved {most:.2f} voxel at "
            f"most{shown} (frame {where}), below trace.register_skip_voxels = {alignment.skip_voxels}",
        )
    if alignment.anchor.hides and known:
        texts.append(HIDES)
    doubtful: dict[str, list[int]] = {}
    for n, r in known:
        if not r.trusted or (r.applied and r.doubt):
            doubtful.setdefault(r.sentence, []).append(n)
    told = [f"{frames_in_words(numbers)}: {text}" for text, numbers in doubtful.items()]
    return texts, told + (_of_rests([(n, r.rests) for n, r in known]) if wall_right else [])


def _of_rests(known: Sequence[tuple[int, tuple[Rest, ...]]]) -> list[str]:
    """A warning for each kind of rest that is told of a frame. known : by frame, what its motion does not explain."""
    said = []
    for kind in zip(*([(n, rest) for rest in rests] for n, rests in known), strict=True):
        told = [(n, rest) for n, rest in kind if rest.told]
        if told:
            number, worst = max(told, key=lambda one: one[1].size)
            said.append(f"{frames_named([n for n, _ in told])}: {worst.sentence(number)}")
    return said


def widened(curve: Curve, found: Registration | None) -> Curve:
    """The curve, less sure by what no rigid motion of the phantom explains of the wall beside it."""
    if found is None or not (found.bent.told or found.wider.told) or not len(curve.points_mm):
        return curve
    more = np.full(len(curve.points_mm), found.wider.off_mm)
    if found.bent.told:  # per axis: a wall's shift along the vessel does not show
        more = np.hypot(more, found.bent.off_mm(curve.points_mm) / np.sqrt(2.0))
    sigma, tip = np.hypot(curve.sigma_mm, more), float(np.hypot(np.nan_to_num(curve.tip_sigma_mm), more[-1]))
    return replace(curve, sigma_mm=sigma, tip_sigma_mm=tip)


def record(found: Registration | None) -> dict[str, object] | None:
    """The transform of one frame for result.json: reference -> frame, p -> rotation @ p + shift (LPS mm)."""
    if found is None:
        return None
    names = ("applied", "moved_voxels", "left_voxels", "centre_shift_mm")
    motion = {name: getattr(found.motion, name) for name in ("angle_deg", "rotation", "shift_mm")}
    bent = {"bent_rms_voxels": found.bent.rms_voxels, "bent_most_voxels": found.bent.most_voxels}
    wall = bent | {"wider_voxels": found.wider.voxels}
    return {name: getattr(found, name) for name in names} | wall | motion
