"""What the figures show is what the files hold: places, geometry, nothing where there is nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from PIL import Image

from reports import colours, tables
from reports._content import caption
from reports.case_files import CaseFiles, read_case
from reports.colours import ERROR_SCALE_MM, TRACED
from reports.figures import RunFiles, _drawing, _planes, figures_of
from reports.figures._drawing import LEAST_MM, Drawing, FrameAxis, drawn_names, positive_axis
from reports.figures._style import STAGE_COLOURS, lines, predictors
from reports.figures.along_wire import _CLIP_PERCENTILE
from reports.figures.simulators import SimulatorFiles, _nearest, unbroken, who_is_nearest
from reports.figures.simulators import colours as colours_of
from reports.frames_file import FrameArrays, ScanCrop, Straightened, frame_numbers, read_frame, read_scan, write_frames
from reports.page import draw_sections
from reports.schema import ALL, BUDGET, ENTRIES, ERRORS, OURS, POINTS, SUMMARY, SWEEP, TIMINGS
from reports.sections import declared
from reports.verdict import NEVER_NEAREST
from tests.reports.fake_results import FakeCase, write_run

CASE_FIGURES = figures_of("case")
RUN_FIGURES = figures_of("run")

# no permutation, so that swapped or transposed axes cannot hide
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def _empty_case(folder: Path, **changes: Any) -> CaseFiles:
    fields = {
        "folder": folder,
        "result": {},
        "errors": tables.read_if_there(None, ERRORS),
        "samples": tables.read_if_there(None, POINTS),
        "timings": tables.read_if_there(None, TIMINGS),
        "scan": None,
        "frames": (),
    }
    return CaseFiles(**{**fields, **changes})


def draw(figure: Callable[[Any], Drawing | None], data: Any) -> Drawing:
    """What a figure's function draws of data that it has something to draw of."""
    drawing = figure(data)
    assert drawing is not None
    return drawing


@pytest.mark.parametrize("name", CASE_FIGURES)
def test_no_data_is_no_figure(name: str, tmp_path: Path) -> None:
    assert CASE_FIGURES[name](_empty_case(tmp_path)) is None
    rows = {"frame": [0, 1], "status": ["no_wire", "load_failed"]}
    tables.write(tmp_path / "errors.csv", ERRORS, pd.DataFrame(rows))
    failed = _empty_case(tmp_path, errors=tables.read(tmp_path / "errors.csv", ERRORS))
    assert CASE_FIGURES[name](failed) is None


@pytest.mark.parametrize("name", RUN_FIGURES)
def test_an_empty_run_has_no_figure(name: str) -> None:
    run = RunFiles({}, tables.read_if_there(None, SUMMARY), tables.read_if_there(None, SWEEP))
    assert RUN_FIGURES[name](run) is None


@pytest.mark.quick(1)
@pytest.mark.parametrize("count", [1, 2])
def test_very_short_insertions_are_drawn(count: int, tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=count, truth=True), FakeCase("d", frames=count)))
    case = read_case(out / "cases" / "c")
    drawn = [name for name, figure in CASE_FIGURES.items() if figure(case) is not None]
    absent = {
        "scan_at_entry",
        "failed_projections",
        "simulated_wires",
        "views",
        "budget",
        "error_over_u",
        "release_frames",
    }
    assert set(CASE_FIGURES) - set(drawn) == absent
    run = RunFiles({"c": case.errors}, tables.read(out / "summary.csv", SUMMARY), tables.read_if_there(None, SWEEP))
    assert RUN_FIGURES["case_frame_map"](run) is not None


def _heat_case(tmp_path: Path) -> CaseFiles:
    arcs = [np.arange(0, 4.01, 0.5), np.append(np.arange(0, 6.0, 0.5), 6.2)]
    columns = {
        "frame": np.concatenate([np.full(len(a), 2 * i) for i, a in enumerate(arcs)]),
        "arc_mm": np.concatenate(arcs),
        "error_mm": np.concatenate([a / 10 for a in arcs]),
    }
    tables.write(tmp_path / "points.csv.gz", POINTS, columns)
    return _empty_case(tmp_path, samples=tables.read(tmp_path / "points.csv.gz", POINTS))


def swept(folder: Path, rows: list[dict[str, Any]]) -> Drawing:
    """What is drawn of these rows of sweep.csv."""
    tables.write(folder / "sweep.csv", SWEEP, rows)
    sweep = tables.read(folder / "sweep.csv", SWEEP)
    return draw(RUN_FIGURES["sensitivity"], RunFiles({}, tables.read_if_there(None, SUMMARY), sweep))


def lines_of(drawing: Drawing) -> dict[str, Any]:
    """The lines of a figure's first axes, by their labels."""
    return {str(line.get_label()): line for line in drawing.figure.axes[0].get_lines()}


def test_the_unchanged_value_is_a_point_of_the_curve(tmp_path: Path) -> None:
    """Two changed values that are equally bad were a flat line: what lies between them was not drawn."""
    rows = [{"parameter": "(plain)", "value": "", "case": c, "rms_mm": 0.1} for c in ("a", "b", "(all)")]
    for value in ("-15", "15"):
        changed = {"parameter": "simulate.roll_offset_deg", "value": value, "unchanged": "0"}
        rows += [{**changed, "case": c, "rms_mm": 0.25} for c in ("a", "b")]
        rows.append({**changed, "case": "(all)", "rms_mm": 0.25, "rms_ratio_low": 2.0, "rms_ratio_high": 3.0})
    lines = lines_of(swept(tmp_path, rows))
    assert lines["to the traced wire"].get_xydata().tolist() == [[-15.0, 0.25], [0.0, 0.1], [15.0, 0.25]]
    assert lines["unchanged"].get_xydata().tolist() == [[0.0, 0.1]]


def test_the_unchanged_value_has_its_ring_where_it_was_asked_for_too(tmp_path: Path) -> None:
    """``--sweep simulate.taper_scale=0.5,1,2`` had none."""
    rows = [{"parameter": "(plain)", "value": "", "case": "a", "rms_mm": 0.1}]
    rows += [
        {"parameter": "simulate.taper_scale", "value": value, "unchanged": "1", "case": "a", "rms_mm": rms}
        for value, rms in (("0.5", 0.2), ("1", 0.1), ("2", 0.3))
    ]
    lines = lines_of(swept(tmp_path, rows))
    assert lines["to the traced wire"].get_xydata().tolist() == [[0.5, 0.2], [1.0, 0.1], [2.0, 0.3]]
    assert lines["unchanged"].get_xydata().tolist() == [[1.0, 0.1]]


