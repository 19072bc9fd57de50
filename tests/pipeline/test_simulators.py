"""Simulators side by side: ratios of pairs on common frames, and who is nearest where, on errors that are known."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from pipeline.cli import main
from pipeline.run.aggregate import aggregate
from pipeline.run.overall import found_cases, overall, ratio
from pipeline.run.simulators import Piece, _alike, _as_far, _rows, side_by_side, write_comparison
from pipeline.run.stages import others
from pipeline.run.stages.known import Known
from reports import tables
from reports.case_page import render_case
from reports.doubts import AMONG, COUNT_AS, MADE_FROM_TRACES, OF_THEIR_RUN, Caveats
from reports.nearer import nearer
from reports.run_page import render_index
from reports.schema import ERRORS, FAILURES, POINTS, SIMULATORS, SUMMARY, WHERE
from reports.simulators import _not_ours, _where, in_common, render_simulators
from reports.verdict import remarks, verdict

pytestmark = pytest.mark.usefixtures("invented")
Array = NDArray[np.float64]
Law = Callable[[Array, Array, np.random.Generator], Array]
"""Errors (n,) at distances from the tip (n,) and depths (n,)."""
Ends = tuple[float, float, float | None]
"""A ratio and its interval."""
CASES, DEPTHS = 6, (20.0, 30.0, 40.0, 50.0)


def write_tree(out: Path, law: Law, failed: tuple[tuple[int, int], ...] = (), tip_mm: float = 0.0) -> Path:
    """An output of a run: six insertions of four frames. failed : (case, frame) of frames without a result."""
    for c in range(CASES):
        rng, folder = np.random.default_rng([c, len(out.name)]), out / "cases" / f"c{c}"
        folder.mkdir(parents=True)
        rows, parts = [], []
        for f, depth in enumerate(DEPTHS):
            arc = np.arange(10.0, depth + 0.1, 0.5)
            error = law(depth - arc, np.full(len(arc), depth), rng) * (1 + 0.1 * c)
            bad = (c, f) in failed
            row = {"frame": f, "status": "curve_missing" if bad else "ok", "insertion_mm": depth}
            rows.append(
                row | {}
                if bad
                else row
                | {"rms_mm": np.sqrt(np.mean(error**2)), "p95_mm": error.max(), "tip_mm": tip_mm}
                | {"null_centreline_rms_mm": depth / 20}
            )
            if not bad:
                parts.append(pd.DataFrame({"frame": f, "arc_mm": arc, "error_mm": error}))
        tables.write(folder / ERRORS.file, ERRORS, rows)
        if parts:
            tables.write(folder / POINTS.file, POINTS, pd.concat(parts))
        good = sum(row["status"] == "ok" for row in rows)
        status = "ok" if good == len(rows) else "curve_missing"
        summary = {"case": f"c{c}", "frames": len(rows), "frames_ok": good, "frames_failed": len(rows) - good}
        bad_rows = [row for row in rows if row["status"] != "ok"]
        said = [{"frame": r["frame"], "status": r["status"], "sentence": "", "message": ""} for r in rows]
        whole = {
            "case": f"c{c}",
            "role": "validation",
            "group": f"c{c}",
            "status": status,
            "sentence": "",
            "frames": said,
        }
        lost = [
            {"case": f"c{c}", "frame": r["frame"], "status": r["status"], "sentence": "", "message": ""}
            for r in bad_rows
        ]
        whole |= {"failures": lost, "summary": summary | {"status": status}}
        (folder / "result.json").write_text(json.dumps(whole), encoding="utf-8")
    return out


def even(level: float) -> Law:
    return lambda tip, _depth, rng: level * (1 + 0.05 * rng.random(len(tip)))


@pytest.fixture
def compared(tmp_path: Path) -> Path:
    """Ours 0.2 mm everywhere; "tip" better near the tip, worse behind it; "worse" twice as far, with failures."""
    ours = write_tree(tmp_path / "wireval", even(0.2))
    tip = write_tree(
        tmp_path / "tip", lambda tip, depth, rng: even(0.2)(tip, depth, rng) * np.where(tip < 15, 0.5, 1.5)
    )
    worse = write_tree(tmp_path / "worse", even(0.4), failed=((0, 3), (1, 3), (2, 0)))
    write_comparison(tmp_path, {"tip": tip, "worse": worse, "wireval": ours})
    return tmp_path


def test_every_pair_on_the_frames_that_count_in_both(compared: Path) -> None:
    table = pd.read_csv(compared / "simulators.csv").set_index(["simulator", "against"])
    pair = table.loc[("worse", "wireval")]
    assert pair["rms_ratio"] == pytest.approx(2.0, rel=0.02)
    assert pair["rms_ratio_low"] < pair["rms_ratio"] < pair["rms_ratio_high"]
    assert pair["common_frames"] == CASES * len(DEPTHS) - 3
    alone = pd.read_csv(compared / "simulators.csv").query("against.isna()").set_index("simulator")
    assert list(alone["frames"]) == [24, 24, 24], "planned ones, whatever failed"
    assert alone.loc["worse", "frames_ok"] == 21
    assert alone.loc["worse", "within_1mm"] == pytest.approx(21 / 24)


def test_each_row_says_which_interval_rests_on_fewer_insertions(tmp_path: Path) -> None:
    """Ends of skill were missing beside "from 3 insertions only", and one row in five said why."""
    studies = {"wireval": write_tree(tmp_path / "wireval", even(0.2))}
    studies["a"] = write_tree(tmp_path / "a", even(0.4), failed=tuple((c, f) for c in range(3) for f in range(4)))
    write_comparison(tmp_path, studies)
    alone = pd.read_csv(tmp_path / "simulators.csv").query("against.isna()").set_index("simulator")
    assert alone["interval"].to_dict() == {
        "wireval": "over 6 insertions; skill_strongest from 3 insertions only",
        "a": "from 3 insertions only",
    }
    assert list(alone["strongest_frames"]) == [12, 12]


def test_who_is_nearer_is_said_for_the_best_and_every_other_one(compared: Path) -> None:
    """Beside each stood "too few insertions to tell", meant of a guess; of two others no ratio was said."""
    rows = tables.read(compared / "simulators.csv", SIMULATORS)
    said = nearer(rows.to_dict("records"))
    best, *_ = said[0].split()
    assert len(said) == 2
    assert f"{best} is nearer than worse: on 21 frames worse lies " in "".join(said)
    assert f"<li>{said[0]}</li>" in render_simulators(compared).read_text(encoding="utf-8")
    assert nearer(rows.to_dict("records"), off={"tip", "worse"}) == []
    folders = {name: compared / name for name in ("tip", "worse", "wireval")}
    printed = write_comparison(compared, folders)
    assert any(line.startswith("tip is nearer than worse: ") for line in printed), "not on the terminal"
    row = {"simulator": "b", "against": "a", "rms_ratio": 1.2, "common_frames": 1, "interval": "withheld"}
    alone = [{"simulator": n, "frames": 1, "frames_ok": 1, "rms_mm": mm} for n, mm in (("a", 1.0), ("b", 1.2))]
    told = "a is not shown to be nearer than b: on 1 frame b lies 1.20 times as far from the traced wires (withheld)."
    assert nearer([*alone, row]) == [told]


def test_simulators_of_the_same_errors_are_a_copy_on_the_page_too(tmp_path: Path) -> None:
    """The terminal asked whether one is a copy; the page said "not shown to be nearer: 1.00 times as far"."""
    made = {name: write_tree(tmp_path / name, even(mm)) for name, mm in (("b", 0.3), ("best", 0.2))}
    made["copy"] = shutil.copytree(made["b"], tmp_path / "copy")
    said = write_comparison(tmp_path / "b", made)
    page = render_simulators(tmp_path / "b").read_text(encoding="utf-8")
    told = f"copy and b have the same error at every point of all {CASES * len(DEPTHS)} frames: is one a copy?"
    assert told in said
    assert f"<li>{told}</li>" in page
    assert page.count("is one a copy?") == 1
    write_comparison(tmp_path / "b", {"b": made["b"], "copy": made["copy"]})
    assert "1.00 times as far" not in render_simulators(tmp_path / "b").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("rms", "back", "end"),
    [
        (
            (0.7, 0.6, 0.8),
            (1.5, 1.2, 1.9),
            ", but {}1.50 times as far from b (back_ratio; {}1.20 to 1.90): does b end early?",
        ),
        (
            (1.5, 1.2, 1.9),
            (0.9, 0.7, 1.2),
            ", but {}0.90 times as far from b (back_ratio; {}0.70 to 1.20): does a end early?",
        ),
        ((1.5, 1.2, 1.9), (1.1, 0.9, 1.3), ", and {}1.10 times as far from b (back_ratio; {}0.90 to 1.30)."),
        ((1.5, 1.2, 1.9), (1.1, 0.9, None), ", and {}1.10 times as far from b (back_ratio)."),
    ],
)
def test_the_other_way_is_told_with_its_interval(rms: Ends, back: Ends, end: str) -> None:
    """ "but ... does one end early?" was asked also where both ratios were above 1, and who was meant was not said."""
    row = {"simulator": "b", "against": "a", "common_frames": 5, "interval": "over 6 insertions"}
    for name, values in (("rms_ratio", rms), ("back_ratio", back)):
        row |= dict(zip((name, f"{name}_low", f"{name}_high"), values, strict=True))
    alone = [{"simulator": n, "frames": 5, "frames_ok": 5, "rms_mm": mm} for n, mm in (("a", 1.0), ("b", 1.2))]
    (said,) = nearer([*alone, row])
    assert said.startswith("a is not shown to be nearer than b: on 5 frames b lies ")
    assert " times as far from the traced wires (rms_ratio; 95 % interval " in said
    assert said.endswith("over 6 insertions)" + end.format("the traced wires lie ", "95 % interval "))


def test_a_skill_over_other_frames_than_on_its_own_pages_is_told_apart(tmp_path: Path) -> None:
    """One simulator had two skills, over 8 and over 6 frames, by the same name."""
    lost = tuple((case, 1) for case in range(CASES))
    folders = {"one": write_tree(tmp_path, even(0.2))}
    folders["half"] = write_tree(tmp_path / "simulators" / "half", even(0.3), failed=lost)
    write_comparison(tmp_path, folders)
    own = {"rms_mm": 0.2, "skill_strongest": 0.9, "strongest_null": "centreline", "strongest_frames": 24}
    tables.write(tmp_path / "overall.csv", SUMMARY, [own])
    page = render_simulators(tmp_path).read_text(encoding="utf-8")
    assert "This skill is on the frames of all; the skill on its own pages is 0.900, over 24 frames." in page


def test_skill_is_over_the_same_frames_for_all(tmp_path: Path) -> None:
    """The same wires but for one frame had 0.908 where all of them had 0.884."""
    ours = write_tree(tmp_path / "wireval", even(0.2))
    for name, statuses in (("fewer", ["ok", "ok", "ok", "no_wire"]), ("none", ["no_wire"] * 4)):
        shutil.copytree(ours, tmp_path / name)
        for case in (tmp_path / name / "cases").iterdir():
            errors = pd.read_csv(case / ERRORS.file).assign(status=statuses)
            tables.write(case / ERRORS.file, ERRORS, errors.to_dict("records"))
    write_comparison(tmp_path, {"wireval": ours, "fewer": tmp_path / "fewer", "none": tmp_path / "none"})
    alone = pd.read_csv(tmp_path / "simulators.csv").query("against.isna()").set_index("simulator")
    assert list(alone["strongest_frames"].fillna(0)) == [18, 18, 0], "who has none at all takes nobody's away"
    assert alone.loc["wireval", "skill_strongest"] == alone.loc["fewer", "skill_strongest"]
    assert alone.loc["wireval", "rms_mm"] != alone.loc["fewer", "rms_mm"], "over its own frames"


def test_who_takes_frames_from_all_is_named(tmp_path: Path) -> None:
    """A skill over 3 of 12 frames stood on the page, without a word on whose doing that was."""
    lost = tuple((case, frame) for case in range(CASES) for frame in (1, 2))
    ours, half = write_tree(tmp_path / "wireval", even(0.2)), write_tree(tmp_path / "half", even(0.2), failed=lost)
    write_comparison(tmp_path, {"wireval": ours, "half": half})
    said = in_common(tables.read(tmp_path / "simulators.csv", SIMULATORS))
    assert said.startswith("only 12 of 24 frames count for all simulators")
    assert "fewer than 24 count for half (12); " in said


def test_who_has_few_frames_takes_them_from_nobody(tmp_path: Path) -> None:
    """One with 4 of 32 frames changed the skill of all others from 0.950 to 0.807, and its figure to a strip."""
    lost = tuple((case, frame) for case in range(CASES) for frame in (1, 2, 3))
    made = {"wireval": even(0.2), "other": even(0.3)}
    folders = {name: write_tree(tmp_path / name, error) for name, error in made.items()}
    folders["few"] = write_tree(tmp_path / "few", even(0.2), failed=lost)
    write_comparison(tmp_path, folders)
    table = tables.read(tmp_path / "simulators.csv", SIMULATORS)
    alone = table[table["against"].isna()].set_index("simulator")
    assert list(alone["common_frames"]) == [24, 24, 24]
    assert list(alone["skill_strongest"].isna()) == [False, False, True]
    assert in_common(table) == "too few frames for a skill beside others: few (6 of 24)"
    assert set(pd.read_csv(tmp_path / "where.csv")["simulator"]) == {"wireval", "other"}
    ratios = table[table["against"] == "few"].set_index("simulator")
    assert list(ratios["common_frames"]) == [6, 6], "pairs are as they were"


def test_without_a_frame_that_counts_none_are_in_common() -> None:
    """It said "only 0 of 0 frames count for all simulators"."""
    row = {"simulator": "one", "against": None, "frames_ok": 0, "common_frames": 0, "skill_strongest": None}
    assert in_common(pd.DataFrame([row])) == ""


def test_nothing_is_said_where_most_frames_count_for_all(compared: Path) -> None:
    assert in_common(tables.read(compared / "simulators.csv", SIMULATORS)) == ""


def test_who_failed_frames_stands_below_who_did_not(tmp_path: Path) -> None:
    """Of two simulators the one that fails where it is hard has the smaller rms_mm."""
    easy = write_tree(tmp_path / "easy", even(0.1), failed=((0, 3), (1, 3)))
    write_comparison(tmp_path, {"easy": easy, "wireval": write_tree(tmp_path / "wireval", even(0.2))})
    text = render_simulators(tmp_path).read_text(encoding="utf-8")
    table = text[text.index('id="simulators"') :]
    assert table.index(">wireval<") < table.index(">easy<")
    assert "the pages of easy</a>" in text, "OUT is the first one's, whoever is the best"


def test_who_is_nearest_where(compared: Path) -> None:
    where = pd.read_csv(compared / "where.csv")
    lead = where[where["lead"].notna() & (where["along"] == "distance from the earliest tip")].set_index("low_mm")
    assert dict(lead["simulator"]) == {0.0: "tip", 5.0: "tip", 10.0: "tip"} | dict.fromkeys(
        (15.0, 20.0, 25.0, 30.0, 35.0, 40.0), "wireval"
    )
    assert (lead["lead"].drop(40.0) == "clear").all()
    assert lead.loc[0.0, "ratio_to_next"] == pytest.approx(0.5, rel=0.02)
    depth = where[where["along"] == "insertion depth"]
    assert set(depth["low_mm"]) == set(depth["middle_mm"]) == set(DEPTHS), "errors stood at 22.5 mm for depths of 20"
    assert lead.loc[5.0, "middle_mm"] == pytest.approx(7.5, abs=0.5)
    assert list(depth.query("low_mm == 50")["frames"]) == [CASES - 2] * 3, "frames that count for all"


def test_bins_stand_in_their_order(tmp_path: Path) -> None:
    """On the page depths stood as 10, 5, 20, though the file had them in order."""
    made = {name: write_tree(tmp_path / name, even(level)) for name, level in (("soft", 0.3), ("wireval", 0.2))}
    write_comparison(tmp_path, made)
    rows = tables.read(tmp_path / WHERE.file, WHERE)
    grid = _where(rows.sample(frac=1.0, random_state=0))
    assert grid is not None
    cells = [[cell["value"] for cell in row["cells"]] for row in grid["rows"]]
    for along in {row[0] for row in cells}:
        lows = [float(row[1]) for row in cells if row[0] == along]
        assert lows == sorted(lows)


def test_who_has_its_tips_off_is_nearest_nowhere(tmp_path: Path) -> None:
    """A wire that ends 8 mm short lies near the traced one all along, and used to win every bin."""
    short = write_tree(tmp_path, even(0.1), tip_mm=8.0)
    others = {name: tmp_path / "simulators" / name for name in ("fair", "wireval")}
    folders = {"short": short} | {n: write_tree(f, even(0.2 + 0.1 * (n == "fair"))) for n, f in others.items()}
    said = side_by_side(tmp_path, folders, embed=False)
    where = pd.read_csv(tmp_path / "where.csv")
    assert set(where.query("simulator == 'short'")["lead"]) == {"the tips lie off"}
    assert set(where.query("lead == 'clear'")["simulator"]) == {"wireval"}
    page = (tmp_path / "simulators.html").read_text(encoding="utf-8")
    assert "does not see: short (the tips lie off)." in page
    assert said[-1] == f"score of short, fair, wireval.  side by side: {tmp_path / 'simulators.html'}"


def cut(whole: Path, to: Path, early_mm: float, frames: tuple[int, ...], back: float) -> Path:
    """The same wires, in some frames cut short. back : how many times as far the traced wires are then from them."""
    shutil.copytree(whole, to)
    for case in (to / "cases").iterdir():
        points, errors = (tables.read(case / of.file, of) for of in (POINTS, ERRORS))
        errors["back_rms_mm"] = errors["rms_mm"]
        tables.write(whole / "cases" / case.name / ERRORS.file, ERRORS, errors.to_dict("records"))
        for n in frames:
            mine = points["frame"] == n
            points = points[~(mine & (points["arc_mm"] > points["arc_mm"][mine].max() - early_mm))]
            left = points["error_mm"][points["frame"] == n]
            errors.loc[n, ["rms_mm", "p95_mm"]] = np.sqrt(np.mean(left**2)), left.max()
            errors.loc[n, "tip_mm"], errors.loc[n, "back_rms_mm"] = early_mm, back * errors["back_rms_mm"][n]
        tables.write(case / POINTS.file, POINTS, points)
        tables.write(case / ERRORS.file, ERRORS, errors.to_dict("records"))
    return to


def grown(tip: Array, _depth: Array, _rng: np.random.Generator) -> Array:
    return 0.1 + 0.9 * np.clip((6.0 - tip) / 6.0, 0.0, 1.0)


@pytest.mark.quick(1)
@pytest.mark.parametrize(("early_mm", "back"), [(0.8, 1.1), (1.95, 3.0)])
def test_a_wire_that_ends_early_is_not_nearer_than_the_whole_one(tmp_path: Path, early_mm: float, back: float) -> None:
    """Cut by 1.95 mm in the worst frames it was nearer, 1.13 to 2.73 times, led at the tip and was good, unwarned."""
    whole = write_tree(tmp_path / "whole", grown)
    early = cut(whole, tmp_path / "early", early_mm, (0, 2, 3), back)
    said = write_comparison(tmp_path, {"whole": whole, "early": early})
    table = pd.read_csv(tmp_path / "simulators.csv")
    alone, pair = (table[table["against"] == "whole"] if n else table[table["against"].isna()] for n in (0, 1))
    assert pair["rms_ratio_high"].item() < 1.0 < pair["back_ratio_low"].item()
    assert not any(line.startswith("early is nearer") for line in said)
    assert alone.set_index("simulator").loc["early", "tip_max_mm"] == early_mm
    where = pd.read_csv(tmp_path / "where.csv").query(
        "simulator == 'early' and along == 'distance from the earliest tip'"
    )
    assert set(where["lead"].dropna()) <= {"tie", "the tips lie off"}
    shown = render_simulators(tmp_path).read_text(encoding="utf-8")
    assert shown.index(">whole<") < shown.index(">early<"), "in the table"
    assert bool(remarks(overall(found_cases(early)))) == (back > 2.0)
    assert "is better" not in ratio(found_cases(whole), found_cases(early)).verdict()  # type: ignore[union-attr]


def test_a_short_wire_that_is_off_shortens_no_comparison(tmp_path: Path) -> None:
    """Of wires to 50 mm the last 7 mm before 12 mm were compared, since one that may not be the nearest ended there."""
    whole = write_tree(tmp_path / "whole", even(0.2))
    short = cut(whole, tmp_path / "short", 9.5, (0, 1, 2, 3), 3.0)
    other = write_tree(tmp_path / "other", even(0.3))
    write_comparison(tmp_path, {"short": short, "other": other, "whole": whole})
    where = pd.read_csv(tmp_path / "where.csv").query("along == 'distance from the earliest tip'")
    nearest = where[where["simulator"] == "whole"].set_index("low_mm")
    assert list(nearest.index) == [5.0 * n for n in range(9)], "of 40 mm behind the entry"
    assert (nearest["lead"].drop(40.0) == "clear").all()
    assert where[where["simulator"] == "short"]["low_mm"].min() == 5.0, "where it lies, not at the tip of the others"


def test_a_frame_without_points_in_common_is_left_out() -> None:
    """It ended the score: zero-size array to reduction operation."""

    def wire(*arc: float) -> dict[tuple[str, int], tuple[str, Array, Array, Array]]:
        whole = np.arange(5.0, 50.1, 0.5)
        return {
            ("c", n): ("c", of, np.full(len(of), 50.0), np.ones(len(of))) for n, of in enumerate((np.array(arc), whole))
        }

    found = _as_far({"late": wire(5.0, 5.5), "early": wire(2.0)}, ["late", "early"])
    assert [len(parts) for parts in found.values()] == [1, 1]
    found = _as_far({"late": wire(5.0, 5.5), "early": wire(2.0)}, ["early"])
    assert [len(parts) for parts in found.values()] == [1, 2], "of one that is not compared its own is left out"


@pytest.mark.slow
def test_report_makes_every_table_of_a_score_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """simulators/failures.csv stayed as it was, and the root's failures were the first simulator's alone."""
    good, bad = write_tree(tmp_path, even(0.2)), write_tree(tmp_path / "simulators" / "bad", even(0.3), ((1, 2),))
    side_by_side(tmp_path, {"good": good, "bad": bad}, embed=False)
    tables_of = [tmp_path / n for n in ("failures.csv", "simulators/failures.csv", "simulators.csv", "where.csv")]
    before = [path.read_bytes() for path in tables_of]
    for path in [*tables_of[:2], tables_of[3], tmp_path / "simulators.html", tmp_path / "index.html"]:
        path.unlink()
    assert main(["report", str(tmp_path), "--overview"]) == 1, "as score did"
    assert [path.read_bytes() for path in tables_of] == before
    (row,) = pd.read_csv(tmp_path / "failures.csv").to_dict("records")
    assert (row["simulator"], row["case"], row["frame"]) == ("bad", "c1", 2)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Failures: 1 frame<" in page
    assert "bad: c1" in page
    assert ">failures</span>" not in page, "the badge is of the wires that the page is of, and they have none"
    assert "side by side" in capsys.readouterr().out


@pytest.mark.slow
def test_a_case_that_one_simulator_has_lost_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of the first simulator it was; of the others nothing was said, and the rest stood there as ok."""
    good, bad = (write_tree(folder, even(0.2)) for folder in (tmp_path, tmp_path / "simulators" / "bad"))
    for folder in (good, bad):
        planned = sorted(path.name for path in (folder / "cases").iterdir())
        (folder / "run.json").write_text(json.dumps({"planned": planned, "cases": planned}), encoding="utf-8")
    side_by_side(tmp_path, {"good": good, "bad": bad}, embed=False)
    assert main(["report", str(tmp_path), "--overview"]) == 0
    shutil.rmtree(bad / "cases" / "c1")
    assert main(["report", str(tmp_path), "--overview"]) == 1
    assert "bad: named by the manifest and without a result here: c1" in capsys.readouterr().err
    page = (tmp_path / "simulators.html").read_text(encoding="utf-8")
    assert "cases missing" in page[page.index(">bad</a>") :]
    assert "cases missing" not in page[: page.index(">bad</a>")]
    shutil.rmtree(bad)
    assert main(["report", str(tmp_path), "--overview"]) == 1
    assert f"bad: no case below {bad}" in capsys.readouterr().err


