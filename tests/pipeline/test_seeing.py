"""Temptations to be wrong, one scene each of the stress table (``make seeing``): right, or refused in so many words."""

from __future__ import annotations

import pytest

from tests.studies.seeing.table import look


@pytest.mark.parametrize(
    ("case", "seed"),
    [
        ("no wire, contrast x 1.15 to 1.6", 3),
        ("wire, contrast x 0.7 to 1.4", 2),
        ("platinum coil tip, x 3 to 10", 4),
        ("marker band before the tip", 2),
        ("dim distal part, x 0.15 to 0.2", 4),
        ("gap of 5 to 8 mm", 5),
        ("gap of 5 to 8 mm, 2 to 4 mm of tip beyond", 0),
        ("layered filling", 1),
        ("tip 2 to 5 voxels from the scan's side", 0),
        ("tip 2 to 5 voxels from the scan's side", 2),
    ],
)
def test_what_can_be_seen_is_traced(case, seed):
    row = look(case, seed)
    assert row.verdict == "right", row.text


@pytest.mark.parametrize(
    ("case", "seed", "status"),
    [
        ("two wires 0.8 mm apart", 0, "TRACE_AMBIGUOUS"),
        ("tip folded back on itself", 0, "TRACE_AMBIGUOUS"),
        ("wire out of the scan", 0, "TRACE_LEFT_SCAN"),
        ("wire out of the scan at a shallow angle", 1, "TRACE_LEFT_SCAN"),
        ("entry_direction the wrong way round", 0, "TRACE_WRONG_WAY"),
        ("stenosis", 1, "TRACE_LEFT_LUMEN"),
        ("slices of 2 mm", 0, "TRACE_AMBIGUOUS"),
    ],
)
def test_what_cannot_be_told_is_refused(case, seed, status):
    row = look(case, seed)
    assert row.status == status, row.text


@pytest.mark.parametrize("case", ["layered filling", "contrast that decays by 60 %"])
def test_the_wall_lies_half_way_to_the_local_level(case):
    row = look(case, 0)
    assert row.wall < 0.2, "voxel; 0.9 to 1.9 with one level for the whole vessel"