def test_no_case_of_a_sweep_is_cut_off_and_an_interval_that_goes_on_says_so(tmp_path: Path) -> None:
    """The axis ended above the pooled values: a case that was far off left the panel, as ends of intervals did."""
    rows = [{"parameter": "(plain)", "value": "", "case": c, "rms_mm": 0.1} for c in ("a", "b", "(all)")]
    for value, high in (("-15", 2.0), ("5", 700.0), ("15", np.nan)):
        changed = {"parameter": "simulate.roll_offset_deg", "value": value, "unchanged": "0"}
        rows += [{**changed, "case": "a", "rms_mm": 0.1}, {**changed, "case": "b", "rms_mm": 3.0}]
        rows.append({**changed, "case": "(all)", "rms_mm": 0.25, "rms_ratio_low": 1.5, "rms_ratio_high": high})
    drawing = swept(tmp_path, rows)
    axes = drawing.figure.axes[0]
    top = axes.get_ylim()[1]
    assert top > 3.0
    bars = {float(bar[0, 0]): bar[:, 1].tolist() for bar in axes.collections[0].get_segments()}
    assert bars == {
        -15.0: pytest.approx([0.15, 0.2]),
        5.0: pytest.approx([0.15, top]),
        15.0: pytest.approx([0.15, top]),
    }
    (arrows,) = [line for line in axes.get_lines() if line.get_marker() == "^"]
    assert arrows.get_xydata().tolist() == [[5.0, top], [15.0, top]]
    drawing.figure.canvas.draw()
    assert axes.get_position().width > 0.7


def test_a_skill_below_minus_one_is_drawn(tmp_path: Path) -> None:
    """The axis ended at -1, and the panel of a wire with skill -38.6 was empty."""
    out = write_run(tmp_path / "out", [FakeCase("c", frames=3)])
    path = out / "cases" / "c" / "errors.csv"
    errors = tables.read(path, ERRORS)
    for values in ([-38.6, -2.0, 0.5], [-0.9, 0.1, 0.5], [-1.2, -1.1, -1.05]):
        tables.write(path, ERRORS, errors.assign(skill=values, skill_strongest=np.nan))
        drawing = draw(CASE_FIGURES["skill_by_depth"], read_case(path.parent))
        left = drawing.figure.axes[0]
        low, high = left.get_ylim()
        assert low < min(values)
        assert high > 1.0
        drawing.figure.canvas.draw()
        ticks = [label.get_text() for label in left.get_yticklabels()]
        assert "-1" in ticks or min(values) > -1.0
        assert ("logarithmic" in left.get_ylabel()) == (min(values) < -1.0)


def test_the_caption_says_where_colours_of_forces_end() -> None:
    (entry,) = [entry for entry in declared("case") if entry["figure"] == "contact_along_wire"]
    assert f"{_CLIP_PERCENTILE:g}th percentile" in entry["read"]


def test_no_force_is_another_colour_than_a_little_one(tmp_path: Path) -> None:
    """Both were pale violet: a wire that lies free looked as if it touched all along."""
    case = _heat_case(tmp_path)
    assert case.samples is not None
    size = np.where(case.samples["arc_mm"] < 2.0, 0.0, 1e-4)
    drawing = draw(CASE_FIGURES["contact_along_wire"], replace(case, samples=case.samples.assign(contact_force_N=size)))
    forces, none = (np.ma.masked_invalid(mesh.get_array()) for mesh in drawing.figure.axes[0].collections)
    assert forces.min() > 0.0
    assert none.count() > 0
    assert not (~np.ma.getmaskarray(forces) & ~np.ma.getmaskarray(none)).any()
    assert none.count() + forces.count() == len(drawing.table)


def test_a_table_of_forces_tells_refused_frames_from_others(tmp_path: Path) -> None:
    case = _heat_case(tmp_path)
    assert case.samples is not None
    errors = pd.DataFrame({"frame": [0, 2], "status": ["ok", "no_wire"]})
    forces = case.samples.assign(contact_force_N=1.0)
    drawing = draw(CASE_FIGURES["contact_along_wire"], replace(case, samples=forces, errors=errors))
    told = {*zip(drawing.table["frame"], drawing.table["status"], strict=True)}
    assert told == {(0, "ok"), (2, "no_wire")}
    (crosses,) = drawing.figure.axes[0].lines
    assert list(crosses.get_ydata()) == [2], "the wire of a refused frame was drawn as any other"


def test_a_refused_frame_without_a_wire_has_a_cross_in_its_row(tmp_path: Path) -> None:
    """Its row was blank, as of a frame that nobody refused; the last one had no row at all."""
    case = _heat_case(tmp_path)
    assert case.samples is not None
    errors = pd.DataFrame({"frame": [0, 1, 2, 3], "status": ["ok", "no_wire", "ok", "no_wire"]})
    forces = case.samples.assign(contact_force_N=1.0)
    drawing = draw(CASE_FIGURES["contact_along_wire"], replace(case, samples=forces, errors=errors))
    (crosses,) = drawing.figure.axes[0].lines
    assert list(crosses.get_ydata()) == [1, 3]
    assert drawing.table[drawing.table["status"] == "no_wire"]["frame"].tolist() == [1, 3]


def test_long_names_leave_room_for_what_is_drawn(tmp_path: Path) -> None:
    """Ids of 100 letters left the cells an inch, in which their numbers overlapped, and cut the colour bar's label."""
    names = ["a" * 100, "b" * 99 + "c"]
    out = write_run(tmp_path, [FakeCase(name, frames=3) for name in names])
    errors = {name: read_case(out / "cases" / name).errors for name in names}
    run = RunFiles(errors, tables.read(out / "summary.csv", SUMMARY), tables.read_if_there(None, SWEEP))
    drawing = RUN_FIGURES["case_frame_map"](run)
    assert drawing is not None
    drawing.figure.canvas.draw()
    cells, bar = drawing.figure.axes
    assert cells.get_position().width > 0.5
    assert [one.get_text()[-2:] for one in cells.get_yticklabels()] == ["aa", "bc"]
    edge = drawing.figure.bbox
    assert bar.yaxis.label.get_window_extent().y0 >= edge.y0
    assert bar.yaxis.label.get_window_extent().y1 <= edge.y1
    assert set(drawing.table["case"]) == set(names), "whole in the table beside it"