def test_simulators_of_different_settings_are_not_compared(tmp_path: Path) -> None:
    one, other = write_tree(tmp_path, even(0.2)), write_tree(tmp_path / "simulators" / "other", even(0.3))
    for folder, step in ((one, 1.0), (other, 0.5)):
        for path in folder.glob("cases/*/result.json"):
            config = {"config": {"solver": {"step_mm": {"value": step, "source": "default"}}}}
            path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | config), encoding="utf-8")
    said = side_by_side(tmp_path, {"one": one, "other": other}, embed=False)
    assert "Nothing is pooled" in said[0]
    assert pd.read_csv(tmp_path / "simulators.csv")["against"].isna().all()


@pytest.mark.parametrize("first", [1.0, 1.0 + 1e-12, 1.0 - 1e-12])
def test_of_a_tie_the_first_leads_run_after_run(first: float) -> None:
    """Wires that were computed and the same ones read again differ by rounding: where.csv differed after a resume."""
    found = {"own": [Piece("a", first, 4)], "wireval": [Piece("a", 1.0, 4)], "far": [Piece("a", 2.0, 4)]}
    rows = list(_rows({}, found, {}))
    assert [row["simulator"] for row in rows if "lead" in row] == ["own"]


def test_the_same_twice_is_a_tie(tmp_path: Path) -> None:
    both = {name: write_tree(tmp_path / name, even(0.2)) for name in ("wireval", "another")}
    said = write_comparison(tmp_path, both)
    assert set(pd.read_csv(tmp_path / "where.csv")["lead"].dropna()) == {"tie"}
    assert said[0] == "another and wireval have the same error at every point of all 24 frames: is one a copy?"
    assert _alike({"a": [], "b": []}) == [], "of no frames nobody is a copy"


