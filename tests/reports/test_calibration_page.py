"""What a calibration's page says of the traces that it was fitted to."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from reports.calibration import render_calibration
from tests.reports import fake_pages


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("stated", "scale", "said", "unsaid"),
    [
        (True, 1.0, "", "variances were taken"),
        (True, 2.5, "taken 2.50 times as large as they are stated", "Curves of your own"),
        (False, 0.194, "Curves of your own state no standard deviation", "as they are stated"),
    ],
)
def test_variances_are_only_compared_with_those_that_are_stated(
    tmp_path: Path, stated: bool, scale: float, said: str, unsaid: str
) -> None:
    """Of own curves, which state none, "0.194 times as large as they are stated, since the wires lie farther"."""
    folder = tmp_path / "out"
    fake_pages._calibration(folder)
    record = folder / "calibration.json"
    known = json.loads(record.read_text(encoding="utf-8"))
    record.write_text(json.dumps(known | {"scale": scale, "stated": stated}), encoding="utf-8")
    text = render_calibration(folder).read_text(encoding="utf-8")
    assert said in text
    assert unsaid not in text
    assert "mm as calibrated, each insertion turned for itself in both" in text
    assert (
        "clamps and walls fitted to both, each insertion turned for itself in both: a run as stated turns none" in text
    )
    assert "turned for itself as calibrated" not in text


def test_what_each_insertion_was_moved_by_is_told(tmp_path: Path) -> None:
    """Walls moved by 0.14 mm were in no file, and "as calibrated" did not say that walls were fitted."""
    fake_pages._calibration(tmp_path / "out")
    text = (tmp_path / "out" / "calibration.html").read_text(encoding="utf-8")
    assert "clamps and walls are fitted to both; with the walls as they are given it is 0.150 mm" in text
    table = text.partition('id="moved"')[2].partition("</table>")[0]
    assert table.count('class="bad"') == 1
    assert "-0.140" in table
    assert re.findall(r">\s*(0\.\d+)\s*<", table) == ["0.012", "0.045"], "of how far it may be off two digits count"
    assert "exact" in table
    assert "that the fit starts from: stated, or taken where nothing is" in table, "of the lumen a run takes 0.05 voxel"
    assert "<code>taper</code>: known to 1.5 only." in text, "a reservation of what is taken"
    assert text.count("hat is seen holds only if all else is right.") == 1, "it stood beside each that is seen"