def test_long_names_that_differ_in_their_middle_are_drawn_with_their_place() -> None:
    """Two insertions of one phantom on one day were drawn alike."""
    sides = [f"phantom-03_insertion-from-the-{side}_wire-{n}_2026-01-01T10" for n, side in enumerate(("left", "right"))]
    short = "phantom-03_insertio\u2026026-01-01T10"
    assert drawn_names(["a", *sides, "b" * 32]) == ["a", f"2: {short}", f"3: {short}", "b" * 32]
    assert drawn_names(sides[:1]) == [short]


def test_heat_map_shows_each_sample_at_its_place(tmp_path: Path) -> None:
    drawing = draw(CASE_FIGURES["error_along_wire"], _heat_case(tmp_path))
    shown = drawing.table
    np.testing.assert_allclose(shown["error_mm"], shown["arc_mm"] / 10, rtol=0.0, atol=0.5 / 10 / 2 + 1e-9)
    assert shown["frame"].unique().tolist() == [0, 2], "the frame without points stays empty"
    reach = shown.groupby("frame")["arc_mm"].max()
    assert reach[0] == 4.0
    assert abs(reach[2] - 6.2) <= 0.25 + 1e-9, "the last sample is shown although it is off the lattice"
    mesh = drawing.figure.axes[0].collections[0]
    grid = np.ma.filled(np.ma.masked_invalid(mesh.get_array()), -1.0)
    assert grid.shape[0] == 3
    assert np.all(grid[1] == -1.0)


def test_colours_of_errors_mean_the_same_in_every_run(tmp_path: Path) -> None:
    """They were stretched to the largest of each run: two runs' pictures could not be compared."""
    scales = set()
    for name, error in (("near", 0.02), ("far", 3.0)):
        out = write_run(tmp_path / name, [FakeCase("c", frames=3, error_mm=error)])
        case = read_case(out / "cases" / "c")
        run = RunFiles({"c": case.errors}, tables.read(out / "summary.csv", SUMMARY), tables.read_if_there(None, SWEEP))
        drawings = CASE_FIGURES["error_along_wire"](case), RUN_FIGURES["case_frame_map"](run)
        meshes = [drawing.figure.axes[0].collections[0] for drawing in drawings if drawing is not None]
        scales |= {(type(mesh.norm).__name__, mesh.norm.vmin, mesh.norm.vmax) for mesh in meshes}
        assert len(meshes) == 2
        assert all(np.nanmin(np.ma.filled(mesh.get_array(), np.nan)) >= ERROR_SCALE_MM[0] for mesh in meshes)
    assert scales == {("LogNorm", *ERROR_SCALE_MM)}
    said = "from {:g} mm and less to {:g} mm and more".format(*ERROR_SCALE_MM)
    entries = {entry["figure"]: entry["read"] for page in ("case", "run") for entry in declared(page)}
    assert all(said in entries[name] for name in ("error_along_wire", "case_frame_map"))


def test_where_no_lumen_was_found_the_scan_is_shown_at_the_entry(tmp_path: Path) -> None:
    """The page had no picture at all. The entry may lie beside the scan, which is then what is to be seen."""
    slabs = {axis: np.full(np.delete((20, 24, 28), axis), 40 * axis + 40, np.uint8) for axis in range(3)}
    scan = ScanCrop(np.full(3, 0.5), np.zeros(3), np.eye(3), (20, 24, 28), entry_slabs=slabs)
    write_frames(tmp_path / "frames.h5", scan, [FrameArrays(0)])
    for x in (5.0, 40.0):
        entry = {"entry_mm": [x, 6.0, 0.0], "entry_direction": [0.0, 0.0, 2.0]}
        read = read_scan(tmp_path / "frames.h5")
        drawing = draw(CASE_FIGURES["scan_at_entry"], _empty_case(tmp_path, scan=read, result={"entry": entry}))
        assert drawing.table.iloc[0][["x_mm", "y_mm", "z_mm"]].tolist() == [x, 6.0, 0.0]
        front = drawing.figure.axes[0]
        assert front.get_xlim()[0] < x < front.get_xlim()[1]
        assert front.images[0].get_array().shape == (28, 20)
        assert front.get_lines()[0].get_xydata()[0].tolist() == [x, 0.0]


def test_one_scored_frame_shows_its_predictors(tmp_path: Path) -> None:
    case = read_case(write_run(tmp_path, [FakeCase("one", frames=1)]) / "cases" / "one")
    drawing = draw(CASE_FIGURES["error_by_depth"], case)
    lines = drawing.figure.axes[0].get_lines()
    assert len(lines) > 3
    assert all(line.get_marker() not in ("", "None", None) for line in lines)


@pytest.mark.slow
def test_the_cells_of_few_frames_have_their_numbers(tmp_path: Path) -> None:
    """0.27 and 1.26 mm were two shades of magenta."""
    for frames, numbers in ((3, ["0.27", "1.26", "12"]), (17, [])):
        out = write_run(tmp_path / str(frames), [FakeCase("c", frames=frames)])
        errors = read_case(out / "cases" / "c").errors
        errors.loc[:2, "p95_mm"] = [0.27, 1.256, 12.3]
        summary = tables.read(out / "summary.csv", SUMMARY)
        drawing = draw(
            RUN_FIGURES["case_frame_map"], RunFiles({"c": errors}, summary, tables.read_if_there(None, SWEEP))
        )
        assert [text.get_text() for text in drawing.figure.axes[0].texts] == numbers


def test_the_clamps_reach_is_grey_as_it_is_not_scored(tmp_path: Path) -> None:
    case = _heat_case(tmp_path)
    case = replace(case, samples=case.points[case.points["arc_mm"] >= 2.0])
    drawing = draw(CASE_FIGURES["error_along_wire"], case)
    assert drawing.table["arc_mm"].min() == pytest.approx(2.0, abs=0.25)
    grey = [bar.get_width() for bar in drawing.figure.axes[0].patches]
    assert grey == pytest.approx([2.0, 0.0, 2.0], abs=0.25), "what was white in front could as well be beyond a tip"