def test_the_page(compared: Path) -> None:
    page = render_simulators(compared).read_text(encoding="utf-8")
    assert "rms_<wbr>ratio_<wbr>to_<wbr>wireval" in page
    assert page.count('<tr class="bad">') == 1, "the one with failed frames"
    assert (compared / "figures" / "who_is_nearest.png").exists()


def test_the_page_says_how_good_each_is_and_what_was_warned_of(compared: Path) -> None:
    """`score` writes the first simulator beside the page; a warning that our wires get, too, is none of another's."""
    skills = {"tip": 0.5, "worse": 0.4, "wireval": -1.0}
    rows = tables.read(compared / "simulators.csv", SIMULATORS)
    ends = dict.fromkeys(("skill_strongest_low", "skill_strongest_high"), np.nan)
    rows = rows.assign(skill_strongest=rows["simulator"].map(skills), strongest_null="previous", **ends)
    tables.write(compared / "simulators.csv", SIMULATORS, rows.to_dict("records"))
    for name in skills:
        (compared / "simulators").mkdir(exist_ok=True)
        folder = (compared / name).rename(compared / "simulators" / name) if name != "tip" else compared
        if name == "tip":
            (compared / "tip" / "cases").rename(compared / "cases")
        # a skill over its own frames, that of no other
        row = {"rms_mm": 0.3, "skill_strongest": 0.99, "strongest_null": "pinned"}
        tables.write(folder / "overall.csv", SUMMARY, [row])
        path = folder / "cases" / "c0" / "result.json"
        own = ["a faint frame", *["3 frames: with x and y turned most would not: are they RAS?"] * (name == "worse")]
        path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | {"warnings": own}), encoding="utf-8")
        if name == "worse":
            why = {"case": "c0", "status": "curve_missing", "sentence": "there is no wire", "message": "no file"}
            tables.write(folder / "failures.csv", FAILURES, [why | {"frame": frame} for frame in (1, 3)])
    page = render_simulators(compared).read_text(encoding="utf-8")
    assert '<span class="status poor">worse than a guess</span>' in page
    assert '<a class="status good" href="index.html#warnings">ok, 1 warning</a>' in page, (
        "ok, where its own page counts"
    )
    assert '<a href="simulators/wireval/index.html#warnings">1 warning on the page of wireval</a>' in page
    assert "On 21 of 24 planned frames alone the wire of worse lies" in page
    assert "<li>c0, frames 1, 3: curve_missing: there is no wire</li>" in page, "it listed them without a reason"
    assert '<a href="simulators/worse/index.html#failures">all failures, and what to do</a>' in page
    assert "c0: 3 frames: with x and y turned most would not: are they RAS?" in page
    assert "a faint frame" not in page


