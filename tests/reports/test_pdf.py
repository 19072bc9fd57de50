"""summary.pdf: four pages, whatever the run holds, the same bytes twice."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from reports import pdf, tables
from reports._content import worst_first
from reports.pdf import write_pdf
from reports.pdf_page import BOTTOM, Page
from reports.schema import FAILURES, SUMMARY
from tests.reports.fake_results import FakeCase, write_run
from tests.unseen import undrawn
from tests.unseen import unseen as unseen


def test_four_pages_say_verdict_failures_and_the_worst_case(tmp_path: Path) -> None:
    cases = (FakeCase("fine", frames=3), FakeCase("poor", frames=3, failed=(1,), error_mm=0.6))
    out = write_run(tmp_path / "out", cases)
    (out / "gates.json").write_text('{"closed": ["gate closed: --fail-if x>1: x is 2"]}', encoding="utf-8")
    first = write_pdf(out).read_bytes()
    assert len(re.findall(rb"/Type /Page\b", first)) == 4
    assert write_pdf(out).read_bytes() == first
    assert len(first) < 2e6
    summary = tables.read(out / "summary.csv", SUMMARY)
    with undrawn():
        pages = [" ".join(text.get_text() for text in page.figure.texts) for page in pdf._pages(out, summary)]
    said = (
        ("5 of 6 frames", "0.250 mm", "Gate closed: --fail-if x>1: x is 2.", "frame 1: no_wire", "--only poor"),
        ("Cases side by side", "poor: Skill against trivial predictors"),
        ("worst case: poor", "stands among the assumptions", "Worst frames by p95_mm"),
        ("solver.segment_mm", "frames_failed", "More of poor", "Error against insertion depth"),
    )
    for page, words in zip(pages, said, strict=True):
        assert not [word for word in words if word not in page], page


@pytest.mark.usefixtures("unseen")
def test_worst_is_the_same_on_every_page(tmp_path: Path) -> None:
    """One page called the only case that was ok the worst, and the next had it last, below one without any result."""
    cases = (FakeCase("far", frames=3, error_mm=0.9), FakeCase("poor", frames=3, failed=(1,)))
    cases += (FakeCase("fine", frames=3, error_mm=0.1), FakeCase("none", frames=3, failed=(1,)))
    out = write_run(tmp_path / "out", cases)
    summary = tables.read(out / "summary.csv", SUMMARY)
    summary.loc[summary["case"] == "none", "p95_mm"] = math.nan
    summary = worst_first(summary)
    assert summary["case"].tolist() == ["none", "poor", "far", "fine"]
    pages = [" ".join(text.get_text() for text in page.figure.texts) for page in pdf._pages(out, summary)]
    assert "The worst case of those with errors: poor" in pages[2]
    assert "1 frame of it failed." in pages[2]
    assert re.findall("none|poor|far|fine", pages[3].partition("skill_strongest")[2])[:4] == summary["case"].tolist()


@pytest.mark.slow
@pytest.mark.usefixtures("unseen")
def test_the_worst_case_is_the_one_that_the_first_page_names(tmp_path: Path) -> None:
    """It said "worse than a guess: far", and showed another case, of which a frame had failed, as the worst."""
    cases = (FakeCase("poor", frames=3, failed=(1,), error_mm=0.1), FakeCase("far", frames=3, error_mm=0.6))
    out = write_run(tmp_path / "out", cases)
    summary = tables.read(out / "summary.csv", SUMMARY)
    summary = summary.assign(skill=[0.9, -0.5], skill_low=math.nan, skill_high=math.nan)
    pages = [" ".join(text.get_text() for text in page.figure.texts) for page in pdf._pages(out, summary)]
    assert "1 of 2 cases is worse than a guess: far." in pages[0]
    assert "The worst of the cases worse than a guess: far" in pages[2]
    assert "More of far" in pages[3]


@pytest.mark.slow
@pytest.mark.usefixtures("unseen")
def test_warnings_and_assumptions_are_whole(tmp_path: Path) -> None:
    """They were cut off after two lines, and the pages beside them half empty."""
    out = write_run(tmp_path / "out", [FakeCase(name, frames=2) for name in "ab"])
    for path in out.glob("cases/*/result.json"):
        result = json.loads(path.read_text(encoding="utf-8"))
        warnings = [f"warning {n} " + "of many words " * 20 + "to its end" for n in "tuvwxyz"]
        assumptions = ["the roll is 0 " + "and so on " * 40 + "to its end", f"only {path.parent.name} says so"]
        path.write_text(json.dumps(result | {"warnings": warnings, "assumptions": assumptions}), encoding="utf-8")
    first, second, *_ = pdf._pages(out, tables.read(out / "summary.csv", SUMMARY))
    said = [" ".join(text.get_text() for text in page.figure.texts) for page in (first, second)]
    for words in ("Warnings (7)", "a, b: warning t", "and 3 more"):
        assert words in said[0]
    for words in ("Assumptions (3)", "a, b: the roll is 0", "b: only b"):
        assert words in said[1]
    assert [text.count("to its end") for text in said] == [4, 1]
    assert first.at > BOTTOM + 0.1, "room for more than that"


@pytest.mark.usefixtures("unseen")
def test_frames_of_cases_without_a_result_are_in_shares(tmp_path: Path) -> None:
    """It said "every number is over the other cases alone" where `wireval report` had counted them."""
    out = write_run(tmp_path / "out", [FakeCase("a", frames=2)])
    run = json.loads((out / "run.json").read_text(encoding="utf-8"))
    (out / "run.json").write_text(json.dumps(run | {"planned": ["a", "lost"]}), encoding="utf-8")
    summary = tables.read(out / "summary.csv", SUMMARY)
    for rows, said in ([], "alone, shares of planned frames, too."), ([{"status": "not_run"}], "theirs among them."):
        tables.write(out / "failures.csv", FAILURES, [{"case": "lost"} | row for row in rows])
        page = " ".join(text.get_text() for text in next(pdf._pages(out, summary)).figure.texts)
        assert "without a result here: lost." in page
        assert said in page


def test_texts_that_do_not_fit_a_page_are_counted() -> None:
    page = Page("a page")
    page.some("Assumptions", [f"assumption {n} " + "of words " * 60 for n in range(40)], "on the pages")
    said = " ".join(text.get_text() for text in page.figure.texts)
    shown = len(re.findall(r"assumption \d+ of", said))
    assert 3 < shown < 40
    assert f"and {40 - shown} more on the pages" in said
    assert page.at > BOTTOM - 1e-9


@pytest.mark.parametrize("cases", [(), (FakeCase("s", frames=2, simulated_only=True),)], ids=["none", "simulated"])
def test_a_run_without_errors_has_its_four_pages(tmp_path: Path, cases: tuple[FakeCase, ...]) -> None:
    path = write_pdf(write_run(tmp_path / "out", cases))
    assert len(re.findall(rb"/Type /Page\b", path.read_bytes())) == 4


@pytest.mark.slow
def test_figures_have_200_dots_an_inch_and_fill_their_pages(tmp_path: Path) -> None:
    """They were those of the screen, 100 dots an inch, and the first two pages of a small run half empty."""
    out = write_run(tmp_path / "out", (FakeCase("fine", frames=5), FakeCase("poor", frames=4, error_mm=0.6)))
    with undrawn():
        pages = list(pdf._pages(out, tables.read(out / "summary.csv", SUMMARY)))
    for page in pages:
        for axes in page.figure.axes:
            (picture,) = axes.images
            dots = picture.get_array().shape[1] / (axes.get_position().width * page.figure.get_figwidth())
            assert 195 < dots < 205
            assert axes.get_position().y0 > BOTTOM
    assert [len(page.figure.axes) for page in pages] == [3, 2, 2, 2]
    assert max(page.at for page in pages) < 0.2
