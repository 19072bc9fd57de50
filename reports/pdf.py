"""A run as four pages on paper (``wireval report --pdf``): verdict, distribution, worst case, cases and settings."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.image import imread

from reports import _content, colours
from reports.atomic import replacing
from reports.case_files import WORST, counted, not_reached, read_case, read_json, results_in, said_by_cases
from reports.figures import declared
from reports.html import draw_sections
from reports.origin import mixed_settings
from reports.schema import FAILURES, OVERALL_FILE, SUMMARY
from reports.tables import read_if_there
from reports.verdict import next_command, typed, unscored, verdict, worst_frames

_A4_INCH = (8.27, 11.69)
_LEFT, _RIGHT, _TOP, _BOTTOM = 0.08, 0.92, 0.95, 0.05
_MOST_FAILURES, _MOST_CASES, _MOST_SETTINGS = 8, 40, 24
_MOST_WARNINGS = 4
_SCAN_SHARE = 0.62  # of the page: rows of scans are as high as wide, and wires in them thin
_LEAST_WIDTH = 0.35  # of the page: what is smaller, as the map of hundreds of cases, cannot be read
_WIDE = 104  # characters of 9 points
_LINE = 0.0165  # of the page's height, for type of 9 points


class _Page:
    """A page that is filled from the top."""

    def __init__(self, title: str) -> None:
        self.figure = Figure(figsize=_A4_INCH)
        self.at = _TOP
        self.text(title, size=14, weight="bold")

    def text(self, text: str, size: float = 9, width: int = _WIDE, colour: str = "black", **look: Any) -> None:
        """A paragraph, broken at ``width`` characters of 9 points; what does not fit the page is left out."""
        lines = textwrap.wrap(text, round(width * 9 / size)) or [""]
        step = _LINE * size / 9
        for line in lines:
            if self.at < _BOTTOM + step:
                return
            self.figure.text(_LEFT, self.at, line, size=size, va="top", color=colour, **look)
            self.at -= step
        self.at -= 0.4 * step

    def some(self, title: str, texts: Sequence[str], rest_stands: str, most: int | None = None) -> None:
        """As many of the texts as ``most`` and the page allow, each whole, and how many more there are."""
        if not texts:
            return
        self.text(f"{title} ({len(texts)})", size=10, weight="bold")
        for number, text in enumerate(texts[:most]):
            high = (len(textwrap.wrap(text, _WIDE * 9 // 8)) + 2.4) * _LINE * 8 / 9  # and the line that counts the rest
            if self.at - high < _BOTTOM:
                texts, most = texts[number:], 0
                break
            self.text(text, size=8)
        rest = len(texts) - len(texts[:most])
        if rest:
            self.text(f"… and {rest} more {rest_stands}", size=8)

    def picture(self, path: Path, entry: Mapping[str, str], most: float) -> None:
        """A figure with its title and caption, at full width or as high as ``most`` of the page and as its rest."""
        image = imread(path)
        caption = len(textwrap.wrap(entry["read"], _WIDE * 9 // 8))
        room = min(most, self.at - _BOTTOM - (caption + 5) * _LINE)  # title, caption, and a line or two below
        wide = _RIGHT - _LEFT
        high = wide * image.shape[0] / image.shape[1] * _A4_INCH[0] / _A4_INCH[1]
        shrink = min(1.0, room / high)
        if shrink < _LEAST_WIDTH:
            return
        self.text(entry["title"], size=10.5, weight="bold")
        axes = self.figure.add_axes((_LEFT, self.at - shrink * high, shrink * wide, shrink * high))
        axes.imshow(image, interpolation="antialiased")
        axes.set_axis_off()
        self.at -= shrink * high + 0.015
        self.text(entry["read"], size=8)

    def table(self, rows: Sequence[Sequence[str]], widths: Sequence[float]) -> None:
        """Rows of texts, the first as heading; ``widths``: of the columns, in sum the page's."""
        for number, row in enumerate(rows):
            if self.at < _BOTTOM + _LINE:
                return
            left = _LEFT
            for text, width in zip(row, widths, strict=True):
                shown = textwrap.shorten(str(text), max(round(width * 135), 4), placeholder="…")
                self.figure.text(left, self.at, shown, size=7.5, va="top", weight="bold" if number == 0 else "normal")
                left += width
            self.at -= 0.85 * _LINE
        self.at -= 0.5 * _LINE


def write_pdf(out_dir: Path) -> Path:
    """Write summary.pdf beside index.html; returns its path. The figures are those of the pages."""
    summary = read_if_there(out_dir / SUMMARY.file, SUMMARY)
    path = out_dir / "summary.pdf"
    with replacing(path) as temporary, PdfPages(temporary, metadata={"CreationDate": None}) as pdf:
        for page in _pages(out_dir, summary):
            page.figure.text(_RIGHT, 0.02, f"{pdf.get_pagecount() + 1} of 4", size=8, ha="right")
            pdf.savefig(page.figure)
    return path


def _pages(out_dir: Path, summary: pd.DataFrame) -> Iterator[_Page]:
    summary, whole = _content.worst_first(summary), read_if_there(out_dir / OVERALL_FILE, SUMMARY)
    run = read_json(out_dir / "run.json")
    yield _first(out_dir, summary, whole)
    yield _over_all(out_dir, run)
    name = _worst(summary)
    yield _worst_case(out_dir, summary, name)
    yield _last(out_dir / "cases" / name, summary, run)