def test_frames_whose_settings_differ_have_a_result(tmp_path: Path) -> None:
    """Nothing is pooled over them: beside 24 of 24 ok the page said that no frame had a result."""
    ours = write_tree(tmp_path / "simulators" / "wireval", even(0.2))
    write_comparison(tmp_path, {"another": write_tree(tmp_path, even(0.2)), "wireval": ours})
    for number, folder in enumerate(sorted((tmp_path / "cases").iterdir())):
        path = folder / "result.json"
        config = {"config": {"simulate": {"friction": {"value": 0.1 * (number > 2), "source": "command line"}}}}
        path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | config), encoding="utf-8")
    page = render_simulators(tmp_path).read_text(encoding="utf-8")
    assert "No frame of it has a result" not in page
    assert '<span class="status bad">not pooled</span>' in page


def test_a_simulator_without_any_usable_wire_is_shown(tmp_path: Path) -> None:
    ours = write_tree(tmp_path / "wireval", even(0.2))
    none = write_tree(tmp_path / "none", even(0.2))
    for folder in (none / "cases").iterdir():
        (folder / POINTS.file).unlink()
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        result["summary"] |= {"frames_ok": 0, "frames_failed": 4}
        result["frames"] = [row | {"status": "curve_missing"} for row in result["frames"]]
        (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    told = write_comparison(tmp_path, {"none": none, "wireval": ours})
    assert told == ["who is nearest where is left out: no frame counts for none"], "its figure was missing silently"
    table = pd.read_csv(tmp_path / "simulators.csv").set_index("simulator")
    assert (table.loc["none", "frames"], table.loc["none", "frames_ok"], table.loc["none", "within_1mm"]) == (
        24,
        0,
        0.0,
    )
    page = render_simulators(tmp_path).read_text(encoding="utf-8")
    assert page.count("No frame of it has a result.") == 1
    assert page.count('<span class="status bad">frames failed</span>') == 1


def test_wires_that_were_made_from_the_traces_are_not_ok(tmp_path: Path) -> None:
    """The traces handed back came first, ok, "that is better (skill 1.00)", above the warning."""
    ours, theirs = write_tree(tmp_path / "simulators" / "wireval", even(0.2)), write_tree(tmp_path, even(0.001))
    path = theirs / "cases" / "c0" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(result | {"warnings": [f"0.001 mm: {MADE_FROM_TRACES}"]}), encoding="utf-8")
    write_comparison(tmp_path, {"another": theirs, "wireval": ours})
    page = render_simulators(tmp_path).read_text(encoding="utf-8")
    assert '<span class="status bad">made from the traces</span>' in page
    assert f"c0: 0.001 mm: {MADE_FROM_TRACES}." in page
    assert page.count('<span class="status good">ok</span>') == 1
    for own in (render_index(theirs), render_case(theirs / "cases" / "c0")):
        page = own.read_text(encoding="utf-8")
        assert '<span class="status bad">made from the traces</span>' in page, "its own pages were green"
        assert "(rms) from the traced one" not in page


