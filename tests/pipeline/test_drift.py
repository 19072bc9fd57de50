"""Where nothing is registered a phantom that moved is told: for want of a reference, or since it is switched off."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from pipeline.cli import main
from pipeline.model import Curve, Volume
from pipeline.register import anchor
from pipeline.register.drift import DRIFT, REFERENCE, of_drift, with_drift
from pipeline.segment import segment
from pipeline.status import FrameStatus
from tests.studies.seeing.scenes import Draft

FAINT = "trace: wire: got a faint end; expected 1.0 mm; scan with more dose"


def moved(scan: Volume, voxels: float) -> Volume:
    """The same voxels, whose phantom lies that far along x from where it was."""
    return replace(scan, origin_mm=scan.origin_mm + [voxels * float(scan.spacing_mm[0]), 0.0, 0.0])


def seen(status: FrameStatus) -> Curve:
    curve = Curve(np.eye(3), np.full(3, 0.02))
    return curve if status is FrameStatus.OK else curve.doubted(status, FAINT)


@pytest.fixture(scope="module")
def scans() -> tuple[Volume, Volume, object]:
    """Two depths of one wire in a vessel, and what the first shows of its wall."""
    draft = Draft(np.random.default_rng(3))
    whole, frames = draft.path, []
    for depth_mm in (12.0, 22.0):
        draft.path = whole[: round((3.0 + depth_mm) / 0.05)]
        draft.opacity = np.ones(len(draft.path))
        frames.append(draft.scan(16, reference=False))
    lumen = segment(frames[0].frame, frames[0].entry[None], wire_radius_mm=draft.wire_radius)
    return frames[0].frame, frames[1].frame, anchor(frames[0].frame, lumen)


@pytest.mark.quick(1)
@pytest.mark.parametrize("voxels", [1.0, 4.0])
def test_a_phantom_that_moved_is_named_as_what_a_frame_is_refused_for(scans, voxels: float) -> None:
    _, later, first = scans
    told = with_drift(seen(FrameStatus.TRACE_AMBIGUOUS), moved(later, voxels), first)
    assert told.levels[DRIFT] == pytest.approx(voxels, abs=0.1)
    assert told.note.startswith(f"trace: phantom: got a motion of {voxels:.1f} voxels since frame 0")
    assert "give a scan without wire (reference)" in told.note
    assert FAINT in told.note
    (said,) = of_drift({2: told, 1: seen(FrameStatus.OK)})
    assert said.startswith(f"frame 2: the phantom moved since frame 0, by {voxels:.1f} voxels")


def test_a_trace_that_is_ok_beside_its_lumen_is_warned_of(scans) -> None:
    _, later, first = scans
    told = with_drift(seen(FrameStatus.OK), moved(later, 0.8), first)
    assert told.status is FrameStatus.OK
    assert of_drift({1: told})


@pytest.mark.parametrize("status", [FrameStatus.OK, FrameStatus.TRACE_AMBIGUOUS])
def test_a_phantom_that_lay_still_is_not_blamed(scans, status: FrameStatus) -> None:
    """Its frames hold wires of other depths; and with a reference nobody asks."""
    _, later, first = scans
    for one, to in ((later, first), (moved(later, 0.3), first), (moved(later, 4.0), None)):
        curve = seen(status)
        assert with_drift(curve, one, to) is curve
    assert of_drift({0: seen(status)}) == []


@pytest.mark.slow
def test_where_nobody_sees_whether_it_moved_both_are_named(scans) -> None:
    _, later, first = scans
    grey = np.random.default_rng(0).normal(500.0, 30.0, later.shape).astype(np.float32)
    nothing = replace(later, values=grey)
    assert (
        "a phantom that moved since frame 0 looks like this, too"
        in with_drift(seen(FrameStatus.TRACE_AMBIGUOUS), nothing, first).note
    )
    assert with_drift(seen(FrameStatus.OK), nothing, first).note == ""


def write(scan: Volume, path: Path) -> None:
    image = sitk.GetImageFromArray(np.rint(scan.values).astype(np.int16).transpose(2, 1, 0))
    image.SetSpacing(scan.spacing_mm.tolist())
    image.SetOrigin(scan.origin_mm.tolist())
    sitk.WriteImage(image, str(path))


@pytest.mark.slow
def test_a_phantom_that_moved_is_told_where_registration_is_switched_off(tmp_path: Path) -> None:
    """Of one that moved by 0.9 voxel traces were ok, with a tenth of that for their standard deviation."""
    draft = Draft(np.random.default_rng(3), length=14.0, spacing=0.4)
    scene = draft.scan(16)
    assert scene.reference is not None
    write(scene.reference, tmp_path / "reference.mha")
    write(replace(scene.frame, values=np.roll(scene.frame.values, 1, axis=0)), tmp_path / "frame_0.mha")
    text = (
        f'schema = 1\n[wires.w]\nradius_mm = {draft.wire_radius}\nbending_stiffness_N_mm2 = 3.0\n[[case]]\nid = "c"\n'
        'reference = "reference.mha"\nframes = "frame_*.mha"\nwire = "w"\n'
        f"entry_mm = {scene.entry.tolist()}\nentry_direction = {scene.direction.tolist()}\n"
    )
    (tmp_path / "manifest.toml").write_text(text, encoding="utf-8")
    main(["run", str(tmp_path), "-o", str(tmp_path / "out"), "--until", "trace", "--set", "trace.register=off", "-q"])
    result = json.loads((tmp_path / "out/cases/c/result.json").read_text(encoding="utf-8"))
    (said,) = (text for text in result["warnings"] if "the phantom moved since" in text)
    assert said.startswith(f"frame 0: the phantom moved since {REFERENCE.name}, by 1.0 voxels, and with trace")