@pytest.mark.parametrize("direction", [np.eye(3), TURN], ids=["aligned", "oblique"])
def test_curves_fall_on_the_voxels_they_run_through(direction: np.ndarray) -> None:
    scan = ScanCrop(np.array([0.5, 0.8, 1.1]), np.array([10.0, -20.0, 5.0]), direction, (12, 9, 7))
    index = np.array([[3, 4, 5], [11, 8, 6], [0, 0, 0]])
    points = scan.origin_mm + (index * scan.spacing_mm) @ direction.T
    view = _planes.whole(scan)
    place = view.coordinates(points)
    for plane in _planes.PLANES:
        axis, across, up = plane
        picture = np.zeros(scan.shape, np.uint8)
        picture[tuple(index.T)] = 1
        projected = picture.max(axis=axis)
        left, right, bottom, top = view.extent(plane)
        columns = (place[:, across] - left) / (right - left) * projected.shape[0]
        rows = (place[:, up] - bottom) / (top - bottom) * projected.shape[1]
        found = projected[np.floor(columns).astype(int), np.floor(rows).astype(int)]
        assert found.tolist() == [1, 1, 1]
        np.testing.assert_allclose(columns % 1, 0.5, rtol=0.0, atol=1e-9)
    assert view.aligned == bool(np.array_equal(direction, np.eye(3)))
    assert ("LPS" in view.label(0)) or ("left" in view.label(0)) == view.aligned


def test_views_follow_the_curves_and_stay_in_the_crop() -> None:
    scan = ScanCrop(np.ones(3), np.zeros(3), np.eye(3), (50, 50, 50))
    curve = np.array([[10.0, 20.0, 1.0], [12.0, 20.0, 30.0]])
    view = _planes.around(scan, [curve])
    np.testing.assert_allclose(view.low, [5.0, 15.0, -0.5])
    np.testing.assert_allclose(view.high, [17.0, 25.0, 35.0])
    for nothing in ([], [curve + 500.0]):
        outside = _planes.around(scan, nothing)
        np.testing.assert_allclose(outside.size, 50.0)


def test_a_band_is_two_sigma_to_both_sides_however_the_scan_is_turned() -> None:
    scan = ScanCrop(np.full(3, 0.5), np.zeros(3), TURN, (40, 40, 40))
    curve = np.linspace(0.0, 10.0, 21)[:, None] * np.array([1.0, 2.0, 2.0]) / 3.0
    for plane in _planes.PLANES:
        axes = Figure().subplots()
        _planes.whole(scan).band(axes, curve, np.tile(0.2**2 * np.eye(3), (21, 1, 1)), plane, alpha=0.5)
        outline = axes.patches[0].get_xy()[:42]
        width = np.linalg.norm(outline[:21] - outline[21:][::-1], axis=1)
        np.testing.assert_allclose(width, 4 * 0.2, rtol=1e-9)


def test_a_case_stands_beside_the_predictor_that_came_nearest() -> None:
    """The centreline alone was there: 1.3 mm beside another predictor's 0.3."""
    row = {"role": "validation", "rms_mm": 0.2, "null_centreline_rms_mm": 1.3, "null_previous_rms_mm": 0.3}
    cases = [{"case": "a", **row, "strongest_null": "previous"}, {"case": "b", **row}]
    summary = pd.DataFrame(cases).reindex(columns=SUMMARY.names)
    drawing = draw(RUN_FIGURES["cases_by_error"], RunFiles({}, summary, tables.read_if_there(None, SWEEP)))
    np.testing.assert_array_equal(drawing.table["strongest_rms_mm"], [0.3, np.nan])
    (marks,) = [line for line in drawing.figure.axes[0].lines if line.get_label() == "its strongest predictor"]
    np.testing.assert_array_equal(marks.get_xdata(), [0.3, np.nan])


def test_a_strip_without_a_nearest_says_so() -> None:
    where = pd.DataFrame({"along": "depth", "simulator": list("ab"), "low_mm": 0.0, "high_mm": 5.0, "rms_mm": 0.1})
    for lead, words in ((NEVER_NEAREST[0], 1), ("clear", 0)):
        axes = Figure().subplots()
        _nearest(axes, where.assign(lead=[lead, None]), {"a": "red", "b": "blue"})
        assert len(axes.texts) == words
        assert len(axes.patches) == 1 - words


def test_lines_of_simulators_that_coincide_are_all_seen() -> None:
    """Of two the same one alone was seen where their gaps fell together, and marks hid each other."""
    rows = [
        {"along": along, "simulator": name, "low_mm": low, "high_mm": low + 5.0, "rms_mm": 0.1, "lead": None}
        | {"middle_mm": low + 1.0}
        for along in ("distance from the earliest tip", "insertion depth")
        for name in ("a", "b", "c")
        for low in (0.0, 5.0)
    ]
    drawing = draw(who_is_nearest, SimulatorFiles(pd.DataFrame(), pd.DataFrame(rows)))
    lines = drawing.figure.axes[0].lines
    assert len({line.get_marker() for line in lines}) == 3
    for looks in (line.get_linewidth() for line in lines), (line.get_markersize() for line in lines):
        widths = list(looks)
        assert widths == sorted(set(widths), reverse=True), "each is narrower than the one that it lies on"


def test_u_val_has_one_colour(tmp_path: Path) -> None:
    """Its bar had the traced wire's, its line over the depth another."""
    tables.write(tmp_path / "budget.csv", BUDGET, [{"source": "u_val", "u_mm": 0.2, "distal_u_mm": 0.3}])
    drawing = draw(CASE_FIGURES["budget"], _empty_case(tmp_path))
    (line,) = [look for column, _, look in lines("error_by_depth") if column == "u_val_mm"]
    assert drawing.figure.axes[0].patches[0].get_facecolor() == to_rgba(line["color"])


def test_a_budget_is_drawn_by_source_and_by_entry(tmp_path: Path) -> None:
    rows = [{"source": n, "sigma": "", "u_mm": u, "distal_u_mm": 2 * u} for n, u in (("roll", 0.1), ("error", 0.2))]
    tables.write(tmp_path / "budget.csv", BUDGET, rows)
    case = _empty_case(tmp_path)
    drawing = draw(CASE_FIGURES["budget"], case)
    (left,) = drawing.figure.axes
    assert [bar.get_width() for bar in left.patches] == [0.1, 0.2, 0.2, 0.4]
    assert [text.get_text() for text in left.get_legend().get_texts()] == ["whole wire", "last 10 mm"]
    entry = {"clamp": "estimated", "depth": "traced", "frames": 3, "rms_mm": 0.1, "distal10_rms_mm": 0.2}
    tables.write(tmp_path / "entries.csv", ENTRIES, [entry | {"tip_median_mm": 0.3}])
    both = draw(CASE_FIGURES["budget"], case)
    assert len(both.figure.axes) == 2
    handed_in = replace(case, result={"inputs": [{"key": "simulated.files[0]", "path": "a.csv", "sha256": ""}]})
    assert CASE_FIGURES["budget"](handed_in) is None, "it is of our solver's wire"


