"""Puts frames back into their place: finds the phantom's motion, corrects the geometry, and reports both."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.arrays.grids import sampled, spelt
from pipeline.model import Curve, Lumen, Volume
from pipeline.register import Anchor, Registration, anchor, register
from pipeline.register.bent import Bent
from pipeline.register.branches import Branch
from pipeline.register.rigid import Motion
from pipeline.register.wider import Wider
from reports.alike import in_words
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


def sentences_of(alignment: Alignment, found: Mapping[int, Registration | None]) -> tuple[list[str], list[str]]:
    """Assumptions and warnings of the report: skipped frames in one sentence, registered ones one by one.

    found : of each frame, by its number.
    """
    if alignment.anchor is None:
        return [alignment.reason], []
    known = [(n, r) for n, r in found.items() if r is not None]
    still = [(r.moved_voxels, n) for n, r in known if not r.applied and r.trusted]
    texts = [f"frame {n}: {r.sentence}" for n, r in known if r.applied and not r.doubt]
    if still:
        most, where = max(still)
        texts.insert(
            0,
            f"no registration applied to {len(still)} of {len(found)} frames: the phantom moved {most:.2f} voxel at "
            f"most (frame {where}), below trace.register_skip_voxels = {alignment.skip_voxels}",
        )
    if alignment.anchor.hides and known:
        texts.append(HIDES)
    doubtful: dict[str, list[int]] = {}
    for n, r in known:
        if not r.trusted or (r.applied and r.doubt):
            doubtful.setdefault(r.sentence, []).append(n)
    told = [f"frame{'s' * (len(numbers) > 1)} {in_words(numbers)}: {text}" for text, numbers in doubtful.items()]
    told += _bent([(n, r.bent) for n, r in known if r.bent.told])
    told += _wider([(n, r.wider) for n, r in known if r.wider.told])
    return texts, told + _branches([(n, r.branch) for n, r in known if r.branch.told])


def _bent(found: Sequence[tuple[int, Bent]]) -> list[str]:
    """A warning where the wall of frames (number, what is left) lies where no rigid motion takes it."""
    if not found:
        return []
    number, worst = max(found, key=lambda pair: pair[1].rms_voxels)
    place = spelt(worst.worst_mm)
    return [
        f"{frames_named([n for n, _ in found])}: the vessel's wall fits no rigid motion of the phantom, up to "
        f"{worst.rms_voxels:.2f} voxel rms are left (frame {number}, {worst.most_voxels:.2f} at LPS mm ({place})): it "
        "is soft and bends, the wire pushes it aside, or slices of the scan lie aside; traces may lie beside the lumen "
        "by as much, which trace_sigma_mm includes; hold the vessel in place all along, and scan it anew"
    ]


def _wider(found: Sequence[tuple[int, Wider]]) -> list[str]:
    """A warning where the wall of frames (number, by how much) lies outside, or inside, the reference's all around."""
    if not found:
        return []
    number, worst = max(found, key=lambda pair: abs(pair[1].voxels))
    side = "outside" if worst.voxels > 0.0 else "inside"
    return [
        f"{frames_named([n for n, _ in found])}: the vessel's wall lies {abs(worst.voxels) * worst.voxel_mm:.2f} mm "
        f"{side} the reference's, all around (frame {number}): the reference shows another phantom, or this one at "
        "another pressure, filled or reconstructed otherwise; the lumen is the reference's, where simulated wires have "
        "too much or too little room, and traces are less sure by half of that; scan the reference as the frames are"
    ]


def _branches(found: Sequence[tuple[int, Branch]]) -> list[str]:
    """A warning where frames (number, what is seen) show a vessel beside the lumen that the reference has not."""
    if not found:
        return []
    number, clearest = max(found, key=lambda pair: pair[1].cells)
    return [
        f"{frames_named([n for n, _ in found])}: something as bright as the filled vessel lies beside the lumen, at "
        f"LPS mm ({spelt(clearest.at_mm)}) (frame {number}), where the reference has nothing: a branch that it "
        "does not show, a sheath or a wire outside, or bone that moved; no simulated wire can go there: scan it as "
        "filled as the frames are"
    ]


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
