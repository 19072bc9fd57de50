"""The first sentence of a page, the worst frames and the next command."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from reports.doubts import MOSTLY_LINES, OFF_THE_SCANS, Caveats, weightiest_first
from reports.unscored import unscored
from reports.verdict import badge, headline, in_short, remarks, verdict
from reports.what_next import next_command, typed, warned, worst_frames
from reports.worse import one_case, worse_sentence
from tests.reports.fake_results import FakeCase, write_run


@pytest.mark.parametrize(
    ("skill", "low", "said"),
    [
        (0.9, 0.7, "The wire is better (skill 0.900) than "),
        (0.9, None, "The wire is better (skill 0.900) than "),
        (0.4, -0.1, "It is not shown to be better (skill 0.400, its interval reaches -0.100) than "),
        (-0.2, -0.5, "The wire is no better (skill -0.200) than "),
        (-0.05, None, "The wire is no better (skill -0.0500) than "),
        (-38.6, None, "The wire is worse (skill below -10) than "),
    ],
)
def test_the_verdict_follows_the_strongest_rival(skill: float, low: float | None, said: str) -> None:
    row = {"rms_mm": 0.25, "p95_mm": 0.5, "skill": 0.99, "skill_strongest": skill, "strongest_null": "roll_unknown"}
    text = verdict(row | {"skill_strongest_low": low})
    assert text.startswith("The simulated wire lies 0.250 mm (rms) from the traced one; 95 % of its points lie within")
    # a newcomer is told what "roll unknown" means
    rival = "wireval's own solver, which is not told the roll: the mean of 12 wires 30 degrees apart."
    assert text.endswith(f"{said}the strongest trivial predictor: {rival}")


def test_of_a_study_with_truth_the_true_error_is_said_first() -> None:
    """Of 0.181 mm in coarse voxels the trace made most: 0.081 mm stood under "7 more numbers"."""
    row = {"rms_mm": 0.181, "p95_mm": 0.4, "truth_rms_mm": 0.081}
    assert verdict(row).endswith("95 % of its points lie within 0.400 mm. From the true wire it lies 0.0810 mm.")


def test_an_error_below_what_the_traces_are_known_to_is_told() -> None:
    """A wire 0.037 mm from its traces, which are known to 0.08 mm, was ok, with a skill of 0.997."""
    row = {"rms_mm": 0.037, "trace_sigma_mm": 0.08}
    assert "By the traces' own standard deviation a perfect wire would lie 0.113 mm from them" in verdict(row)
    assert "perfect" not in verdict(row | {"rms_mm": 0.12})
    assert "perfect" not in verdict({"rms_mm": 0.037}), "of own curves nobody knows"


def test_an_error_that_inputs_do_not_explain_is_told() -> None:
    """A green "ok" stood beside 12 to 60 % of points beyond 2 u: one had to look for the number."""
    row = {"rms_mm": 0.4, "share_beyond_2u": 0.31}
    assert " 31 % of its points lie farther off than trace and inputs explain (5 % would by chance)" in verdict(row)
    assert "explain" not in verdict(row | {"share_beyond_2u": 0.06})
    assert "explain" not in verdict({"rms_mm": 0.4}), "where no budget was asked for"


def test_a_skill_of_one_insertion_says_nothing_of_others() -> None:
    """One insertion of skill 0.07 was a green ok and better; four of the same skill were not shown to be better."""
    row = {"rms_mm": 0.2, "skill_strongest": 0.0675, "strongest_null": "previous"}
    one = row | {"interval": "interval withheld: 1 insertion, at least 3 needed"}
    two = row | {"interval": "interval withheld: 2 insertions, at least 3 needed"}
    assert "One insertion shows nothing about others: an interval needs three" in headline(one)[0]
    assert "2 insertions show nothing about others" in headline(two)[0]
    shown = {"text": "skill 0.0675: one insertion shows nothing about others", "look": "poor"}
    assert badge("ok", True, one) == shown
    assert badge("ok", True, one, Caveats(warnings=("few points",))) == {
        "text": f"{shown['text']}, 1 warning",
        "look": "poor",
        "link": "#warnings",
    }
    for other in (row | {"interval": "from 3 insertions only"}, one | {"skill_strongest": -0.1}):
        assert "about others" not in verdict(other) + badge("ok", True, other)["text"], "that is worse, of whatever"


@pytest.mark.parametrize(
    ("low", "said"),
    [
        (0.1, "By rms_mm alone it would be better (skill 0.400) than "),
        (-45.4, "By rms_mm alone it is not shown to be better (skill 0.400, its interval reaches below -10) than "),
    ],
)
def test_tips_that_lie_off_make_no_skill_certain(low: float, said: str) -> None:
    row = {"rms_mm": 0.25, "skill_strongest": 0.4, "skill_strongest_low": low, "strongest_null": "roll_unknown"}
    assert said in verdict(row | {"tip_median_mm": 1.5, "tip_along_median_mm": 1.5})


@pytest.mark.parametrize(
    ("skill", "low", "said"),
    [
        (0.9, None, "skill 0.900 against the predictor 'least bending'"),
        (0.4, -0.1, "not shown to be better than the predictor 'least bending' (skill 0.400, its interval reaches"),
        (-0.05, None, "no better than the predictor 'least bending' (skill -0.050)"),
        (-2.0, None, "worse than the predictor 'least bending' (skill -2.000)"),
    ],
)
def test_the_terminal_says_in_words_what_a_negative_skill_means(skill: float, low: float | None, said: str) -> None:
    """It said "6 ok" and "skill -2.000 against the predictor min_bending, which is nearer"."""
    row = {"rms_mm": 0.25, "skill_strongest": skill, "skill_strongest_low": low, "strongest_null": "min_bending"}
    assert said in in_short(row)
    assert in_short({"rms_mm": 0.25}) == ""
    assert "the predictor 'another insertion'" in in_short(row | {"strongest_null": "another"})


def test_a_skill_over_fewer_frames_says_so() -> None:
    """The two rms beside it were over six frames and the skill over five: divided they gave another one."""
    row = {"rms_mm": 0.25, "skill_strongest": 0.9, "strongest_null": "previous", "frames": 6, "frames_ok": 6}
    for text in (in_short, verdict):
        assert " over 5 of 6 frames" in text(row | {"strongest_frames": 5})
        assert "over" not in text(row | {"strongest_frames": 6})


@pytest.mark.parametrize(
    ("skill", "low", "text", "look"),
    [
        (0.9, 0.7, "ok", "good"),
        (0.9, None, "ok", "good"),
        (None, None, "ok", "good"),
        (0.4, -0.1, "not shown to be better than a guess", "poor"),
        (-0.1, None, "no better than a guess", "poor"),
        (-0.2, None, "worse than a guess", "poor"),
    ],
)
def test_no_green_badge_beside_a_negative_skill(skill: float | None, low: float | None, text: str, look: str) -> None:
    row = {"skill_strongest": skill, "skill_strongest_low": low, "strongest_null": "previous"}
    assert badge("ok", True, row) == {"text": text, "look": look}
    assert badge("no_wire", False, row) == {"text": "no_wire", "look": "bad"}


def test_a_wide_interval_of_few_insertions_is_no_fault_of_the_wire() -> None:
    """Over three insertions skills of 0.97, 0.44 and 0.07 had one badge, and a better wire no other than a worse."""
    row = {"skill_strongest": 0.97, "skill_strongest_low": -0.1, "strongest_null": "previous"}
    told = row | {"interval": "from 3 insertions only"}
    assert badge("ok", True, told) == {"text": "skill 0.970: too few insertions to tell from a guess", "look": "poor"}
    assert badge("ok", True, told | {"skill_strongest": 0.07})["text"].startswith("skill 0.0700: too few insertions")
    assert badge("ok", True, told | {"skill_strongest": -0.1})["text"] == "no better than a guess"
    assert badge("ok", True, row)["text"] == "not shown to be better than a guess"


@pytest.mark.parametrize(
    ("along", "said"),
    [(-1.9, "1.90 mm short along the vessel"), (1.9, "1.90 mm farther along the vessel"), (None, "1.90 mm off")],
)
def test_a_wire_that_ends_elsewhere_is_not_called_better(along: float | None, said: str) -> None:
    """Errors go from the simulated wire to the traced one: what it leaves out is in none of them."""
    row = {"rms_mm": 0.1, "tip_median_mm": 1.9, "tip_along_median_mm": along}
    row |= {"skill_strongest": 0.9, "skill_strongest_low": 0.8, "strongest_null": "previous"}
    assert badge("ok", True, row) == {"text": "the tips lie off", "look": "poor"}
    assert f"The wire's tip lies {said} (median)" in verdict(row)
    assert ("rms_mm does not see that" in verdict(row)) is (along != 1.9), "what lies beyond the trace is seen"
    assert ("judge by tip_median_mm and back_rms_mm" in verdict(row)) is (along != 1.9)
    assert "The wire is better" not in verdict(row)
    assert badge("ok", True, row | {"tip_median_mm": 0.29})["look"] == "good"
    assert badge("ok", True, row | {"rms_mm": 0.7})["look"] == "good", "a tip is the worst of most wires"


def test_wires_that_fold_back_in_a_third_of_the_frames_are_not_called_better() -> None:
    """Their median tip is right, and what is simulated lies on the trace: half of the trace has no wire near."""
    row = {"rms_mm": 0.19, "p95_mm": 0.34, "tip_median_mm": 0.3, "coverage": 0.82, "skill_strongest": 0.79}
    row |= {"skill_strongest_low": 0.7, "strongest_null": "another"}
    assert badge("ok", True, row) == {"text": "the tips lie off", "look": "poor"}
    assert "18 % of the traced wires have no simulated one near: rms_mm does not see that" in verdict(row)
    assert badge("ok", True, row | {"coverage": 0.99})["look"] == "good"
    early = row | {"coverage": 0.96, "back_rms_mm": 0.47}
    assert badge("ok", True, early)["look"] == "poor", "some end early, and neither median tip nor coverage shows it"
    assert badge("ok", True, row | {"p95_mm": 3.0})["look"] == "good", "rms_mm sees wires that lie beside the trace"


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (-0.5, -0.01, "worse"),
        (-0.5, 0.0, "no better"),
        (-0.5, 0.1, "not shown to be better"),
        (-0.5, None, "no better"),
        (None, -0.01, "worse"),
    ],
)
def test_worse_is_said_where_the_whole_interval_is(low: float | None, high: float | None, text: str) -> None:
    """A skill of -38.6 was called "no better", and one of -0.13, anywhere from -36 to 0.97, too."""
    row = {"rms_mm": 0.25, "skill_strongest": -0.04, "skill_strongest_low": low, "skill_strongest_high": high}
    row |= {"strongest_null": "previous"}
    assert badge("ok", True, row) == {"text": f"{text} than a guess", "look": "poor"}
    assert f"{text} (skill -0.0400" in verdict(row)


def test_the_verdict_says_of_how_many_planned_frames_it_speaks() -> None:
    """Half the frames lost took the partners of a predictor: the verdict became better (0.926 instead of 0.563)."""
    row = {"rms_mm": 0.2, "skill_strongest": 0.9, "strongest_null": "centreline", "frames": 12, "frames_ok": 6}
    assert verdict(row).startswith("On 6 of 12 planned frames alone the simulated wire lies 0.200 mm"), "it came last"
    assert "On these frames the wire is better (skill 0.900) than" in verdict(row)
    assert "The wire is better (skill 0.900) than" in verdict(row | {"frames_ok": 12})
    fewer = "'previous frame' had fewer wires to guess from: the skill may look better than it is."
    assert f"the predictor {fewer}" in verdict(row), "of one insertion there is no other"
    assert "'previous frame' and 'another insertion' had fewer wires" in verdict(row | {"null_another_rms_mm": 0.5})
    assert "planned" not in verdict(row | {"frames_ok": 12})


ROLLED = "turned by -30 degrees, the simulated wire lies 0.10 mm (rms) from the traced one, as stated 0.36 mm: check"


@pytest.mark.parametrize(
    ("warnings", "text", "look", "said"),
    [
        ((), "ok", "good", ""),
        (("few points",), "ok, 1 warning", "good", "1 warning below."),
        (("few points", ROLLED), "ok, 2 warnings", "poor", f"The weightiest of 2 warnings: {ROLLED}."),
        ((ROLLED,), "ok, 1 warning", "poor", f"A warning: {ROLLED}."),
        (("as insertion_mm states?",), "ok, 1 warning", "poor", "A warning: as insertion_mm states?"),
    ],
)
def test_warnings_stand_before_the_word_better(warnings: tuple[str, ...], text: str, look: str, said: str) -> None:
    """A roll 25 degrees off was a green ok and "The wire is better"; that it is wrong stood below the figure."""
    row = {"rms_mm": 0.36, "skill_strongest": 0.8, "strongest_null": "centreline"}
    caveats = Caveats(warnings=warnings)
    found = badge("ok", True, row, caveats)
    assert (found["text"], found["look"]) == (text, look)
    assert (found.get("link") == "#warnings") is bool(warnings)
    assert badge("no_wire", False, row, caveats) == {"text": "no_wire", "look": "bad"}
    whole = verdict(row, caveats=caveats)
    assert f"{said} The wire is better".strip() in whole
    assert ("arning" in whole) is bool(warnings)


def test_a_warning_against_an_input_is_none_of_the_last() -> None:
    """The terminal and a page show five: behind these a wrong roll was one of "3 more warnings"."""
    assert weightiest_first(["a", "b", ROLLED, "c"]) == [ROLLED, "a", "b", "c"]


def test_traces_off_the_scans_come_first_and_no_roll_is_advised() -> None:
    """Mirrored own traces, met with a fitted roll, had a green ok; a warning of the roll stood above theirs."""
    off = f"the manifest's {OFF_THE_SCANS} (frame 0: 0.68 mm off): check which curve belongs to which frame"
    row = {"rms_mm": 2.0, "null_roll_unknown_rms_mm": 0.82, "skill_strongest": -1.0, "strongest_null": "roll_unknown"}
    caveats = Caveats(warnings=weightiest_first(["few points", ROLLED, f"a: {off}"]))
    assert list(caveats.warnings) == [f"a: {off}", ROLLED, "few points"]
    said = verdict(row, caveats=caveats)
    found = "a: the manifest's own curves are not where the scans show the wire"
    assert f"The weightiest of 3 warnings: {found}. The wire is worse" in said, "what to check is among the warnings"
    assert "With an unknown roll" not in said
    assert not remarks(row, caveats=caveats)
    two_points = Caveats(warnings=[f"the wires have few points ({MOSTLY_LINES}): straight lines between them pass"])
    assert not remarks(row, "mine", two_points), "a wire of two points shows no roll, and few points are the cause"
    good = badge("ok", True, row | {"skill_strongest": 0.9}, Caveats(warnings=[off]))
    assert (good["text"], good["look"]) == ("ok, 1 warning", "poor")


def test_rounding_is_no_length() -> None:
    """A wire beside itself lay "2.35e-16 mm" from the true one."""
    said = verdict({"rms_mm": 0.2, "truth_rms_mm": 2.35e-16})
    assert said.endswith("From the true wire it lies 0 mm.")


def test_a_page_begins_with_three_sentences_and_says_each_definition_once() -> None:
    """Ten lines, a whole screen of a telephone, stood before the first number."""
    row = {"rms_mm": 0.36, "trace_sigma_mm": 0.3, "share_beyond_2u": 0.4, "frames": 4, "frames_ok": 3}
    row |= {
        "skill_strongest": 0.5,
        "skill_strongest_low": -0.1,
        "strongest_null": "another",
        "interval": "from 3 insertions only",
    }
    said, more = headline(row, defined=False)
    assert (
        "On these frames it is not shown to be better (skill 0.500, its interval reaches -0.100) than "
        "the predictor 'another insertion'."
    ) in said
    assert said.endswith("may look better than it is."), "whether it may be quoted was behind a click"
    assert "there the model is wrong, or an input is less certain than stated." in said
    assert len(more) == 2
    assert verdict(row).count(". ") > 4
    assert all(text in verdict(row) for text in more)


def test_a_page_of_copied_wires_names_no_predictor() -> None:
    """Below a verdict that named none stood what the predictor 'centreline' is."""
    row = {"rms_mm": 0.01, "skill_strongest": 0.99, "strongest_null": "centreline"}
    assert headline(row, caveats=Caveats(copied="a: made")) == ("a: made.", [])


def test_a_wrong_roll_is_guessed_at() -> None:
    row = {"rms_mm": 2.0, "null_roll_unknown_rms_mm": 0.82, "skill_strongest": -1.0, "strongest_null": "roll_unknown"}
    assert (
        "With an unknown roll the wire lies nearer (0.820 mm): check axes (LPS or RAS) and roll; roll_deg"
        in verdict(row)
    )
    assert "check axes" not in verdict(row | {"null_roll_unknown_rms_mm": 1.9})
    of_another = verdict(row, simulator="floppy")  # "the wire lies nearer" read as if it were the simulator's
    assert "The mean of wireval's wires of all rolls lies nearer (0.820 mm)" in of_another
    said = verdict(row)  # it was said twice, and "That is worse" had lost its noun
    assert said.count("worse") == 1
    assert said.index("The wire is worse (skill -1.00)") < said.index("With an unknown roll")


def test_what_a_terminal_warns_of_beside_the_warnings_below_is_not_lost_in_their_count() -> None:
    """It told two warnings, and the page "1 warning below"."""
    row = {"rms_mm": 2.0, "null_roll_unknown_rms_mm": 0.82, "skill_strongest": -1.0, "strongest_null": "roll_unknown"}
    assert "1 more warning below." in verdict(row, caveats=Caveats(warnings=["few points"]))


def test_a_roll_is_to_be_fitted_only_where_it_can_be_and_is_not() -> None:
    row = {"rms_mm": 2.0, "null_roll_unknown_rms_mm": 0.82, "skill_strongest": -1.0, "strongest_null": "roll_unknown"}
    assert 'roll_deg = "fit"' in verdict(row | {"frames_fitted": 0}, "wireval")
    fitted = verdict(row | {"frames_fitted": 1})
    assert 'roll_deg = "fit"' not in fitted
    assert "the roll was fitted on a frame: state it, or begin deeper" in fitted
    assert 'roll_deg = "fit"' not in verdict(row, "sofa")
    assert "the roll that this one was simulated with" in verdict(row, "sofa")


def test_a_run_without_a_score_says_why() -> None:
    assert "learns from every case" in unscored([("calibration", "ok"), ("calibration", "no_wire")])
    assert "to be compared with" in unscored([("validation", "simulated"), ("calibration", "ok")])
    assert unscored([("validation", "no_wire"), ("calibration", "ok")]) == ""
    assert unscored([]) == ""


def test_no_error_no_verdict_and_intervals_where_there_are_any() -> None:
    assert verdict({"frames_ok": 0}) == ""
    assert "95 % interval 0.200 to 0.310 mm" in verdict({"rms_mm": 0.25, "rms_low_mm": 0.2, "rms_high_mm": 0.31})


def test_an_end_that_nothing_bounds_is_no_better() -> None:
    """The field is empty as that of an interval that is withheld, and means the opposite."""
    row = {"rms_mm": 0.25, "skill_strongest": 0.9, "strongest_null": "previous", "interval": "from 4 insertions only"}
    assert "The wire is better" in verdict(row)
    row["interval"] += "; not bounded: rms_high_mm, skill_strongest_low"
    assert "It is not shown to be better (skill 0.900, its interval has no lower end)" in verdict(row)
    assert badge("ok", True, row)["look"] == "poor"


def test_worst_frames_leave_out_what_failed() -> None:
    table = pd.DataFrame({"frame": [0, 1, 2], "status": ["ok", "no_wire", "ok"], "p95_mm": [0.5, 9.0, 0.7]})
    rows = worst_frames({"a": table, "b": table.assign(p95_mm=0.6)}, {"a": "cases/a/report.html"})
    assert [(r["case"], r["frame"]) for r in rows] == [("a", 2), ("b", 0), ("b", 2), ("a", 0)]
    assert rows[0]["link"] == "cases/a/report.html"


def test_the_next_command_names_the_cases_and_forgets_what_would_widen_or_redo() -> None:
    typed = [
        "wireval",
        "run",
        "m.toml",
        "-o",
        "out",
        "--only",
        "x",
        "--case-timeout",
        "3",
        "--case-memory=9",
        "--fresh",
        "-j",
        "2",
    ]
    named = "-j 2 --only 'a b' --only c --resume"
    assert next_command(["a b", "c", "c"], typed, ["over_limit"]) == f"wireval run m.toml -o out {named}"
    # a limit that stopped no case is kept: on a cluster it is why a hanging one ends
    limits = "--case-timeout 3 --case-memory=9"
    assert next_command(["a b", "c"], typed, ["load_failed"]) == f"wireval run m.toml -o out {limits} {named}"
    assert next_command(["c"], ["python", "my_script.py"]) == "wireval run MANIFEST -o OUT --only c --resume"
    assert next_command("abcde").count("--only") == 5
    assert "--only" not in next_command("abcdef")


def test_the_command_of_a_folder_is_read_from_its_provenance(tmp_path: Path) -> None:
    assert typed(tmp_path) == ()
    (tmp_path / "provenance.json").write_text('{"argv": ["wireval", "run", "m.toml", "-o", "out"]}', encoding="utf-8")
    assert next_command(["c"], typed(tmp_path)) == "wireval run m.toml -o out --only c --resume"


def test_frames_as_bad_as_each_other_stand_by_case() -> None:
    table = pd.DataFrame({"frame": [0], "status": ["ok"], "p95_mm": [0.5]})
    assert [row["case"] for row in worst_frames({"b": table.assign(frame=1), "a": table.assign(frame=2)}, {})] == [
        "a",
        "b",
    ]


def test_a_warning_of_several_cases_is_one_line_on_the_terminal(tmp_path: Path) -> None:
    """Two cases in one phantom said all of it twice: failures and the next command scrolled out of sight."""
    out = write_run(tmp_path / "out", [FakeCase(name, frames=3, failed=(1,)) for name in "ab"])
    assert warned(out) == ["warning: a, b: roll is unknown and was taken as 0"]


def test_cases_that_are_worse_than_a_guess_are_named() -> None:
    row = {"case": "a", "role": "validation", "rms_mm": 0.3, "strongest_null": "previous", "skill_strongest": 0.9}
    worse = row | {"case": "b", "skill_strongest": -0.6}
    assert worse_sentence([row, worse]) == "1 of 2 cases is worse than a guess: b."
    assert worse_sentence([row, worse, worse | {"case": "c"}]) == "2 of 3 cases are worse than a guess: b, c."
    assert one_case([row, worse]) == "a case is worse than a guess"
    assert worse_sentence([row, worse | {"skill_strongest": -0.05}]) == "", "that is no better, and not worse"
    assert worse_sentence([row, worse | {"role": "calibration"}]) == ""
    assert worse_sentence([worse]) == "", "all else on the page speaks of this case"


@pytest.mark.parametrize(("rms_mm", "said"), [(0.51, "c lies 6 times as far off"), (0.3, ""), (0.51, "")])
def test_a_case_that_lies_far_off_is_named(rms_mm: float, said: str) -> None:
    """A roll in radians made the interval 0.006 to 42 mm, and the advice was to scan more."""
    rows = [{"case": name, "rms_mm": 0.08, "skill_strongest": 0.9, "strongest_null": "previous"} for name in "abc"]
    rows[2]["rms_mm"] = rms_mm
    if not said and rms_mm > 0.5:
        rows = rows[1:]  # of two nobody knows which is the odd one
    assert worse_sentence(rows).startswith(said)
    assert bool(worse_sentence(rows)) is bool(said)
    assert one_case(rows) == ("a case lies far off" if said else ""), "the badge called it worse than a guess"


def test_a_wide_interval_is_said_to_be_the_doing_of_few_insertions() -> None:
    """With three insertions a wire of a fifth of the error of the best guess was "not shown to be better"."""
    row = {"rms_mm": 0.085, "skill_strongest": 0.96, "strongest_null": "another", "skill_strongest_low": -3.2}
    assert "Intervals over 3 insertions are wide" in verdict(row | {"interval": "from 3 insertions only"})
    assert "are wide" not in verdict(row | {"interval": "over 8 insertions"})
    assert "are wide" not in verdict(row | {"interval": "from 3 insertions only", "skill_strongest_low": 0.4})


def test_intervals_over_short_insertions_are_said_to_be_too_narrow_perhaps() -> None:
    """With one frame in twenty far off, intervals over insertions of 3 to 10 frames hold the true value in 82 to 89 %,
    and only those of 25 frames in 92 %: nothing said so."""
    row = {"rms_mm": 0.25, "rms_low_mm": 0.2, "rms_high_mm": 0.3, "frames": 30, "frames_ok": 30, "insertions": 6}
    said = "Insertions of 5 frames miss rare ones that are far off: below 25, intervals may be too narrow."
    assert said in verdict(row)
    assert "Insertions of 24 frames" in verdict(row | {"frames_ok": 749, "insertions": 30}), "it was 25, fewer than 25"
    assert "too narrow" not in verdict(row | {"frames": 150, "frames_ok": 150})
    assert "too narrow" not in verdict(row | {"rms_low_mm": None}), "there is no interval"