def test_marks_at_the_end_of_four_entries_are_whole(tmp_path: Path) -> None:
    """Four like distances far from 0 had a margin of a twentieth of their range: squares were cut by the frame."""
    far = dict.fromkeys(("rms_mm", "distal10_rms_mm", "tip_median_mm"), 0.15)
    tables.write(tmp_path / "entries.csv", ENTRIES, [{"clamp": "manifest", "depth": "traced"} | far])
    drawing = draw(CASE_FIGURES["budget"], _empty_case(tmp_path))
    assert drawing.figure.axes[0].get_xlim() == pytest.approx((0.0, 0.165))
    dot, square, _ = drawing.figure.axes[0].get_lines()
    assert square.get_fillstyle() == "none", "a dot at the same place was hidden"
    assert square.get_markersize() - square.get_markeredgewidth() > dot.get_markersize() + 1.0


def test_only_what_was_computed_of_a_budget_is_drawn(tmp_path: Path) -> None:
    """With budget.members_alone = 4 eight names stood beside no bar, the first of them on the frame."""
    rows: list[dict[str, Any]] = [{"source": name, "sigma": ""} for name in ("clamp", "roll")]
    rows += [{"source": n, "sigma": "", "u_mm": 0.1, "distal_u_mm": 0.2} for n in ("inputs", "u_val", "error")]
    tables.write(tmp_path / "budget.csv", BUDGET, rows)
    drawing = draw(CASE_FIGURES["budget"], _empty_case(tmp_path))
    (axes,) = drawing.figure.axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["inputs", "all: u val", "error"]
    assert axes.get_ylim() == (2.5, -0.5)
    assert len(drawing.table) == 5
    said = [s["read"] for s in draw_sections("case", _empty_case(tmp_path), tmp_path, False) if s["figure"] == "budget"]
    assert "Inputs without a bar were not computed alone" in said[0]


def test_no_caption_speaks_of_u_val_where_no_bar_is_of_it(tmp_path: Path) -> None:
    """What a bad one looks like was told of twice u val beside the marks of clamp and depth alone."""
    entry = {"clamp": "estimated", "depth": "traced", "frames": 3, "rms_mm": 0.1, "distal10_rms_mm": 0.2}
    tables.write(tmp_path / "entries.csv", ENTRIES, [entry | {"tip_median_mm": 0.3}])
    said = {s["figure"]: s["read"] + s["bad"] for s in draw_sections("case", _empty_case(tmp_path), tmp_path, False)}
    assert "from the manifest" in said["budget"]
    assert "u val" not in said["budget"]
    sources = [{"source": n, "sigma": "", "u_mm": 0.1, "distal_u_mm": 0.2} for n in ("roll", "u_val", "error")]
    tables.write(tmp_path / "budget.csv", BUDGET, sources)
    said = {s["figure"]: s["bad"] for s in draw_sections("case", _empty_case(tmp_path), tmp_path, False)}
    assert "twice u val" in said["budget"]


@pytest.mark.parametrize(("roll", "ends", "said"), [(0.1, 0.2, False), (0.4, 0.2, True), (0.1, 0.5, True)])
def test_a_source_that_is_larger_than_all_of_them_is_explained(
    roll: float, ends: float, said: bool, tmp_path: Path
) -> None:
    """It looked like an error of the table. u_val and the error may be larger than the inputs, of course."""
    rows = [("roll", roll, ends), ("inputs", 0.3, 0.4), ("u_val", 0.5, 0.6), ("error", 0.9, 0.9)]
    table = [{"source": n, "sigma": "", "u_mm": u, "distal_u_mm": distal} for n, u, distal in rows]
    tables.write(tmp_path / "budget.csv", BUDGET, table)
    drawn = {s["figure"]: s["read"] for s in draw_sections("case", _empty_case(tmp_path), tmp_path, False)}
    assert ("inputs do not add up" in drawn["budget"]) == said


def test_release_frames_show_both_probabilities(tmp_path: Path) -> None:
    errors = {"frame": [0, 1], "status": ["ok", "ok"], "insertion_mm": [5.0, 9.0], "release": [np.nan, 0.7]}
    tables.write(tmp_path / "errors.csv", ERRORS, pd.DataFrame(errors | {"release_real": [np.nan, 0.3]}))
    drawing = draw(
        CASE_FIGURES["release_frames"], _empty_case(tmp_path, errors=tables.read(tmp_path / "errors.csv", ERRORS))
    )
    assert drawing.table["frame"].tolist() == [1]
    lines = drawing.figure.axes[0].get_lines()
    assert [list(line.get_ydata()) for line in lines] == [[0.7], [0.3]]


@pytest.mark.parametrize(
    ("direction", "labels"),
    [
        (np.eye(3), ["x, towards left, mm", "y, towards back, mm", "z, towards head, mm"]),
        (np.diag([-1, -1, 1]), ["axis 0, towards right, mm", "axis 1, towards front, mm", "axis 2, towards head, mm"]),
        (TURN, ["axis 0, about front, mm", "axis 1, about head, mm", "axis 2, about right, mm"]),
    ],
)
def test_the_axes_of_an_oblique_scan_say_which_way_they_run(direction: np.ndarray, labels: list[str]) -> None:
    """They were called array axis 0, 1 and 2."""
    view = _planes.whole(ScanCrop(np.ones(3), np.zeros(3), direction, (4, 4, 4)))
    assert [view.label(axis) for axis in range(3)] == labels


def test_projections_choose_first_middle_last_and_worst(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=9, failed=(0,)),))
    path = out / "cases" / "c" / "errors.csv"
    errors = tables.read(path, ERRORS)
    errors.loc[errors["frame"] == 3, "p95_mm"] = 99.0
    tables.write(path, ERRORS, errors)
    case = read_case(path.parent)
    drawing, failed = (draw(CASE_FIGURES[name], case) for name in ("projections", "failed_projections"))
    titles = [axes.get_title(loc="left") for axes in drawing.figure.axes]
    assert [t for t in titles if "frame" in t] == [
        "frame 1 (first ok)",
        "frame 3 (worst)",
        "frame 5 (middle)",
        "frame 8 (last)",
    ]
    assert any(axes.get_title(loc="left") == "frame 0 (no_wire)" for axes in failed.figure.axes)


