"""The pages in a browser: from a copied folder, by keys, without a network; `make browser` brings what it needs.

Skipped without playwright (extra ``browser``) or a Chromium on the path.
"""

from __future__ import annotations

import importlib.util
import io
import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from reports import tables
from reports.case_files import find_cases
from reports.case_page import render_case
from reports.figures._drawing import DOTS_PER_INCH
from reports.run_page import render_index
from reports.schema import ERRORS
from tests.reports.fake_pages import write_pages
from tests.reports.fake_results import FakeCase, write_run

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: run `make browser`")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the path: `apt-get install chromium`"),
    # of the driver's own event loop, at its end
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"),
]
CASES = (
    FakeCase("good", frames=6, truth=True),
    FakeCase("phantom <run> 2", frames=6, seed=3, failed=(2, 3), error_mm=0.35),
    FakeCase("dry", frames=4, simulated_only=True),
)
WIDE, NARROW = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
Opener = Callable[..., Any]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = write_run(tmp_path_factory.mktemp("run") / "out", CASES, sweep=True)
    for folder in find_cases(out):
        render_case(folder)
    render_index(out)
    return out


@pytest.fixture(scope="module")
def pages(run: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Every kind of page."""
    cases = [run / "cases" / case.name / "report.html" for case in CASES[1:]]
    return [run / "index.html", *cases, *write_pages(run, tmp_path_factory.mktemp("pages"))]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        flags = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=flags)
        yield chromium
        chromium.close()


@pytest.fixture
def opened(browser: Any) -> Iterator[Opener]:
    """Open a page; what it asks the network for and what it complains of fail the test at its end."""
    contexts, complaints = [], []

    def open_page(path: Path, viewport: Any = WIDE, **options: Any) -> Any:
        context = browser.new_context(viewport=viewport, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda asked: asked.url.startswith(("file:", "data:")) or complaints.append(asked.url))
        page.goto(path.as_uri())
        page.wait_for_timeout(200)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not complaints


def copied(run: Path, case: str, target: Path) -> Path:
    """The folder of one case alone, somewhere else."""
    shutil.copytree(run / "cases" / case, target / "elsewhere")
    return target / "elsewhere" / "report.html"


def painted(page: Any, canvas: str) -> int:
    """How many pixels of a canvas have another colour than its first one."""
    count = """(name) => { const c = document.querySelector(name);
        const seen = new Uint32Array(c.getContext("2d").getImageData(0, 0, c.width, c.height).data.buffer);
        return seen.filter((v) => v !== seen[0]).length }"""
    return int(page.evaluate(count, canvas))


def with_viewer(page: Path, change: Callable[[Any], None]) -> Path:
    """The page, with what its viewer shows changed."""
    data = re.compile(r'(?<=id="viewer-data">).*?(?=</script>)', re.DOTALL)
    text = page.read_text(encoding="utf-8")
    shown = json.loads(data.findall(text)[0])
    change(shown)
    page.write_text(data.sub(lambda _: json.dumps(shown), text), encoding="utf-8")
    return page


def pixels_of(page: Any, canvas: str, colour: str) -> int:
    """How many pixels of a canvas have the colour of that variable of the page's style."""
    count = """([name, colour]) => { const c = document.querySelector(name), pixels = c.getContext("2d");
        const hex = getComputedStyle(document.documentElement).getPropertyValue(colour).trim();
        const [r, g, b] = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
        const seen = new Uint32Array(pixels.getImageData(0, 0, c.width, c.height).data.buffer);
        return seen.filter((v) => v === ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0).length }"""
    return int(page.evaluate(count, [canvas, colour]))


def test_the_viewer_of_a_copied_case_goes_by_keys(run: Path, tmp_path: Path, opened: Opener) -> None:
    page = opened(copied(run, "good", tmp_path))
    page.focus("#frame")
    page.keyboard.press("Home")
    page.wait_for_timeout(150)
    assert page.inner_text("#frame-text").startswith("frame 0 (1 of 6), 20.0 mm deep, ok, rms 0.")
    mark = page.locator(".plot i").first
    before = mark.evaluate("line => line.style.left")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(150)
    assert page.inner_text("#frame-text").startswith("frame 2 (3 of 6)")
    assert float(mark.evaluate("line => line.style.left")[:-1]) > float(before[:-1]) + 5
    for canvas in ("canvas[data-axis='0']", "canvas[data-axis='2']", "#wires", "#straight", "#across"):
        assert painted(page, canvas) > 500, canvas
    for key, said in (("PageDown", "frame 0 (1 of 6)"), ("PageUp", "frame 5 (6 of 6)")):  # ten: it moved one of six
        page.keyboard.press(key)
        page.wait_for_timeout(150)
        assert page.inner_text("#frame-text").startswith(said)
    page.focus("#wires")
    turned = page.evaluate("document.getElementById('wires').toDataURL()")
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(150)
    assert page.evaluate("document.getElementById('wires').toDataURL()") != turned


def test_wire_that_was_not_scored_has_the_colour_of_no_error(run: Path, tmp_path: Path, opened: Opener) -> None:
    """The clamp's reach had the colour of the least error."""

    def reach(data: Any) -> None:
        for frame in data["frames"]:
            frame["error_mm"][: len(frame["error_mm"]) // 2] = [None] * (len(frame["error_mm"]) // 2)

    page = opened(with_viewer(copied(run, "good", tmp_path), reach))
    assert "not scored: the clamp's reach" in page.inner_text(".viewer")
    for canvas in ("#wires", "#straight", "canvas[data-axis='0']"):
        assert pixels_of(page, canvas, "--unscored") > 20, canvas
    page.fill("#place", "0.1")
    page.wait_for_timeout(150)
    assert pixels_of(page, "#across", "--unscored") > 20
    dry = opened(run / "cases" / "dry" / "report.html")
    assert pixels_of(dry, "#wires", "--simulated") > 20, "a case without any error has one colour"
    assert "not scored" not in dry.inner_text(".viewer")


def test_the_place_on_the_wire_and_the_zoom_drive_all_views(run: Path, tmp_path: Path, opened: Opener) -> None:
    page = opened(copied(run, "good", tmp_path))
    pictures = "[...document.querySelectorAll('canvas[data-axis], #straight')].map((c) => c.toDataURL())"
    before = page.evaluate(pictures)
    page.fill("#zoom", "3")
    page.fill("#place", "0.5")
    page.wait_for_timeout(150)
    assert all(a != b for a, b in zip(before, page.evaluate(pictures), strict=True))
    assert "mm from the entry, 0." in page.inner_text("#place-text")


def test_a_twentieth_of_a_millimetre_is_seen_on_the_strips(run: Path, tmp_path: Path, opened: Opener) -> None:
    page = opened(copied(run, "good", tmp_path))
    page.focus("#frame")
    for key in ("Home", "End"):
        page.keyboard.press(key)
        page.wait_for_timeout(150)
        page.evaluate("""() => { const c = document.getElementById('straight').getContext('2d'), found = [];
            const write = c.fillText.bind(c);
            c.fillText = (text, ...place) => { found.push([text, ...place]); write(text, ...place); };
            window.strips = found; document.getElementById('place').dispatchEvent(new Event('input')); }""")
        page.wait_for_timeout(150)
        said = page.evaluate("window.strips")
        top, bottom = next(one for one in said if one[0].startswith("+")), next(one for one in said if one[0] == "0 mm")
        pixels_per_mm = (bottom[2] - top[2]) / float(top[0].removesuffix(" mm"))
        assert 0.05 * pixels_per_mm >= 2.0, said


def test_the_strips_keep_their_range_from_frame_to_frame(run: Path, tmp_path: Path, opened: Opener) -> None:
    page = opened(copied(run, "good", tmp_path))
    chosen = page.input_value("#range")
    page.focus("#frame")
    page.keyboard.press("Home")
    page.wait_for_timeout(150)
    assert page.input_value("#range") == chosen
    before = page.evaluate("document.getElementById('straight').toDataURL()")
    page.select_option("#range", "5.0")
    page.wait_for_timeout(150)
    assert page.evaluate("document.getElementById('straight').toDataURL()") != before


@pytest.mark.parametrize("viewport", [WIDE, NARROW], ids=["1280", "390"])
def test_the_contents_mark_where_the_reader_is(run: Path, opened: Opener, viewport: Any) -> None:
    """At the top they marked what stood last on the first screen."""
    page = opened(run / "cases" / CASES[1].name / "report.html", viewport)
    here = "[...document.querySelectorAll('nav a.here')].map((a) => a.innerText)"
    assert page.evaluate(here) == ["Result"]
    for name in ("Tip", "Frames", "Files"):
        page.locator("nav.contents a", has_text=name).last.click()
        page.wait_for_function(f"{here}.join() === '{name}'")
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_timeout(200)
    assert page.evaluate(here) == ["Result"]


def test_on_a_dark_page_all_is_dark_but_the_scans(run: Path, opened: Opener) -> None:
    """Maps of errors and the paper around scans stayed as light as in the day."""
    page = opened(run / "cases" / "good" / "report.html", color_scheme="dark")
    filters = page.evaluate("""() => Object.fromEntries([...document.querySelectorAll('.plot img')].map(
        (i) => [i.getAttribute('src').replace(/.*\\//, ''), getComputedStyle(i).filter]))""")
    assert filters.pop("projections.png") == 'url("#night-projections")'
    assert set(filters.values()) == {'url("#night")'}
    shown = page.locator(".plot", has=page.locator("img[src$='projections.png']"))
    dark = np.asarray(Image.open(io.BytesIO(shown.screenshot())).convert("L"), dtype=float)
    light = np.asarray(Image.open(run / "cases/good/figures/projections.png").convert("L").resize(dark.shape[::-1]))
    assert dark[3, 3] < 40, "paper"
    left, top, width, height = page.evaluate("""() => [...document.querySelectorAll('#night-projections feOffset')]
        .map((e) => ['x', 'y', 'width', 'height'].map((n) => Number(e.getAttribute(n))))[0]""")
    rows = slice(*(int(dark.shape[0] * at) for at in (top + 0.02 * height, top + 0.98 * height)))
    columns = slice(*(int(dark.shape[1] * at) for at in (left + 0.02 * width, left + 0.98 * width)))
    assert np.abs(dark[rows, columns] - light[rows, columns]).mean() < 12, "the scan"


def test_worst_frames_of_the_run_open_in_the_viewer(run: Path, opened: Opener) -> None:
    page = opened(run / "index.html")
    link = page.locator("main p", has_text="Worst frames").locator("a").first
    frame = link.inner_text().split()[-1]
    link.click()
    page.wait_for_timeout(300)
    assert page.inner_text("#frame-text").startswith(f"frame {frame} (")


def test_tables_sort_filter_and_copy(run: Path, opened: Opener) -> None:
    page = opened(run / "index.html")
    page.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    box = page.locator("[data-table]", has=page.locator("th[data-name='rms_mm']")).first
    names = "rows => rows.map((r) => r.cells[0].innerText)"
    body = box.locator("tbody tr")
    assert body.evaluate_all(names)[0] == "phantom <run> 2"  # what failed comes first
    box.locator("th[data-name='case'] button").focus()
    page.keyboard.press("Enter")
    assert body.evaluate_all(names) == ["dry", "good", "phantom <run> 2"]
    box.locator("th[data-name='rms_mm'] button").click()
    box.locator("th[data-name='rms_mm'] button").click()
    assert box.locator("th[data-name='rms_mm']").get_attribute("aria-sort") == "descending"
    assert body.evaluate_all(names) == ["phantom <run> 2", "good", "dry"]  # none is last either way
    box.locator("input[type=search]").fill("phantom")
    assert box.locator("output").inner_text() == "1 of 3 rows"
    copies = {}
    for form in ("CSV", "Markdown", "LaTeX"):
        box.locator(f"button[data-copy={form}]").click()
        copies[form] = page.evaluate("window.copied")
    assert copies["CSV"].splitlines()[0].startswith("case,role,status,frames,")
    assert len(copies["CSV"].splitlines()) == 2
    assert copies["Markdown"].splitlines()[1].startswith("| --- | ---")
    assert r"frames\_ok" in copies["LaTeX"]
    assert r"\end{tabular}" in copies["LaTeX"]


def test_what_of_a_wide_table_is_out_of_sight_is_said_and_reached(run: Path, opened: Opener) -> None:
    page = opened(run / "cases" / "good" / "report.html", NARROW)
    box = page.locator("[data-table]").first
    button, pane = box.locator("button.beyond"), box.locator(".scroll")
    said = button.inner_text()
    assert re.fullmatch(r"\d+ more columns →", said)
    button.click()
    page.wait_for_timeout(700)
    assert pane.evaluate("pane => pane.scrollLeft") > 100
    assert int(button.inner_text().split()[0]) < int(said.split()[0])
    pane.evaluate("pane => { pane.scrollLeft = pane.scrollWidth; }")
    page.wait_for_timeout(200)
    assert not button.is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("viewport", [WIDE, NARROW], ids=["1280", "390"])
def test_axe_finds_nothing_serious(pages: list[Path], opened: Opener, viewport: Any, scheme: str) -> None:
    found = importlib.util.find_spec("axe_core_python")
    if found is None or found.origin is None:
        pytest.skip("axe-core-python is not installed: run `make browser`")
    for path in pages:
        page = opened(path, viewport, color_scheme=scheme)
        page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")
        page.add_script_tag(path=str(Path(found.origin).with_name("axe.min.js")))
        violations = page.evaluate("axe.run()")["violations"]
        bad = [v for v in violations if v["impact"] in ("serious", "critical")]
        assert not bad, [(path.name, v["id"], v["help"], [n["html"][:160] for n in v["nodes"][:3]]) for v in bad]
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_paper_shows_what_is_folded_and_cuts_nothing(run: Path, opened: Opener) -> None:
    page = opened(run / "cases" / CASES[1].name / "report.html", {"width": 1040, "height": 720})
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate("[...document.querySelectorAll('details')].every((part) => part.open)")
    # 277 mm of an A4 page at 96 dots per inch are 1047 pixels
    wide = "[...document.querySelectorAll('table, img, pre')].map((e) => e.getBoundingClientRect().right)"
    assert max(page.evaluate(wide)) <= 1041
    assert page.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
    # Chromium repeats headings on every sheet of a table, but not buttons: 11 of 12 sheets of a diff had none
    heads = "[...document.querySelectorAll('th button')].map((b) => getComputedStyle(b).display)"
    assert set(page.evaluate(heads)) == {"contents"}


def test_a_table_of_all_columns_fits_the_paper(run: Path, tmp_path: Path, opened: Opener) -> None:
    """A budget adds ten columns: the table was a fifth wider than the sheet, and all pages were printed smaller."""
    folder = shutil.copytree(run / "cases" / "good", tmp_path / "full")
    path = folder / ERRORS.file
    rows = tables.read(path, ERRORS)
    numbers = [column.name for column in ERRORS.shown("frames", "work") if column.kind == "float"]
    tables.write(path, ERRORS, rows.assign(**{name: rows[name].fillna(0.01234) for name in numbers}))
    page = opened(render_case(folder), {"width": 1040, "height": 720})
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator("table.widest th").count() > 26
    assert page.evaluate("document.documentElement.scrollWidth") <= 1041


@pytest.mark.parametrize("width", [1280, 1500])
def test_the_first_picture_can_be_read(run: Path, opened: Opener, width: int) -> None:
    """Beside the tiles it was two thirds as large: its small print 8 pixels high."""
    page = opened(run / "index.html", {"width": width, "height": 800})
    size = "image => image.getBoundingClientRect().width / Number(image.getAttribute('width'))"
    scale = page.locator(".first .plot img").evaluate(size)
    assert scale * 8 * DOTS_PER_INCH / 72 > 11
    tops = page.evaluate("[...document.querySelectorAll('.first .card')].map((c) => c.offsetTop)")
    assert width > 1280 or len(set(tops)) == 1, "six tiles in one row"


def test_the_sliders_stay_in_a_narrow_window(run: Path, opened: Opener) -> None:
    """That of the frames reached into the margin, and the key of the error's colours shrank to a dot."""
    page = opened(run / "cases" / "good" / "report.html", NARROW)
    right = "n => document.querySelector(n).getBoundingClientRect().right"
    assert page.evaluate(right, "#frame") <= page.evaluate(right, "main")
    assert min(page.evaluate("[...document.querySelectorAll('.key')].map((k) => k.offsetWidth)")) >= 20


def test_what_became_worse_is_read_on_a_phone(pages: list[Path], opened: Opener) -> None:
    """What each column means stood in every row: what it is now was out of sight, and half of a row was empty."""
    page = opened(next(path for path in pages if path.name == "diff.html"), NARROW)
    box = page.locator("[data-table]").first
    right = "cell => cell.getBoundingClientRect().right"
    assert box.locator("th[data-name=after]").evaluate(right) <= NARROW["width"]
    assert box.locator("tbody tr").first.evaluate("row => row.offsetHeight") < 35
    box.locator("summary").click()
    assert "root mean square distance" in box.locator("dl.meanings").inner_text()


@pytest.mark.parametrize("viewport", [WIDE, NARROW], ids=["1280", "390"])
def test_names_of_settings_are_not_broken(run: Path, tmp_path: Path, opened: Opener, viewport: Any) -> None:
    """Beside a long value their column was eight letters wide."""
    folder = shutil.copytree(run / "cases" / "good", tmp_path / "long")
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    result["geometry"]["direction"] = [[0.123456789] * 12] * 3
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    page = opened(render_case(folder), viewport)
    page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")
    lines = "[...document.querySelectorAll('table.tree code')].map((c) => [c.innerText, c.getClientRects().length])"
    assert {name: count for name, count in page.evaluate(lines) if count > 1 and "-" not in name} == {}
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_beside_a_long_first_column_there_is_room_for_the_next_on_a_phone(pages: list[Path], opened: Opener) -> None:
    """It stays in sight and filled the screen: what a promise of the benchmark was measured as could not be read."""
    page = opened(next(path for path in pages if path.name == "bench.html"), NARROW)
    cell = page.locator("[data-table]", has=page.locator("th[data-name=claim]")).locator("tbody td").first
    assert len(cell.inner_text()) > 40
    assert cell.evaluate("cell => cell.offsetWidth") < 0.6 * NARROW["width"]


def test_the_title_of_the_strips_fits_a_phone(run: Path, tmp_path: Path, opened: Opener) -> None:
    """It ended in "the simulate"."""

    def beyond(data: Any) -> None:
        data["ranges_mm"], data["range_mm"] = [0.05], 0.05

    page = opened(with_viewer(copied(run, "good", tmp_path), beyond), NARROW)
    page.evaluate("""() => { const c = document.getElementById('straight'), pen = c.getContext('2d');
        const write = pen.fillText.bind(pen), found = window.ends = [];
        pen.fillText = (text, x, y) => { write(text, x, y);
            if (pen.textAlign === 'left') found.push([text, x + pen.measureText(text).width]); };
        document.getElementById('range').innerHTML = '<option value=0.05 selected>';
        document.getElementById('place').dispatchEvent(new Event('input')); }""")
    page.wait_for_timeout(150)
    text, end = page.evaluate("window.ends.at(-1)")
    assert text.endswith("the simulated wire goes beyond")
    assert end <= page.evaluate("document.getElementById('straight').clientWidth")


def test_without_javascript_the_figures_and_tables_remain(run: Path, opened: Opener) -> None:
    page = opened(run / "cases" / "good" / "report.html", java_script_enabled=False)
    assert not page.locator(".viewer").is_visible()
    assert page.locator("#projections").is_visible()
    assert page.locator("table.grid tbody tr").count() == 6
    assert not page.locator("button[data-copy]").first.is_visible()


@pytest.mark.parametrize("viewport", [WIDE, NARROW], ids=["1280", "390"])
def test_a_failed_frame_moves_nothing_and_keeps_no_title(run: Path, opened: Opener, viewport: Any) -> None:
    """The views jumped by a line of text, and the cross-section kept the place of the frame before."""
    page = opened(run / "cases" / CASES[1].name / "report.html", viewport)
    tops = "['#place', '#straight', '.views'].map((n) => document.querySelector('.viewer ' + n).offsetTop)"
    title = "document.getElementById('across').previousElementSibling.textContent"
    found, titles = [], []
    for key in ("Home", "ArrowRight", "ArrowRight"):  # frame 2 has failed
        page.focus("#frame")
        page.keyboard.press(key)
        page.wait_for_timeout(150)
        found.append(page.evaluate(tops))
        titles.append(page.evaluate(title))
    assert found[0] == found[1] == found[2]
    assert "mm" in titles[1]
    assert titles[2] == "across the wire: no traced wire in this frame"


def test_a_wire_beyond_the_cross_section_is_said(run: Path, tmp_path: Path, opened: Opener) -> None:
    def away(data: Any) -> None:
        for frame in data["frames"]:
            wire = frame["curves"]["simulated"]
            wire[:] = [x + 40.0 * (i % 3 < 2) for i, x in enumerate(wire)]

    title = "document.getElementById('across').previousElementSibling.textContent"
    page = opened(run / "cases" / "good" / "report.html")
    assert "beyond" not in page.evaluate(title)
    page = opened(with_viewer(copied(run, "good", tmp_path), away))
    assert "the simulated wire is beyond the frame, " in page.evaluate(title)


def test_a_narrow_window_prints_as_a_wide_one(run: Path, opened: Opener) -> None:
    """The strips of a phone's window filled a sheet, so that the one before stayed blank."""
    sheets = {}
    for name, viewport in (("wide", WIDE), ("narrow", NARROW)):
        page = opened(run / "cases" / CASES[1].name / "report.html", viewport)
        sheets[name] = len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True)))
    assert sheets["narrow"] == sheets["wide"]


def test_figures_are_panned_on_a_phone_where_their_labels_can_be_read(run: Path, opened: Opener) -> None:
    """They fitted its width, labels of 10 points 6 pixels high: only a button made them legible."""
    page = opened(run / "cases" / "good" / "report.html", NARROW)
    scales = page.evaluate("""() => [...document.querySelectorAll('.plot img')].map(
        (i) => i.getBoundingClientRect().width / Number(i.getAttribute('width')))""")
    assert min(scales) * 8 * DOTS_PER_INCH / 72 > 11
    pane = page.locator("figure .pan").first
    assert pane.evaluate("pane => pane.scrollWidth - pane.clientWidth") > 200
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_a_copied_case_has_no_link_to_the_run(run: Path, tmp_path: Path, opened: Opener) -> None:
    """It went to a page that is not there."""
    assert opened(run / "cases" / "good" / "report.html").locator("a.up").is_visible()
    assert not opened(copied(run, "good", tmp_path)).locator("a.up").is_visible()
