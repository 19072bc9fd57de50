"""Values as a reader sees them."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
import pytest

from reports import _content
from reports.calibration import gained
from reports.case_files import counted, counted_scans
from reports.doubts import said_by_cases
from reports.schema import SUMMARY, SWEEP, Column


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.12345, "0.123"),
        (12.345, "12.3"),
        (123456.0, "123456"),
        (1234567.0, "1.23e+06"),
        (0.0001234, "0.000123"),
        (0.00001, "1e-05"),
        (-0.5, "-0.500"),
        (7, "7"),
        (math.inf, "inf"),
        (math.nan, "–"),
        (None, "–"),
        (pd.NA, "–"),
        (True, "yes"),
        ("a word", "a word"),
    ],
)
def test_numbers(value: Any, text: str) -> None:
    assert _content.number(value) == text


def test_a_tile_may_be_the_number_that_another_column_names() -> None:
    entries = [{"column": "null_{strongest_null}_rms_mm", "label": "of", "name": "strongest_null"}]
    row = {"strongest_null": "previous", "null_previous_rms_mm": 0.5}
    assert _content.cards(entries, row) == [{"value": "0.500", "label": "of previous frame"}]
    assert _content.cards([{"column": "skill", "label": "of it"}], {"skill": -251.0})[0]["value"] == "below -10"
    assert _content.cards(entries, {}) == _content.cards(entries, {"strongest_null": pd.NA}) == []


def test_rounding_is_no_length_in_tiles_and_tables_either() -> None:
    """The verdict alone had 0 mm; the tile below it had 2.35e-16."""
    row = {"rms_mm": 2.35e-16, "strain": 1e-7}
    assert _content.cards([{"column": "rms_mm", "label": "rms"}], row)[0]["value"] == "0"
    grid = _content.grid(pd.DataFrame([row]), [SUMMARY["rms_mm"], Column("strain", "1", "")])
    assert [cell["value"] for cell in grid["rows"][0]["cells"]] == ["0", "1e-07"]


def test_a_tile_says_where_it_is_over_fewer_frames_than_those_beside_it() -> None:
    entries = [{"column": "skill_strongest", "label": "skill"}]
    row = {"skill_strongest": 0.9, "strongest_frames": 5, "frames_ok": 6}
    card = _content.cards(entries, row)[0]
    assert card["label"] == "skill over 5 of 6 frames, the rms over more", "all of it made eight lines of a narrow tile"
    assert card["why"].endswith("every predictor has a guess; the two rms beside it are over other frames.")
    assert _content.cards(entries, row | {"strongest_frames": 6}) == [{"value": "0.900", "label": "skill"}]
    explained = [entries[0] | {"why": "1 is perfect."}]
    assert _content.cards(explained, row)[0]["why"].startswith("1 is perfect. It is over")


def test_a_tile_says_that_its_interval_is_withheld() -> None:
    """It had none, without a word: that there are too few insertions stood on no first screen."""
    entries = [{"column": name, "label": name} for name in ("rms_mm", "skill_strongest", "tip_median_mm")]
    row = {"rms_mm": 0.2, "skill_strongest": 0.9, "tip_median_mm": 0.3}
    withheld = row | {"interval": "interval withheld: 1 insertion, at least 3 needed"}
    rms, skill, tip = (card["label"] for card in _content.cards(entries, withheld))
    assert (rms, skill) == ("rms_mm (no interval: 1 insertion)", "skill_strongest (no interval: 1 insertion)")
    assert tip == "tip_median_mm"
    bounded = withheld | {"rms_low_mm": 0.1, "rms_high_mm": 0.3}
    assert _content.cards(entries, bounded)[0]["label"] == "rms_mm (95 %: 0.100 to 0.300)"
    for note in (None, "from 4 insertions only; not bounded: rms_low_mm"):
        assert _content.cards(entries, row | {"interval": note})[0]["label"] == "rms_mm"


def test_a_frame_that_the_roll_was_fitted_on_is_counted_apart() -> None:
    """Of six scans five were "5 of 5 frames"."""
    assert counted_scans(5, 5, 1, "scored") == "6 scans: 1 used for the roll, 5 scored"
    assert counted_scans(4, 5, 1, "scored") == "6 scans: 1 used for the roll, 4 scored, 1 without a result"
    entries = [{"column": "frames_ok", "of": "frames", "label": "frames"}]
    row = {"frames_ok": 5, "frames": 5}
    assert _content.cards(entries, row | {"frames_fitted": 1})[0]["label"] == "of 5 frames (1 more used for the roll)"
    assert _content.cards(entries, row | {"frames_fitted": 0})[0]["label"] == "of 5 frames"


def test_a_caption_speaks_of_what_is_there() -> None:
    text = "Dashed: simulated{band|, in its band}{u_mm|; bars: u}."
    table = pd.DataFrame({"curve": ["simulated", "band"], "u_mm": [math.nan, math.nan]})
    assert _content.caption(text, table) == "Dashed: simulated, in its band."
    assert _content.caption(text, pd.DataFrame({"u_mm": [1.0]})) == "Dashed: simulated; bars: u."
    several = "Bad: {rms_mm|a far dot;} {u_mm|a long bar.}"
    assert _content.caption(several, pd.DataFrame({"rms_mm": [1.0]})) == "Bad: a far dot.", "it ended with a semicolon"


def test_intervals_need_both_ends() -> None:
    assert _content.interval(0.1, 0.25) == "0.100 to 0.250"
    assert _content.interval(None, 0.25) == ""


def test_trees_become_rows_and_empty_leaves_go() -> None:
    tree = {"a": {"b": 1.0, "c": None, "d": [0.16557399795383654, 2]}, "argv": ["wireval", "run"], "e": ""}
    assert list(_content.flatten(tree)) == [("a.b", "1"), ("a.d", "[0.165573998, 2]"), ("argv", "wireval run")]


def test_a_level_is_one_text_beside_plain_counts() -> None:
    level = {"min": 0.5, "median": 0.8300158, "max": 12.0}
    tree = {"segment": {"voxels_read": 10752.0, "blur_mm": level, "nothing": dict.fromkeys(level)}}
    rows = list(_content.flatten(tree))
    assert rows == [("segment.voxels_read", "10752"), ("segment.blur_mm", "0.830 (0.500 to 12.0)")]
    once = {"noise": dict.fromkeys(level, 33.6)}
    assert list(_content.flatten(once)) == [("noise", "33.6")], "33.6 (33.6 to 33.6)"


def test_settings_keep_their_source() -> None:
    config = {"solver": {"segment_mm": {"value": 0.5, "source": "command line"}}, "odd": {"key": 1}}
    assert _content.settings(config) == [("solver.segment_mm", "0.5", "command line"), ("odd.key", "1", "")]
    config = {"a": {"axis": {"value": []}, "scale": {"value": None}, "resample": {"value": False}}}
    assert [value for _, value, _ in _content.settings(config)] == ["–", "–", "false"], "nothing, None, False"


def test_one_insertion_is_no_plural() -> None:
    table = pd.DataFrame([{"insertions": 1, "interval": "interval withheld: 1 insertion, at least 3 needed"}])
    assert _content.overall([], table)[0]["label"].startswith("insertion stands behind the intervals")
    assert _content.overall([], table.assign(insertions=4))[0]["label"].startswith("insertions stand")


def test_one_thing_is_no_plural() -> None:
    """``1 cases compared``, ``1 frames: 1 ok``."""
    assert [counted(n, "frame") for n in (0, 1, 2)] == ["0 frames", "1 frame", "2 frames"]


def test_the_ends_of_an_interval_stand_below_what_they_are_of() -> None:
    """A sweep's table had those of a skill below it and in two columns of their own."""
    row = {"parameter": "p", "case": "(all)", "skill_strongest": 0.9, "skill_strongest_low": 0.8}
    table = pd.DataFrame([row | {"skill_strongest_high": 0.95}]).reindex(columns=SWEEP.names)
    found = _content.grid(table, SWEEP.columns)
    assert [head["name"] for head in found["columns"]] == ["parameter", "case", "skill_strongest"]
    assert found["rows"][0]["cells"][-1]["detail"] == "0.800 to 0.950"