def test_a_closed_gate_names_a_page_from_where_it_is_read(tmp_path: Path) -> None:
    """On the page of all the place was relative to each simulator's own folder: that of the first one's page."""
    theirs, ours = write_tree(tmp_path, even(0.3)), write_tree(tmp_path / "simulators" / "wireval", even(0.2))
    write_comparison(tmp_path, {"another": theirs, "wireval": ours})
    found = aggregate(ours, {"fail_if": ["rms_mm>0.1"]})
    assert found.closed[0].endswith(f"), {ours.as_posix()}/cases/c5/report.html")
    page = render_simulators(tmp_path).read_text(encoding="utf-8")
    assert "), simulators/wireval/cases/c5/report.html.</p>" in page
    assert "), cases/c5/report.html.</p>" in render_index(ours).read_text(encoding="utf-8")


def test_a_warning_from_the_run_of_the_wires_is_none_where_our_wires_have_it() -> None:
    """It began with the run that it is from, and so stood on the page as if theirs alone."""
    theirs = {"a": [f"{OF_THEIR_RUN}turned by 9 degrees", f"{OF_THEIR_RUN}kinked", "faint"]}
    assert _not_ours(theirs, {"a": ["turned by 9 degrees", "faint"]}) == [f"a: {OF_THEIR_RUN}kinked"]