def test_frames_that_failed_at_both_ends_have_rows(tmp_path: Path) -> None:
    """The map of errors ended at the last frame that is ok, as if there were no other."""
    out = write_run(tmp_path / "out", (FakeCase("c", frames=6, failed=(0, 5)),))
    case = read_case(out / "cases" / "c")
    for name in ("error_along_wire", "contact_along_wire"):
        (rows,) = draw(CASE_FIGURES[name], case).frames
        assert list(rows.of_frame) == [*range(6)], name
        low, high = sorted(rows.axes.get_ylim())
        assert (low, high) == (-0.5, 5.5), name
    titles = [axes.get_title(loc="left") for axes in draw(CASE_FIGURES["projections"], case).figure.axes]
    assert [title for title in titles if "frame" in title][-1].startswith("frame 4 (last ok")


def test_failed_frames_are_marked_and_their_values_not_drawn(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("c", frames=6, failed=(2,)),))
    drawing = draw(CASE_FIGURES["error_by_depth"], read_case(out / "cases" / "c"))
    lines = lines_of(drawing)
    assert len(lines["frame without result"].get_xdata()) == 1
    assert len(lines["simulated to traced, rms"].get_xdata()) == 5
    assert len(drawing.table) == 6


def test_frames_file_reads_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    scan = ScanCrop(np.array([0.3, 0.4, 0.5]), rng.normal(size=3), TURN, (4, 5, 6), {1: np.eye(4, 6, dtype=np.uint8)})
    curve, picture = rng.normal(size=(7, 3)), rng.integers(0, 255, (5, 6), dtype=np.uint8)
    arrays = {"contact_force_N": curve, "mips": {0: picture}, "status": "trace_low_contrast"}
    frames = (FrameArrays(n, traced_mm=curve + n, **arrays) for n in (11, 2))
    write_frames(tmp_path / "frames.h5", scan, frames)
    back = read_scan(tmp_path / "frames.h5")
    assert back is not None
    assert (back.shape, list(back.lumen_mips)) == ((4, 5, 6), [1])
    assert repr(back).startswith("ScanCrop((4, 5, 6), voxels of 0.3 x 0.4 x 0.5 mm, origin ["), "a dump of its pictures"
    np.testing.assert_array_equal(back.direction, TURN)
    np.testing.assert_allclose(back.to_index(scan.origin_mm + TURN @ (scan.spacing_mm * [1, 2, 3])), [1, 2, 3])
    assert frame_numbers(tmp_path / "frames.h5") == (2, 11)
    frame = read_frame(tmp_path / "frames.h5", 11)
    np.testing.assert_array_equal(frame.traced_mm, curve + 11)
    np.testing.assert_array_equal(frame.mips[0], picture)
    assert frame.simulated_mm is None
    assert repr(frame).startswith("FrameArrays(frame 11, trace_low_contrast, traced_mm (7, 3)"), "a wire like any other"
    with h5py.File(tmp_path / "frames.h5", "r+") as file:
        del file["frames/011"].attrs["status"]
    assert read_frame(tmp_path / "frames.h5", 11).status == "", "of an older version"


def test_every_dataset_of_a_frames_file_says_its_unit(tmp_path: Path) -> None:
    """A covariance had "1", a projection nothing."""
    picture, square = np.zeros((4, 4), np.uint8), np.zeros((2, 3, 3))
    arrays = {"traced_mm": square[0], "contact_force_N": square[0], "trace_flags": np.zeros(3)}
    straight = Straightened(np.zeros((2, 4, 4), np.uint8), 0.5, 0.2, np.array([1.0, 0.0, 0.0]))
    frame = FrameArrays(0, covariance_mm2=square, mips={0: picture}, straightened=straight, **arrays)
    scan = ScanCrop(np.ones(3), np.zeros(3), np.eye(3), (4, 4, 4), {1: picture})
    write_frames(tmp_path / "frames.h5", scan, [frame])
    found: dict[str, str] = {}

    def look(name: str, one: Any) -> None:
        if isinstance(one, h5py.Dataset):
            found[name.split("/")[-1]] = one.attrs["unit"]

    with h5py.File(tmp_path / "frames.h5") as file:
        file.visititems(look)
    grey = dict.fromkeys(("lumen_mip_1", "mip_0", "straightened", "trace_flags"), "1")
    assert found == grey | {"traced_mm": "mm", "contact_force_N": "N", "covariance_mm2": "mm^2"}


def test_colours_are_told_apart_by_dichromats() -> None:
    """Machado et al. (2009), severity 1: neighbours in a legend stay apart for protan and deutan readers."""
    matrices = (
        np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
        np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]),
    )
    stages = [np.array(to_rgba(c)[:3]) for c in STAGE_COLOURS.values()]
    for matrix in (np.eye(3), *matrices):
        seen = np.array([matrix @ _linear(c) for c in stages])
        apart = np.linalg.norm(seen[:, None] - seen[None], axis=2) + np.eye(len(seen))
        assert apart.min() > 0.08
    rivals = list(predictors())
    assert len({(style, marker) for _, _, _, style, marker in rivals}) == len(rivals) == 4


def _linear(colour: np.ndarray) -> np.ndarray:
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize(("values", "scale"), [([0.1, 0.2], "linear"), ([0.01, 3.0], "log"), ([0.0, np.nan], "linear")])
def test_axes_are_logarithmic_only_where_values_span_decades(values: list[float], scale: str) -> None:
    axes = Figure().subplots()
    positive_axis(axes, [values])
    assert axes.get_yscale() == scale


def test_equal_curves_do_not_stretch_an_axis_down_to_rounding() -> None:
    """Errors of 1e-16 mm took twelve decades of the axis."""
    figure = Figure()
    axes = figure.subplots()
    (line,) = axes.plot([0, 1, 2], [1e-16, 0.01, 0.2])
    positive_axis(axes, [[1e-16, 0.01, 0.2]])
    assert axes.get_ylim()[0] > 5e-4
    assert np.min(line.get_ydata()) == LEAST_MM
    assert axes.yaxis.get_major_formatter()(LEAST_MM) == "\u2264 0.001"
    assert axes.yaxis.get_major_formatter()(0.01) == "0.01"
    axes = figure.subplots()
    positive_axis(axes, [[1e-16, 3e-16]])
    assert axes.get_ylim() == (0.0, LEAST_MM)


