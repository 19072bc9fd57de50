"""Outputs that others open: spreadsheets run nothing, links lead nowhere else."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from pipeline.cli import main
from reports import tables
from reports.inside import misleading_links
from reports.schema import SUMMARY
from tests.pipeline.test_manifest import GOOD


def test_a_formula_in_a_table_is_a_text(tmp_path: Path) -> None:
    rows = [{"case": "a", "group": text, "frames": 1} for text in ("=1+1", "+x", "-x", "@x", "\tx", "x=1", "'x")]
    tables.write(tmp_path / "summary.csv", SUMMARY, rows)
    written = pd.read_csv(tmp_path / "summary.csv", dtype=str)["group"]
    assert list(written) == ["'=1+1", "'+x", "'-x", "'@x", "'\tx", "x=1", "'x"]
    assert list(tables.read(tmp_path / "summary.csv", SUMMARY)["group"]) == [row["group"] for row in rows]


def test_numbers_below_zero_stay_numbers(tmp_path: Path) -> None:
    tables.write_csv(tmp_path / "a.csv", pd.DataFrame({"x": [-1.5], "y": ["-a"]}))
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == "x,y\n-1.5,'-a\n"


def test_links_that_lead_out_are_refused(tmp_path: Path, capsys: object) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    (out / "cases").mkdir(parents=True)
    elsewhere.mkdir()
    (out / "inner").symlink_to(out / "cases")
    assert misleading_links(out) == []
    assert misleading_links(tmp_path / "nothing") == []
    (out / "cases" / "run1").symlink_to(elsewhere)
    (out / "loop").symlink_to(out / "loop")
    (tmp_path / "f.mha").touch()
    (tmp_path / "m.toml").write_text(GOOD.replace("frames/*.mha", "f.mha"), encoding="utf-8")
    assert main(["run", str(tmp_path / "m.toml"), "-o", str(out), "--resume"]) == 2
    assert "links lead out of it" in capsys.readouterr().err  # type: ignore[attr-defined]
    assert list(elsewhere.iterdir()) == []


def test_a_folder_that_a_run_writes_into_is_no_link(tmp_path: Path) -> None:
    """Pictures were drawn, and removed, in the folder of the user's own that it led to."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "cases" / "a").mkdir(parents=True)
    (tmp_path / "cases" / "a" / "figures").symlink_to(tmp_path / "mine")
    (told,) = misleading_links(tmp_path)
    assert f"folders that runs write into are links: {tmp_path / 'cases' / 'a' / 'figures'} -> " in told


@pytest.mark.parametrize(
    "place", ["cases", "simulators", "sweep", "simulators/mine/cases", "sweep/solver.segment_mm=1/cases"]
)
def test_a_result_that_is_a_link_to_another_is_refused(tmp_path: Path, place: str) -> None:
    """It would be pooled twice, under two names; what it held itself is gone."""
    (tmp_path / place / "b").mkdir(parents=True)
    (tmp_path / place / "a").symlink_to("b")
    (told,) = misleading_links(tmp_path)
    assert f"a result is a link to another: {tmp_path / place / 'a'} -> b; it would be counted twice" in told


def test_links_of_a_users_own_within_an_output_are_let_be(tmp_path: Path) -> None:
    """OUT/talk/figures -> ../figures was refused by its name."""
    for place in ("figures", "talk/cases", "cases/a/figures", "cases/a/mine"):
        (tmp_path / place).mkdir(parents=True)
    (tmp_path / "talk" / "figures").symlink_to("../figures")
    (tmp_path / "talk" / "cases" / "best").symlink_to("../../cases/a")
    (tmp_path / "cases" / "a" / "mine" / "view").symlink_to("../figures")
    assert misleading_links(tmp_path) == []