def _first(out_dir: Path, summary: pd.DataFrame, whole: pd.DataFrame) -> _Page:
    """Verdict, failures with the next command, tiles, warnings."""
    failures = read_if_there(out_dir / FAILURES.file, FAILURES)
    page = _Page("Guide-wire validation")
    ok, planned = int(summary["frames_ok"].sum()), int(summary["frames"].sum())
    row = {str(name): value for name, value in whole.iloc[0].items()} if len(whole) else {}
    cases = zip(summary["role"], summary["status"], strict=True)
    results = results_in(out_dir)
    simulator = next((name for one in results.values() if (name := str(one.get("simulator", "")))), "")
    said = verdict(row, simulator) or mixed_settings(out_dir) or unscored(cases) or not_reached(out_dir)
    page.text(f"{counted(len(summary), 'case')}, {ok} of {counted(planned, 'frame')} have a result. {said}", size=11)
    if len(failures):
        page.text(f"Failures ({len(failures)})", size=11, weight="bold", colour=colours.BAD)
        rows = failures[["simulator", "case", "frame", "status", "message"]].head(_MOST_FAILURES)
        for name, case, frame, status, text in rows.to_numpy():
            case = case if pd.isna(name) else f"{name}: {case}"
            place = f"{case}" if pd.isna(frame) else f"{case}, frame {frame}"
            page.text(f"{place}: {status}. {textwrap.shorten(str(text), 300, placeholder='…')}")
        if len(failures) > _MOST_FAILURES:
            page.text(f"… and {len(failures) - _MOST_FAILURES} more in failures.csv")
        command = next_command(failures["case"], typed(out_dir))
        page.text(f"Next: do what the message says, then {command}", width=_WIDE * 9 // 10, weight="bold")
    for tile in _content.in_tiles(_content.overall(declared("overall"), whole))["tiles"]:
        page.text(f"{tile['value']}  {tile['label']}")
    page.some("Warnings", said_by_cases(results, "warnings"), "on the pages of the cases", _MOST_WARNINGS)
    return _draw(page, out_dir, ("case_frame_map",))


def _over_all(out_dir: Path, run: Mapping[str, Any]) -> _Page:
    """Figures over all cases, and what was assumed."""
    page = _draw(_Page("Over all cases"), out_dir, ("planned_within", "cases_by_error"))
    assumed = [str(text) for text in run.get("assumptions", ())]
    page.some("Assumptions", [*assumed, *said_by_cases(results_in(out_dir), "assumptions")], "on the pages")
    return page


def _draw(page: _Page, folder: Path, names: Sequence[str]) -> _Page:
    """Figures that a page on the screen has drawn, as far as there are any, with their captions."""
    entries = {entry["figure"]: entry for part in ("run", "case") for entry in declared(part)}
    for name in names:
        path = folder / "figures" / f"{name}.png"
        if path.exists():
            read = _content.caption(entries[name]["read"], pd.read_csv(path.with_suffix(".csv")))
            most = _SCAN_SHARE if name == "projections" else 0.38
            page.picture(path, {**entries[name], "read": read}, most)
    return page


def _worst(summary: pd.DataFrame) -> str:
    """The first case with errors. summary : worst first."""
    known = summary[summary[WORST].notna()]
    worst = (known if len(known) else summary)["case"]
    return str(worst.iloc[0]) if len(worst) else ""


def _worst_case(out_dir: Path, summary: pd.DataFrame, name: str) -> _Page:
    """The worst case by its own figures."""
    before = "" if not name or name == summary["case"].iloc[0] else " of those with errors"
    folder = out_dir / "cases" / name
    case = read_case(folder)
    if not (folder / "figures").exists():
        draw_sections("case", case, folder, embed=False)
    page = _draw(_Page(f"The worst case{before}: {name}"), folder, ("projections", "error_along_wire"))
    frames = [f"{row['frame']} ({row['text']} mm)" for row in worst_frames({name: case.errors}, {})]
    page.text(f"Worst frames by {WORST}: {', '.join(frames)}." if frames else "No frame has an error.")
    return page


def _last(worst: Path, summary: pd.DataFrame, run: Mapping[str, Any]) -> _Page:
    """Cases in their order, worst first; settings that are not defaults; versions; more of the worst case.

    worst : its folder.
    """
    page = _Page("Cases, worst first")
    page.text(f"Cases with failed frames come first, of these the ones without any result; then the largest {WORST}.")
    heads = ("case", "status", "frames", "rms_mm", "p95_mm", "tip_median_mm", "skill_strongest")
    rows = [
        [str(row["case"]), str(row["status"]), f"{row['frames_ok']} of {row['frames']}"]
        + [_content.number(row[name]) for name in heads[3:]]
        for row in summary.head(_MOST_CASES).to_dict("records")
    ]
    page.table([heads, *rows], (0.22, 0.17, 0.08, 0.07, 0.07, 0.12, 0.11))
    if len(summary) > _MOST_CASES:
        page.text(f"… and {len(summary) - _MOST_CASES} more in summary.csv")
    page.text("Settings that are not defaults", size=10.5, weight="bold")
    chosen = [row for row in _content.settings(run.get("config", {})) if row[2] != "default"]
    if chosen:
        page.table([("setting", "value", "from"), *chosen[:_MOST_SETTINGS]], (0.3, 0.34, 0.2))
    else:
        page.text("None: every setting is its default.")
    known = dict(_content.flatten(run.get("provenance", {})))
    names = [name for name in ("wireval", "git_commit", "python") if name in known]
    page.text("; ".join(f"{name} {known[name]}" for name in names), size=8)
    page.text(f"More of {worst.name}", size=10.5, weight="bold")
    return _draw(page, worst, ("error_by_depth", "tip_by_depth"))