def test_panels_that_share_an_axis_have_room_for_all_of_them() -> None:
    """It ended above the first one's values: a bin of the second left its panel."""
    first, second = Figure().subplots(1, 2, sharey=True)
    first.plot([0, 1], [0.1, 0.15])
    second.plot([0, 1], [0.1, 0.2])
    positive_axis(first, [[0.1, 0.15, 0.2]])
    assert second.get_ylim()[1] > 0.2


def test_no_line_crosses_a_bin_in_which_nothing_was_measured() -> None:
    bins = pd.DataFrame({"low_mm": [5.0, 10.0, 20.0], "high_mm": [10.0, 15.0, 25.0], "rms_mm": [0.1, 0.2, 0.3]})
    bins["middle_mm"] = [9.0, np.nan, 24.9]  # in the file of an earlier version it is missing
    middles, errors = unbroken(bins)
    assert middles == [9.0, 12.5, 17.5, 24.9]
    np.testing.assert_array_equal(errors, [0.1, 0.2, np.nan, 0.3])


def test_the_largest_of_nearly_equal_values_has_room_for_its_marker() -> None:
    """The axis ended 0.05 of their span above it, and cut it in half."""
    axes = Figure().subplots()
    axes.plot([0, 1, 2], [0.1, 0.101, 0.1005], marker="o")
    positive_axis(axes, [[0.1, 0.101, 0.1005]])
    low, high = axes.get_ylim()
    assert low == 0.0
    assert high > 1.04 * 0.101


def test_errors_have_the_colours_of_the_viewer_in_figures(tmp_path: Path) -> None:
    """They had two scales: blue to pink in the viewer, dark to bright in the maps."""
    case = read_case(write_run(tmp_path / "out", (FakeCase("c", frames=3),)) / "cases" / "c")
    drawing = draw(CASE_FIGURES["error_along_wire"], case)
    (mesh,) = (c for axes in drawing.figure.axes[:1] for c in axes.collections)
    ends = [to_hex(mesh.cmap(end)) for end in (0.0, 1.0)]
    assert ends == [colours.SIMULATED.lower(), colours.FAR.lower()]


def test_pictures_of_scans_keep_white_and_the_colours_of_the_curves(tmp_path: Path) -> None:
    sizes = []
    for scans in (False, True):
        figure = _drawing.new_figure(2.0, 3.0, fitted=False)
        axes = figure.add_axes((0.1, 0.1, 0.8, 0.8))
        axes.imshow(np.random.default_rng(0).integers(0, 120, (90, 120)), cmap="gray", vmin=0, vmax=255)
        axes.plot([0, 110], [40, 40], color=TRACED, linewidth=6)
        path = tmp_path / f"{scans}.png"
        _drawing.save(_drawing.Drawing(figure, pd.DataFrame({"a": [1]}), scans), path)
        sizes.append(path.stat().st_size)
    pixels = np.asarray(Image.open(path).convert("RGB"))
    exact = np.asarray(Image.open(tmp_path / "False.png").convert("RGB"))
    assert pixels[0, 0].tolist() == [255, 255, 255]
    assert np.any(np.all(pixels == (np.array(to_rgba(TRACED)[:3]) * 255).round(), axis=-1))
    assert np.abs(pixels.astype(int) - exact).max() <= 24
    assert sizes[1] < 0.6 * sizes[0]


@pytest.mark.slow
def test_panels_of_scans_are_known_and_no_other_figure_has_any(tmp_path: Path) -> None:
    """Maps of errors and correlations stayed light on a dark page, as the paper around scans did."""
    case = read_case(write_run(tmp_path / "out", (FakeCase("c", frames=3),)) / "cases" / "c")
    sections = {one["figure"]: one for one in draw_sections("case", case, tmp_path, embed=False)}
    assert {name for name, one in sections.items() if one["kept"]} == {"projections"}
    scans = Image.open(tmp_path / "figures" / "projections.png").convert("RGB")
    kept = np.array(sections["projections"]["kept"])
    assert len(kept) == 4 * 3, "three projections and the tip, of three frames"
    for left, top, width, height in kept:
        inside = np.array([left + 0.5 * width, top + 0.5 * height]) * scans.size
        above = np.array([left + 0.9 * width, top - 0.004]) * scans.size
        assert scans.getpixel(tuple(above.astype(int).tolist())) == (255, 255, 255)
        assert scans.getpixel(tuple(inside.astype(int).tolist())) != (255, 255, 255)


def test_scans_are_shown_as_bright_as_they_are_kept() -> None:
    """A window of each picture's own ended below the few pixels of a short wire: it was as white as the bone."""
    picture = np.full((40, 50), 150, np.uint8)
    picture[20, 25] = 255
    axes = Figure().subplots()
    scan = ScanCrop(np.ones(3), np.zeros(3), np.eye(3), (40, 30, 50))
    _planes.whole(scan).show(axes, FrameArrays(0, mips={1: picture}), _planes.PLANES[0])
    assert axes.images[0].get_clim() == (0, 255)