def test_insertions_that_look_like_one_have_no_green_badge(tmp_path: Path) -> None:
    """Twelve scans of one wire were called worse than a guess, which was the wire itself; the reason stood below."""
    out = write_tree(tmp_path, even(0.2))
    assert '<span class="status good">ok</span>' in render_index(out).read_text(encoding="utf-8")
    (out / AMONG).write_text(json.dumps({"doubts": [f"insertions 'a', 'b' tell no more than one{COUNT_AS}2"]}))
    page = render_index(out).read_text(encoding="utf-8")
    assert '<span class="status poor">insertions look like one</span>' in page
    said = verdict({"rms_mm": 0.2}, caveats=Caveats(twins="insertions 'a', 'b' tell no more than one"))
    assert said.endswith("But insertions look like one that was scanned again, and count as several: see the warnings.")


@pytest.mark.parametrize(("wires", "said"), [(1, "frame 0: 100 %"), (2, "2 frames, the worst is frame 0: 100 %")])
def test_the_frame_of_a_share_is_told_apart_from_it(monkeypatch: pytest.MonkeyPatch, wires: int, said: str) -> None:
    """It was "in frame 5 71 % of the wire"."""
    monkeypatch.setattr(others, "_clearance", lambda _known, points: np.full(len(points), 9.0))
    case = Mock(**{"wire.radius_mm": 0.18})
    (text,) = others._outside(Known(), dict.fromkeys(range(wires), np.eye(3)), case)
    assert text.startswith(f"{said} of the wire lies outside the lumen")


def test_a_tip_beyond_the_wall_is_told_however_short_it_is() -> None:
    """The last 0.9 mm of a wire lay 0.9 mm outside a vessel of 2 mm in every frame, ok and without a warning."""
    inside = np.full(100, -0.5)
    tips = {n: np.append(inside, [0.4, mm]) for n, mm in enumerate((0.5, 0.7, 0.9))}
    (text,) = others._through_wall(tips, 0.54)
    assert text.startswith("2 frames, the worst is frame 2: the wire lies up to 0.90 mm beyond the lumen's wall, its")
    (text,) = others._through_wall({7: np.append(tips[2], inside)}, 0.54)
    assert text.startswith("frame 7: the wire lies up to 0.90 mm beyond the lumen's wall (expected 0.54 mm at most)")
    assert not others._through_wall(tips, 1.0)