def test_a_calibration_that_gains_nothing_says_so() -> None:
    frames = [
        {"depth_mm": mm, "before_mm": rms, "after_mm": rms, "as_given_mm": 0.3}
        for mm, rms in ((10.0, 0.05), (30.0, 0.1))
    ]
    said = gained(frames)
    assert said.startswith("the wires of 2 fitted frames lie 0.0901 mm rms from their traces as stated, 0.0901 mm")
    both = "; clamps and walls are fitted to both; with the walls as they are given it is 0.300 mm"
    assert said.endswith(f"0.0901 mm as calibrated: no nearer{both}")
    assert gained([row | {"after_mm": 0.3} for row in frames]).endswith(f"0.300 mm as calibrated: farther away{both}")
    assert gained([row | {"after_mm": 0.02} for row in frames]).endswith(f"0.0200 mm as calibrated{both}")
    for where, words in (("in_both", ", each insertion turned for itself in both"), ("as_calibrated", " with each")):
        assert f"0.0901 mm as calibrated{words}" in gained([row | {"turned": where} for row in frames])
    assert gained([]) == gained([{"depth_mm": 10.0, "before_mm": None, "after_mm": 0.1}]) == ""


def test_what_a_calibration_gains_is_told_of_the_same_frames() -> None:
    """Of a frame without rest under the given walls only that number was dropped: the worst case read as a gain."""
    near = {"depth_mm": 10.0, "before_mm": 0.1, "after_mm": 0.05, "as_given_mm": 0.06}
    wild = {"depth_mm": 10.0, "before_mm": 1.0, "after_mm": 0.5, "as_given_mm": None}
    said = gained([near, wild, wild])
    assert said.startswith("the wires of 3 fitted frames lie 0.819 mm rms from their traces as stated, 0.409 mm")
    assert said.endswith("it is 0.0600 mm over the 1 frame that come to rest then, 0.0500 mm as calibrated")
    assert gained([near]).endswith("with the walls as they are given it is 0.0600 mm")
    none = "the walls as they are given none of these wires comes to rest"
    assert gained([wild]).endswith(none)
    assert gained([wild, wild | {"before_mm": None}]).endswith(none)
    assert gained([wild | {"depth_mm": None}]) == ""


def test_what_cases_say_with_other_numbers_is_one_line() -> None:
    """Of 20 warnings of a study 16 were that a wire gave way, and five were shown: two of them one bone's."""
    snaps = [{"warnings": [f"frame {n}: gave way at {n}.5 mm", "bone touches"]} for n in range(3)]
    results = dict(zip("abc", snaps, strict=True))
    assert said_by_cases(results, "warnings") == [
        "a, b, c: frame 0: gave way at 0.5 mm (numbers of a; 2 more with other numbers, on the pages of the cases)",
        "a, b, c: bone touches",
    ]
    worse = {"warnings": ["frame 0: gave way at 0.5 mm", "frame 7: gave way at 9 mm"]}
    (of_two,) = said_by_cases({"a": worse, "b": worse, "c": {"warnings": ()}}, "warnings")
    assert of_two == "a, b: frame 0: gave way at 0.5 mm (1 more with other numbers, on the pages of the cases)"
    alone = {"a": {"warnings": ["frame 1: gave way", "frame 2: gave way"]}}
    assert said_by_cases(alone, "warnings") == ["frame 1: gave way", "frame 2: gave way"], "its page has them all"