def test_every_parameter_of_a_calibration_has_a_panel() -> None:
    """The depth that is added had none: six parameters, and five panels."""
    row = {"value": 1.0, "prior": 1.0, "sd": 0.1, "seen": True, "logarithmic": False}
    rows = [{"name": name, **row} for name in ("taper", "depth_offset_mm")]
    record = {"estimates": rows, "profiles": {"taper": [[0.9, 1.2], [1.1, 0.9]]}}
    drawing = draw(figures_of("calibration")["profiles"], record)
    panels = {axes.get_title(): axes.get_lines()[0] for axes in drawing.figure.axes}
    assert list(panels) == ["taper", "depth_offset_mm"]
    assert panels["taper"].get_xydata().tolist() == [[0.9, 1.2], [1.0, 0.0], [1.1, 0.9]]
    assert panels["depth_offset_mm"].get_linestyle() == "--"
    values, rises = panels["depth_offset_mm"].get_xydata().T
    np.testing.assert_allclose(rises, ((values - 1.0) / 0.1) ** 2, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(values[[0, -1]], [0.7, 1.3], rtol=0.0, atol=1e-12, err_msg="three deviations each way")
    (entry,) = [entry for entry in declared("calibration") if entry["figure"] == "profiles"]
    assert "dashed curve" in caption(entry["read"], drawing.table)
    assert "dashed curve" not in caption(entry["read"], drawing.table.query("parameter == 'taper'"))


def test_an_axis_of_a_calibration_ends_where_values_end() -> None:
    """Friction went down to -0.2; what is not seen was said in a red that cannot be read on a dark page."""
    row = {"name": "friction", "value": 0.02, "prior": 0.0, "sd": 0.08, "seen": False, "logarithmic": False}
    record = {"estimates": [row | {"bounds": [0.0, 0.5]}], "profiles": {"friction": [[0.0, 0.1], [0.1, 1.0]]}}
    drawing = draw(figures_of("calibration")["profiles"], record)
    low, high = drawing.figure.axes[0].get_xlim()
    assert -0.02 < low < 0.0, "the line of what is stated lies within"
    assert high == pytest.approx(0.26)
    title = drawing.figure.axes[0].title
    assert (title.get_text(), title.get_color(), title.get_weight()) == ("friction: not seen", "black", "bold")


@pytest.mark.quick(1)
@pytest.mark.parametrize(("cases", "said"), [(1, False), (2, True)])
def test_a_caption_says_only_what_is_drawn_of_the_cases(cases: int, said: bool, tmp_path: Path) -> None:
    """It told of thin lines beside a single one."""
    out = write_run(tmp_path / "out", tuple(FakeCase(f"c{n}", frames=3) for n in range(cases)))
    errors = {f"c{n}": read_case(out / "cases" / f"c{n}").errors for n in range(cases)}
    run = RunFiles(errors, tables.read(out / "summary.csv", SUMMARY), tables.read_if_there(None, SWEEP))
    drawing = draw(RUN_FIGURES["planned_within"], run)
    (entry,) = [entry for entry in declared("run") if entry["figure"] == "planned_within"]
    assert ("thin: each case" in caption(entry["read"], drawing.table)) == said
    assert len(drawing.figure.axes[0].get_lines()) == 1 + said * cases
    names = [ALL, "c0", "c1"] if said else ["c0"]
    assert [*drawing.table["case"].unique()] == names, "rows were of nobody"


@pytest.mark.quick(1)
@pytest.mark.parametrize("frame", [None, 1])
def test_the_caption_speaks_of_a_cross_where_there_is_one(frame: int | None, tmp_path: Path) -> None:
    """It named "a filled cross" in cases whose tips all lie in the right branch."""
    out = write_run(tmp_path / "out", [FakeCase("c", frames=3)])
    path = out / "cases" / "c" / "errors.csv"
    errors = tables.read(path, ERRORS)
    known = 0.1 if frame is None else math.nan
    tables.write(path, ERRORS, errors.assign(branch_ok=[n != frame for n in range(3)], tip_sigma_mm=known))
    drawing = draw(CASE_FIGURES["tip_by_depth"], read_case(path.parent))
    (entry,) = [entry for entry in declared("case") if entry["figure"] == "tip_by_depth"]
    line = "The thin line is how well the traced tip is known"
    assert (line in caption(entry["read"], drawing.table)) == (frame is None), "the line was drawn, and not explained"
    said = caption(entry["bad"], drawing.table)
    assert ("filled cross" in said) == (frame is not None)
    assert "by tens of degrees" in said, "any angle but a constant one swings"


def test_a_clamp_from_the_manifest_is_no_fault_by_itself(tmp_path: Path) -> None:
    """The exact wire of the quickstart was "bad": 0.36 mm with the entry of the manifest, measured to 2 degrees."""
    entry = {"clamp": "estimated", "depth": "traced", "frames": 3, "rms_mm": 0.06, "distal10_rms_mm": 0.06}
    far = entry | {"clamp": "manifest", "rms_mm": 0.36, "tip_median_mm": 0.3}
    tables.write(tmp_path / "entries.csv", ENTRIES, [entry | {"tip_median_mm": 0.1}, far])
    (said,) = [s for s in draw_sections("case", _empty_case(tmp_path), tmp_path, False) if s["figure"] == "budget"]
    assert said["title"] == "Clamp and depth", "there is no budget"
    assert "no fault by itself" in said["read"]
    assert "further from the manifest's than that was measured to" in said["bad"]


def test_the_first_figure_draws_the_predictor_that_the_verdict_names(tmp_path: Path) -> None:
    """It drew the four that every case has, and left out the one that verdict and tile were about."""
    folder = write_run(tmp_path / "out", (FakeCase("c", 4),)) / "cases" / "c"
    case = read_case(folder)
    rival = "null_roll_unknown_rms_mm"
    entry = next(one for one in declared("case") if one["figure"] == "error_by_depth")

    def drawn(strongest: str) -> tuple[set[str], bool, str]:
        case.result["summary"]["strongest_null"] = strongest  # type: ignore[index]
        known = replace(case, errors=case.errors.assign(**{rival: [0.5, 0.6, 0.7, 0.8]}))
        drawing = draw(CASE_FIGURES["error_by_depth"], known)
        legend = drawing.figure.axes[0].get_legend_handles_labels()[1]
        said = {label for label in legend if "(strongest)" in label}
        return said, rival in drawing.table, caption(entry["read"], drawing.table)

    said, shown, read = drawn("roll_unknown")
    assert said == {"predictor: roll unknown (strongest)"}
    assert shown
    assert "blue-grey line is the strongest predictor" in read
    said, shown, read = drawn("previous")
    assert said == {"predictor: previous frame (strongest)"}
    assert not shown
    assert "strongest" not in read


def test_marks_of_frames_lie_where_their_values_are_drawn() -> None:
    """Percent of the figure from its left and upper edge, along x or down y."""
    figure = Figure(figsize=(6.0, 4.0), dpi=50)
    wide, tall = figure.add_axes((0.1, 0.2, 0.5, 0.6)), figure.add_axes((0.7, 0.2, 0.2, 0.6))
    wide.set_xlim(10.0, 60.0)
    tall.set_ylim(4.5, -0.5)
    frames = [FrameAxis(wide, {0: 10.0, 3: 35.0}), FrameAxis(tall, {0: 0.0, 4: 4.0}, across=False)]
    first, second = Drawing(figure, pd.DataFrame(), frames=frames).marks
    assert first == {"box": [10.0, 20.0, 50.0, 60.0], "across": True, "at": {"0": 10.0, "3": 35.0}}
    assert second == {"box": [70.0, 20.0, 20.0, 60.0], "across": False, "at": {"0": 26.0, "4": 74.0}}


def test_fifteen_simulators_have_fifteen_colours() -> None:
    """From the sixth on they repeated."""
    shown = colours_of(pd.Series([OURS, *(f"S{n}" for n in range(15))]))
    assert len(set(shown.values())) == 16
