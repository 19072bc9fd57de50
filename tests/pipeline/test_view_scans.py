"""Which scans a case's scene for 3D Slicer opens, and why not the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.load import Scans
from pipeline.load.geometry import Header, Source
from pipeline.run.stages.known import Known
from pipeline.run.view import _scans_of


def header(name: str, item: int | None = None, assumed: tuple[str, ...] = ()) -> Header:
    grid = np.ones(3), np.zeros(3), np.eye(3)
    return Header(Source(Path(name), item=item), (4, 4, 4), *grid, "uint8", 1 if item is None else 3, assumed)


def test_the_reference_and_the_shown_frame_are_opened() -> None:
    frames = tuple(header(f"frame_{n}.nii.gz") for n in range(3))
    found, said = _scans_of(Known(scans=Scans(header("reference.mha"), frames)), shown=1)
    assert found == {"reference": Path("reference.mha"), "frame 1": Path("frame_1.nii.gz")}
    assert "other frames' scans are opened by hand" in said
    assert "after a move write the new folder into fileName in scene.mrml" in said


@pytest.mark.parametrize(
    ("scan", "said"),
    [
        (header("series"), "frame 0 is not opened, since series needs an import (DICOM"),
        (header("all.nrrd", item=0), "it is a part of all.nrrd"),
        (header("a.mha", assumed=("a.mha: no origin",)), "its header was completed here (a.mha: no origin)"),
    ],
)
def test_what_slicer_would_show_otherwise_is_not_opened(scan: Header, said: str) -> None:
    found, why = _scans_of(Known(scans=Scans(None, (scan,))), shown=0)
    assert not found
    assert said in why


def test_a_case_without_scans_says_nothing() -> None:
    assert _scans_of(Known(), shown=0) == ({}, "")
