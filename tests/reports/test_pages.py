"""The pages: built from files alone, whole, escaped, small, the same bytes twice, failures first."""

from __future__ import annotations

import importlib
import inspect
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from reports import figures, tables
from reports.case_files import find_cases, read_case
from reports.case_page import render_case
from reports.figures import Drawing, figures_of
from reports.run_page import _made, render_index
from reports.schema import ERRORS, FAILURES, SUMMARY
from reports.sections import declared
from tests.reports.fake_results import EVERY_KIND, FakeCase, write_run
from tests.unseen import scarce as scarce
from tests.unseen import undrawn
from tests.unseen import unseen as unseen

CASE_FIGURES = figures_of("case")
RUN_FIGURES = figures_of("run")

PAGE_BUDGET = 2_000_000
KINDS = tuple(
    replace(kind, frames=6, failed=kind.failed and (2, 3)) for kind in EVERY_KIND if kind.role == "validation"
)
FAILED = KINDS[1].name


class _Links(HTMLParser):
    def __init__(self, page: Path) -> None:
        super().__init__()
        self.found: list[str] = []
        self.ids: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [v for k, v in attrs if k in ("href", "src") and v]
        self.ids += [v for k, v in attrs if k == "id" and v]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One rendered run with a case of every kind, of which one is drawn; tests only read it."""
    out = write_run(tmp_path_factory.mktemp("run") / "out", KINDS, sweep=True)
    with undrawn():
        for folder in find_cases(out):
            if folder.name != FAILED:
                render_case(folder)
    render_case(out / "cases" / FAILED)
    render_index(out)
    return out


def _pages(run: Path) -> list[Path]:
    return [run / "index.html", *(f / "report.html" for f in find_cases(run))]


PAGES = ("case", "run", "simulators", "calibration", "bench")


def test_every_declared_section_has_a_figure_and_the_reverse() -> None:
    assert [s["figure"] for s in declared("case")] == list(CASE_FIGURES)
    assert {s["figure"] for s in declared("run")} == set(RUN_FIGURES)
    written = set()
    for path in Path(figures.__file__).parent.glob("[a-z]*.py"):
        module = importlib.import_module(f"reports.figures.{path.stem}")
        written |= {n for n, f in vars(module).items() if _draws(f) and not n.startswith("_")}
    assert written == {s["figure"] for page in PAGES for s in declared(page)}
    for page in PAGES:
        for section in declared(page):
            assert section["read"].rstrip("}").endswith(".")
            assert section["bad"].startswith(("Bad:", "Look"))


def _draws(thing: object) -> bool:
    return inspect.isfunction(thing) and thing.__annotations__.get("return") == Drawing | None


def test_every_link_leads_somewhere(run: Path) -> None:
    for page in _pages(run):
        links = _Links(page)
        for link in links.found:
            if link.startswith("data:"):
                continue
            if link.startswith("#"):
                assert link[1:] in links.ids, (page, link)
            else:
                assert (page.parent / unquote(link).partition("#")[0]).exists(), (page, link)


def test_the_first_page_says_when_and_how_it_was_made(run: Path, tmp_path: Path) -> None:
    page = (run / "index.html").read_text(encoding="utf-8")
    assert 'Made by <code>wireval run manifest.toml -o out</code> (<a href="provenance.json">' in page
    told = {"argv": ["wireval", "run", "my study"], "started": "2026-11-30T02:33:44+00:00"}
    (tmp_path / "provenance.1-2.json").write_text(json.dumps(told), encoding="utf-8")
    made = {"day": "2026-11-30", "command": "wireval run 'my study'", "file": "provenance.1-2.json"}
    assert _made(tmp_path / "run.1-2.json") == made


def test_each_kind_of_case_has_its_sections(run: Path) -> None:
    ids = {f.name: set(_Links(f / "report.html").ids) for f in find_cases(run)}
    always = {"forces_by_depth", "contact_along_wire", "run_time", "frames", "settings", "provenance", "cite"}
    compared = {"error_by_depth", "projections", "viewer", "error_along_wire", "tip_by_depth", "skill_by_depth"}
    assert all(always <= found for found in ids.values())
    assert all(compared <= found for name, found in ids.items() if name != "aneurysm")
    assert compared & ids["aneurysm"] == {"viewer"}
    assert {name for name, found in ids.items() if "truth_by_depth" in found} == {"cow-seed-100"}
    assert {name for name, found in ids.items() if "simulated_wires" in found} == {"aneurysm"}
    assert {name for name, found in ids.items() if "failed_projections" in found} == {FAILED}
    assert {name for name, found in ids.items() if "failures" in found} == {FAILED}


@pytest.mark.usefixtures("scarce")
def test_the_files_of_view_are_counted_and_not_printed(tmp_path: Path) -> None:
    """Some seven a frame: they filled two sheets of paper and four screens."""
    case = find_cases(write_run(tmp_path / "out", KINDS[:1]))[0]
    shutil.rmtree(case / "view")
    (case / "view").mkdir()
    for name in ("wire_traced_000.vtp", "lumen.stl"):
        (case / "view" / name).write_bytes(b"x" * 1500)
    text = render_case(case).read_text(encoding="utf-8")
    folded = re.search(r'<details class="more unprinted"><summary>(.*?)</summary>(.*?)</details>', text, re.S)
    assert folded is not None
    assert folded[1] == "2 files in <code>view</code>, 3.0 kB"
    assert re.findall(r'href="(view/[^"]+)"', text) == re.findall(r'href="(view/[^"]+)"', folded[2])
    assert ".unprinted > :not(summary) { display: none; }" in text


def test_every_picture_has_its_numbers_beside_it(run: Path) -> None:
    pictures = list(run.rglob("figures/*.png"))
    assert len(pictures) > 20
    for picture in pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        lines = picture.with_suffix(".csv").read_text(encoding="utf-8").splitlines()
        assert len(lines) > 1, picture


def test_failures_come_first_and_are_escaped(run: Path) -> None:
    for page in (run / "index.html", run / "cases" / FAILED / "report.html"):
        text = page.read_text(encoding="utf-8")
        assert re.findall(r'<h2 id="(\w+)"', text)[0] == "failures"
        assert "&lt;b&gt;&amp;&lt;/b&gt;" in text
        assert "<b>&" not in text
        assert "phantom &lt;run&gt; 2" in text
    assert "None: every frame" not in (run / "index.html").read_text(encoding="utf-8")


def test_pages_stay_within_the_budget(run: Path) -> None:
    for page in _pages(run):
        links = [unquote(link) for link in _Links(page).found if link.endswith(".png")]
        total = page.stat().st_size + sum((page.parent / link).stat().st_size for link in links)
        assert total < PAGE_BUDGET, (page, total)


def test_no_value_is_shown_as_nan(run: Path) -> None:
    for page in _pages(run):
        cells = re.findall(r"<td[^>]*>(.*?)</td>", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert len(cells) > 20
        assert not [c for c in cells if re.search(r"\b(nan|NaN|None|NA)\b|&lt;NA&gt;", c)]


def test_rendering_again_gives_the_same_bytes_and_leaves_results_alone(run: Path, tmp_path: Path) -> None:
    copy = tmp_path / "moved"
    shutil.copytree(run, copy)
    before = {p.relative_to(copy): p.read_bytes() for p in copy.rglob("*") if p.is_file()}
    render_case(copy / "cases" / FAILED)
    render_index(copy)
    after = {p.relative_to(copy): p.read_bytes() for p in copy.rglob("*") if p.is_file()}
    assert after.keys() == before.keys()
    assert [str(name) for name in before if after[name] != before[name]] == []


@pytest.mark.usefixtures("unseen")
def test_embedding_makes_one_file(run: Path, tmp_path: Path) -> None:
    case = tmp_path / "case"
    shutil.copytree(run / "cases" / "aneurysm", case)
    page = render_case(case, embed=True)
    sources = re.findall(r'<img src="([^"]*)"', page.read_text(encoding="utf-8"))
    assert len(sources) == 4
    assert all(s.startswith("data:image/png;base64,") for s in sources)


def test_numbers_on_the_page_are_those_of_the_files(run: Path) -> None:
    summary = tables.read(run / "summary.csv", SUMMARY).set_index("case")
    text = (run / "cases" / "cow-seed-100" / "report.html").read_text(encoding="utf-8")
    assert f"<b>{summary.loc['cow-seed-100', 'rms_mm']:.3f}</b>" in text
    errors = tables.read(run / "cases" / "cow-seed-100" / "errors.csv", ERRORS)
    assert f"<td>{errors['p95_mm'][5]:.3f}</td>" in text


def test_a_few_numbers_are_tiles_and_the_others_a_table(run: Path) -> None:
    """There were fifteen tiles."""
    for page in _pages(run):
        text = page.read_text(encoding="utf-8")
        assert len(re.findall(r'<div class="card">', text)) <= 6, page
    text = (run / "cases" / "cow-seed-100" / "report.html").read_text(encoding="utf-8")
    tiles = re.findall(r'<div class="card"><b>[^<]*</b><span>([^<(]*)', text)
    assert [label.split(",")[0].strip() for label in tiles[:2]] == ["of 6 frames with a result", "mm rms"]
    assert "mm, deepest overlap with the wall" in text


def test_the_page_of_a_run_repeats_the_warnings_of_its_cases(run: Path) -> None:
    text = (run / "index.html").read_text(encoding="utf-8")
    assert "<li>phantom &lt;run&gt; 2: roll is unknown and was taken as 0</li>" in text


def test_what_was_simulated_stands_on_the_page(run: Path) -> None:
    """Also the catheter, where down is, and the length of the segments that nobody typed, with its reason."""
    folder = next(
        p.parent for p in sorted(run.glob("cases/*/result.json")) if "catheter" in p.read_text(encoding="utf-8")
    )
    page = (folder / "report.html").read_text(encoding="utf-8")
    for text in ("catheter.radius_mm", "catheter.insertion_mm", "<code>down</code>", "half as long ones lie within"):
        assert text in page, text


@pytest.mark.usefixtures("unseen")
def test_captions_speak_of_no_budget_where_none_was_drawn(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=3),))
    page = render_case(out / "cases" / "c").read_text(encoding="utf-8")
    assert "Solid: the wire traced in the scan; dashed: the simulated wire; dots: the tips." in page
    for absent in ("median of the ensemble", "two standard deviations", "u_val is how", "{"):
        assert absent not in " ".join(re.findall(r"<figcaption>(.*?)</figcaption>", page, re.S)), absent


@pytest.mark.usefixtures("scarce")
def test_a_lumen_that_is_not_found_is_one_failure_not_one_a_frame(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=3),))
    path = out / "cases" / "c" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    told = {"case": "c", "stage": "segment", "status": "segment_failed", "sentence": "no lumen", "message": "grey"}
    frames = [row | told for row in result["frames"]]
    summary = result["summary"] | {"status": "segment_failed", "frames_ok": 0}
    changed = result | {"status": "segment_failed", "frames": frames, "failures": [told], "summary": summary}
    path.write_text(json.dumps(changed), encoding="utf-8")
    page = render_case(path.parent).read_text(encoding="utf-8")
    assert "Failures: 1 case<" in page
    assert '<td data-label="frame">all</td>' in page, "an empty place told nothing of three frames"


def test_why_frames_failed_is_said_of_them_alone(run: Path) -> None:
    """Below the name of a case their reason stood as if it were of all frames, and again among the failures."""
    page = (run / "cases" / FAILED / "report.html").read_text(encoding="utf-8")
    said = re.findall(r'<p class="verdict">(.*?)</p>', page, re.S)[0]
    assert said.startswith("On 4 of 6 planned frames alone the simulated wire lies")


@pytest.mark.usefixtures("scarce")
def test_a_case_that_died_still_has_a_page_and_is_listed(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("fine", frames=3),))
    dead = out / "cases" / "dead"
    dead.mkdir()
    (dead / "log.txt").write_text("load: 3 frames\n", encoding="utf-8")
    render_case(dead)
    text = render_index(out).read_text(encoding="utf-8")
    assert "no result.json" in (dead / "report.html").read_text(encoding="utf-8")
    assert '<a href="cases/dead/report.html">dead</a>' in text
    assert 'class="status bad"' in text


@pytest.mark.usefixtures("scarce")
def test_a_crash_counts_its_frames_on_the_pages_as_on_the_terminal(tmp_path: Path) -> None:
    """A crashed case has the row that the terminal counts from, and no frames of its own."""
    out = write_run(tmp_path / "out", (FakeCase("fine", frames=3, failed=(1,)),))
    crashed = out / "cases" / "crashed"
    crashed.mkdir()
    row = {"case": "crashed", "status": "crashed", "frames": 5, "frames_ok": 0, "frames_failed": 5}
    result = {"case": "crashed", "status": "crashed", "sentence": "its log has the traceback", "frames": []}
    (crashed / "result.json").write_text(json.dumps(result | {"summary": row}), encoding="utf-8")
    index = render_index(out).read_text(encoding="utf-8")
    assert "2 cases, 8 frames: 2 ok, 6 without a result." in index
    page = render_case(crashed).read_text(encoding="utf-8")
    assert "<b>0</b><span>of 5 frames with a result</span>" in page


def test_counters_are_sums_and_levels(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    folder.mkdir()
    cnr = {"min": 6.17, "median": 8.873, "max": 9.73}
    counters = {"trace": {"voxels_read": 63610.0, "cnr": cnr, "blur_mm": dict.fromkeys(cnr)}}
    (folder / "result.json").write_text(
        json.dumps({"case": "c", "status": "ok", "counters": counters}), encoding="utf-8"
    )
    text = render_case(folder).read_text(encoding="utf-8")
    work = text[text.index('<h2 id="work">') : text.index('<h2 id="settings">')]
    cells = re.findall(r"<td[^>]*>(.*?)</td>", work)
    assert cells == ["<code>trace.voxels_read</code>", "63610", "<code>trace.cnr</code>", "8.87 (6.17 to 9.73)"]


def test_a_case_that_failed_as_a_whole_says_why(tmp_path: Path) -> None:
    folder = tmp_path / "out" / "cases" / "c"
    folder.mkdir(parents=True)
    result = {"case": "c", "status": "segment_failed", "sentence": "no lumen", "message": "segment: seed 0 < 1"}
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    text = render_case(folder).read_text(encoding="utf-8")
    assert "segment: seed 0 &lt; 1" in text
    assert not list((folder / "figures").glob("*")) if (folder / "figures").exists() else True


def test_a_run_without_cases_is_no_success(tmp_path: Path) -> None:
    text = render_index(tmp_path).read_text(encoding="utf-8")
    assert "0 cases" in text
    assert 'class="status bad"' in text


@pytest.mark.parametrize(("name", "content"), [("result.json", b"{"), ("result.json", b"[]"), ("frames.h5", b"x" * 99)])
def test_a_damaged_file_is_named(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=re.escape(name)):
        read_case(tmp_path)


@pytest.mark.usefixtures("scarce")
def test_one_damaged_case_does_not_hide_the_others(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("fine", frames=3), FakeCase("hurt", frames=3)))
    (out / "cases" / "hurt" / "frames.h5").write_bytes(b"x" * 99)
    text = render_index(out).read_text(encoding="utf-8")
    assert "a result file cannot be read" in text
    assert "frames.h5: not a readable HDF5 file" in text
    assert "1 case, 3 frames: 3 ok" in text
    assert 'class="status bad"' in text


@pytest.mark.usefixtures("unseen")
def test_a_picture_whose_data_is_gone_is_removed(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=2, simulated_only=True),))
    figures = out / "cases" / "c" / "figures"
    figures.mkdir()
    for name in ("error_along_wire.png", "error_along_wire.csv"):
        (figures / name).write_text("left from an earlier run", encoding="utf-8")
    (figures / "tip_by_depth.png").mkdir()
    render_case(out / "cases" / "c")
    assert (figures / "tip_by_depth.png").is_dir(), "it ended the run with all of its cases"
    assert not list(figures.glob("error_along_wire*"))
    assert (figures / "contact_along_wire.png").exists()


@pytest.mark.usefixtures("unseen")
def test_cases_come_worst_first_and_a_tall_map_leaves_the_first_screen(tmp_path: Path) -> None:
    cases = tuple(FakeCase(f"c{i:02d}", frames=2, error_mm=0.1 + 0.01 * i, simulated_only=False) for i in range(3))
    out = write_run(tmp_path / "out", (*cases, FakeCase("bad", frames=3, failed=(1,), error_mm=0.05)))
    text = render_index(out).read_text(encoding="utf-8")
    table = text[text.index('<h2 id="cases">') :]
    assert re.findall(r'<tr[^>]*><td class="text">(?:<a[^>]*>)?(\w+)', table)[:4] == ["bad", "c02", "c01", "c00"]
    shutil.rmtree(out)
    many = tmp_path / "many"
    for i in range(45):
        folder = many / "cases" / f"c{i:02d}"
        folder.mkdir(parents=True)
        tables.write(folder / "errors.csv", ERRORS, [{"frame": 0, "status": "ok", "rms_mm": 0.1, "p95_mm": 0.2}])
        (folder / "result.json").write_text(json.dumps({"case": folder.name, "status": "ok"}), encoding="utf-8")
    rows = [{"case": f"c{i:02d}", "status": "ok", "frames": 1, "frames_ok": 1, "rms_mm": 0.1} for i in range(45)]
    tables.write(many / "summary.csv", SUMMARY, rows)
    ids = re.findall(r'<h2 id="(\w+)"', render_index(many).read_text(encoding="utf-8"))
    assert ids.index("planned_within") < ids.index("cases") < ids.index("case_frame_map")


@pytest.mark.usefixtures("scarce")
def test_a_calibration_case_is_not_said_to_be_better(tmp_path: Path) -> None:
    """Its parameters were learnt from it."""
    write_run(tmp_path, [FakeCase("learnt", frames=3, role="calibration"), FakeCase("judged", frames=3)])
    text = {n: render_case(tmp_path / "cases" / n).read_text(encoding="utf-8") for n in ("learnt", "judged")}
    assert "It is a calibration case and not scored" in text["learnt"]
    assert "The wire is better" not in text["learnt"]
    assert "The wire is better" in text["judged"]


@pytest.mark.usefixtures("scarce")
def test_a_case_that_is_worse_than_a_guess_is_marked_and_named(tmp_path: Path) -> None:
    """The index was green and said "The wire is better" of both together."""
    out = write_run(tmp_path / "out", (FakeCase("a", 3), FakeCase("b", 3)))
    rows = tables.read(out / "summary.csv", SUMMARY).assign(skill_strongest=[0.9, -0.6], strongest_null="previous")
    tables.write(out / "summary.csv", SUMMARY, rows)
    page = render_index(out).read_text(encoding="utf-8")
    assert "<strong>1 of 2 cases is worse than a guess: b.</strong>" in page
    assert '<span class="status poor">a case is worse than a guess</span>' in page
    marked = re.findall(r'<tr class="bad"><td class="text">(?:<a[^>]*>)?(\w+)', page)
    assert marked == ["b"]
    assert "only marked rows" in page


@pytest.mark.quick(1)
@pytest.mark.usefixtures("scarce")
@pytest.mark.parametrize(("skill", "said"), [(0.9, True), (None, False)])
def test_a_case_page_says_who_is_judged_over_the_run_alone(tmp_path: Path, skill: float | None, said: bool) -> None:
    """Beside a skill of the case, and nowhere else: an empty field is no predictor."""
    folder = write_run(tmp_path / "out", (FakeCase("a", 3),)) / "cases" / "a"
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    result["summary"] |= {"skill_strongest": skill, "strongest_null": "previous" if skill else None}
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    assert ("it is judged over the run" in render_case(folder).read_text(encoding="utf-8")) == said
    run = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    (tmp_path / "out" / "run.json").write_text(json.dumps(run | {"planned": ["a"]}), encoding="utf-8")
    page = render_case(folder).read_text(encoding="utf-8")
    assert "it is judged over the run" not in page, "there is no other insertion"


@pytest.mark.usefixtures("scarce")
def test_what_one_insertion_shows_of_others_is_said_on_the_first_page_alone(tmp_path: Path) -> None:
    """Each case is one: the pages of all were amber, in a run of twenty cases, too."""
    folder = write_run(tmp_path / "out", (FakeCase("a", 3),)) / "cases" / "a"
    one = {
        "skill_strongest": 0.9,
        "strongest_null": "previous",
        "interval": "interval withheld: 1 insertion, at least 3",
    }
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    result["summary"] |= one
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    page = render_case(folder).read_text(encoding="utf-8")
    assert '<span class="status good">ok</span>' in page
    assert "about others" not in page
    for name in ("summary.csv", "overall.csv"):
        rows = tables.read(tmp_path / "out" / name, SUMMARY)
        tables.write(tmp_path / "out" / name, SUMMARY, rows.assign(**one))
    assert "one insertion shows nothing about others" in render_index(tmp_path / "out").read_text(encoding="utf-8")


@pytest.mark.usefixtures("scarce")
def test_a_scan_that_the_roll_was_fitted_on_is_no_frame_that_is_ok(tmp_path: Path) -> None:
    """Six scans were "Every frame is ok" and "5 frames: 5 ok"."""
    out = write_run(tmp_path / "out", (FakeCase("a", 5),))
    path = out / "cases" / "a" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    result["summary"]["frames_fitted"] = 1
    path.write_text(json.dumps(result), encoding="utf-8")
    said = "6 scans: 1 used for the roll, 5 scored."
    assert f'<p class="verdict">1 case, {said} ' in render_index(out).read_text(encoding="utf-8")
    assert f'<p class="verdict">{said} The simulated' in render_case(out / "cases" / "a").read_text(encoding="utf-8")


@pytest.mark.usefixtures("scarce")
def test_all_scans_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("a", 5, failed=(1, 3)),))
    rows = tables.read(out / "failures.csv", FAILURES)
    told = [f"s/frame_{n}.mha: the file is cut short" for n in rows["frame"]]
    tables.write(out / "failures.csv", FAILURES, rows.assign(message=told))
    page = render_index(out).read_text(encoding="utf-8")
    assert "Files: frame_1.mha, frame_3.mha.<br>In frame 1: <code>s/frame_1.mha: the file is cut short</code>" in page
