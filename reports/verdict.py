"""What a page says first: how far the wire is off, and whether that is better than a guess."""

from collections.abc import Iterable, Mapping
from math import inf, isnan, nan
from typing import Any

from reports._content import NOTHING, fewer_frames, interval, number, predictor_label
from reports.case_files import counted
from reports.doubts import NO_DOUBT, Doubt
from reports.schema import OURS, SUMMARY

_WIDE = "wide: "  # how the note on an interval over few insertions begins


def verdict(statistics: Mapping[str, Any], simulator: str = "", doubt: Doubt = NO_DOUBT) -> str:
    """How far the simulated wire is from the traced one, and whether that is better than the best guess, in sentences.

    statistics : a row of summary.csv or overall.csv.     simulator : whose wire it is, where there are several.
    """
    if doubt.copied:
        return f"{doubt.copied}."
    rms = number(statistics.get("rms_mm"))
    if rms == NOTHING:
        return ""
    ends = interval(statistics.get("rms_low_mm"), statistics.get("rms_high_mm"))
    whose = f"he wire of {simulator}" if simulator else "he simulated wire"
    some = _of_frames(statistics)
    sentence = f"{f'On {some} alone t' if some else 'T'}{whose} lies {rms} mm (rms) from the traced one"
    few = _over_few(statistics)
    sentence += f", 95 % interval {ends} mm" + f" (wide: {few})" * bool(few) if ends else ""
    tail = number(statistics.get("p95_mm"))
    sentence += f"; 95 % of its points lie within {tail} mm." if tail != NOTHING else "."
    true = number(statistics.get("truth_rms_mm"))
    sentence += f" From the true wire it lies {true} mm." * (true != NOTHING)
    sentence += _at_the_floor(statistics) + _beyond_inputs(statistics)
    again = f"But {TWINS} that was scanned again, and count as several: see the warnings." * bool(doubt.twins)
    judged = _warned(doubt), tips_off(statistics), _against(statistics), _unknown_roll(statistics, simulator, doubt)
    return " ".join(filter(None, (sentence, *judged, again)))


def _warned(doubt: Doubt) -> str:
    """How many warnings stand below, and the first that speaks against an input: with a roll 25 degrees off a wire was
    better than a guess, which was all that the first screen said.
    """
    if not doubt.against:
        return f"{counted(len(doubt.warnings), 'warning')} below." * bool(doubt.warnings)
    others = f"The weightiest of {len(doubt.warnings)} warnings" if len(doubt.warnings) > 1 else "A warning"
    return f"{others}: {doubt.against}."


FLOOR_SIGMAS = 1.4142
"""The distance of a right wire from its trace over the trace's standard deviation along each of two axes."""


def _at_the_floor(statistics: Mapping[str, Any]) -> str:
    """That an error is no larger than a perfect wire's, where the traces are known no better than that."""
    floor = FLOOR_SIGMAS * _number(statistics.get("trace_sigma_mm"))
    if not _number(statistics.get("rms_mm")) <= floor:
        return ""
    return (
        f" By the traces' own standard deviation a perfect wire would lie {number(floor)} mm from them: of two wires "
        "that lie nearer than that, the nearer is not for that the better one."
    )


BEYOND_INPUTS = 0.1
"""Share of points beyond 2 u, of which chance makes 0.05, that is said beside the error itself: a wire that is better
than a guess, and for that ok, may still be farther off than anything that is not known of it explains."""


def _beyond_inputs(statistics: Mapping[str, Any]) -> str:
    """How much of an error is larger than its uncertainty, where that is more than chance."""
    share = _number(statistics.get("share_beyond_2u"))
    if not share > BEYOND_INPUTS:
        return ""
    return (
        f" {100 * share:.0f} % of its points lie farther off than trace and inputs explain (5 % would by chance): "
        "there the model is wrong, or an input is less certain than stated."
    )


WORSE = "worse than a guess"
NO_BETTER, NOT_SHOWN = "no better than a guess", "not shown to be better than a guess"
TOO_FEW = "too few insertions to tell from a guess"
TIPS_OFF, COPIED, TWINS = "the tips lie off", "made from the traces", "insertions look like one"
NEVER_NEAREST = TIPS_OFF, COPIED
"""Why a simulator leads nowhere, whatever its distances to the traced wire."""
TIPS_OFF_RATIO, TIPS_OFF_MM = 3.0, 0.5
"""From which tip_median_mm on, over rms_mm and in mm, the tips contradict it. The 27 scenes of the catalogue, replayed
to the traced length, have ratios up to 2.4."""
NEAR_MM, LEAST_COVERED = 1.0, 0.95
"""Where the simulated wires lie so near the traced ones and less than this share of these has one as near, a part of
them is missing: of wires that fold back in a third of the frames the median tip is right."""
BACK_RATIO, BACK_MM = 2.0, 0.2
"""From which back_rms_mm on, over rms_mm and in mm, a part is missing. Of 1237 cases 90 % have ratios up to 1.05, and
none that was not made to end early above 1.9; those that end 2 mm early in half of their frames have 2.6 to 3.7."""


LEAST_TOLD = -10.0
"""Skill below which a sentence gives no number: 3.3 times the rival's error."""
FAR_BELOW = 0.7
WORSE_BELOW = -0.1
"""Skill without an interval below which a wire is worse than its rival: an rms 5 % above that one's."""


def remarks(statistics: Mapping[str, Any], simulator: str = "", doubt: Doubt = NO_DOUBT) -> list[str]:
    """What rms_mm and skill alone do not show, one sentence each. simulator, doubt : as in :func:`verdict`."""
    return [text for text in (tips_off(statistics), _unknown_roll(statistics, simulator, doubt)) if text]


def _unknown_roll(statistics: Mapping[str, Any], simulator: str, doubt: Doubt) -> str:
    """That a roll which is stated does worse than none, where the wire is no better than a guess.

    Not of traces that lie off the scans: a roll that is fitted to these hides it.
    """
    if doubt.shows_no_roll:
        return ""
    rms, unknown = (_number(statistics.get(key)) for key in ("rms_mm", "null_roll_unknown_rms_mm"))
    if not _skill(statistics)[1] <= 0.0 or not unknown < FAR_BELOW * rms:
        return ""
    mend = 'check axes (LPS or RAS) and roll; roll_deg = "fit" finds the roll of a wire that is simulated here'
    if simulator not in ("", OURS):
        mend = "check axes (LPS or RAS) and the roll that it was simulated with"
    elif _number(statistics.get("frames_fitted")) > 0:
        mend = "check axes (LPS or RAS) and the wire's tip; the roll was fitted on a frame: state it, or begin deeper"
    return f"With an unknown roll the wire lies nearer ({number(unknown)} mm): {mend}."


def tips_off(statistics: Mapping[str, Any]) -> str:
    """That the tips lie apart, which rms_mm misses: its distances go from the simulated wire to the traced one."""
    tip, rms, along = (_number(statistics.get(key)) for key in ("tip_median_mm", "rms_mm", "tip_along_median_mm"))
    unseen = "rms_mm does not see that, judge by tip_median_mm and back_rms_mm."
    if not tip > max(TIPS_OFF_MM, TIPS_OFF_RATIO * rms):
        covered, most = _number(statistics.get("coverage")), _number(statistics.get("p95_mm"))
        if covered < LEAST_COVERED and most <= NEAR_MM:
            return f"{100 * (1 - covered):.0f} % of the traced wires have no simulated one near: {unseen}"
        back = _number(statistics.get("back_rms_mm"))
        farther = (
            f"The traced wires lie {number(back)} mm from the simulated ones, which in some frames end early: {unseen}"
        )
        return farther if back > max(BACK_MM, BACK_RATIO * rms) else ""
    if along > 0.5 * tip:  # what lies beyond the trace counts with its distance from the trace's end
        return f"The wire ends {number(along)} mm beyond (median): judge by tip_median_mm."
    where = f"ends {number(-along)} mm short" if -along > 0.5 * tip else f"has its tip {number(tip)} mm off"
    return f"The wire {where} (median): {unseen}"


def standing(statistics: Mapping[str, Any]) -> str:
    """WORSE, NO_BETTER, TIPS_OFF or NOT_SHOWN; empty where the wire beats the strongest predictor, or nothing is known.

    WORSE where the whole interval of the skill is below zero or, without an interval, where the skill is below
    WORSE_BELOW. NOT_SHOWN where zero lies in the interval, whatever the skill.
    """
    _, skill, least, most = _skill(statistics)
    if skill <= 0.0:
        worse = most < 0.0 or (isnan(least) and isnan(most) and skill < WORSE_BELOW)
        return WORSE if worse else NOT_SHOWN if most > 0.0 else NO_BETTER
    return TIPS_OFF if tips_off(statistics) else NOT_SHOWN if least <= 0.0 else ""


def first_that_holds(words: Mapping[str, Any]) -> str:
    """The status of a run: of words for what may be wrong with it, the worst first, the first that is; else ok."""
    return next((word for word, so in words.items() if so), "ok")


def badge(status: str, good: bool, statistics: Mapping[str, Any], doubt: Doubt = NO_DOUBT) -> dict[str, str]:
    """The word beside a heading, and its look: good, poor (no better than a guess, though nothing failed) or bad.

    statistics : a row of summary.csv or overall.csv, empty where nothing was scored. What is ok and has warnings says
    how many, and is poor where one of them speaks against an input; its ``link`` leads to them.
    """
    if good and doubt.copied:
        return {"text": COPIED, "look": "bad"}
    poor = (TWINS if doubt.twins else standing(statistics)) if good else ""
    if poor == NOT_SHOWN and _skill(statistics)[1] > 0.0 and _few_insertions(statistics):
        # wires of skill 0.97, 0.44 and 0.07 had one badge, as if none were any good
        poor = f"skill {number(_skill(statistics)[1])}: {TOO_FEW}"
    if good and not poor and doubt.warnings:
        text = f"{status}, {counted(len(doubt.warnings), 'warning')}"
        return {"text": text, "look": "poor" if doubt.against else "good", "link": "#warnings"}
    return {"text": poor or status, "look": "poor" if poor else "good" if good else "bad"}


OF_CALIBRATION = (
    "It is a calibration case and not scored: parameters are learnt from it, so its errors say nothing about the "
    "simulator and stand in no score of the run."
)


def unscored(cases: Iterable[tuple[str, str]]) -> str:
    """Why a run has no error over all its cases; empty where one was to be scored. cases : role and status of each."""
    known = [(str(role), str(status)) for role, status in cases]
    learnt = [role == "calibration" for role, _ in known]
    if known and all(learnt):
        return (
            'Nothing is scored: every case has role = "calibration", and frames that parameters are learnt from say '
            'nothing about the simulator; add insertions of role = "validation". wireval calibrate learns from these.'
        )
    if known and all(own or status == "simulated" for own, (_, status) in zip(learnt, known, strict=True)):
        return "Nothing is scored: no case has scans, traces or projections of a real wire to be compared with."
    return ""


def _number(value: Any) -> float:
    """A field as a number, NaN where it is empty."""
    return nan if number(value) == NOTHING else float(value)


def _skill(statistics: Mapping[str, Any]) -> tuple[str, float, float, float]:
    """A rival in words, the skill against it and the ends of its interval; NaN for what is not known."""
    for column, name in (("skill_strongest", statistics.get("strongest_null")), ("skill", "centreline")):
        skill, least, most = (_number(statistics.get(key)) for key in (column, f"{column}_low", f"{column}_high"))
        if isnan(least) and f"{column}_low" in str(statistics.get("interval")):  # named there: it has no lower end
            least = -inf
        if not isnan(skill) and name:
            return _rival(str(name)) if column != "skill" else "the lumen's centreline", skill, least, most
    return "", nan, nan, nan


def in_short(statistics: Mapping[str, Any]) -> str:
    """The number to quote in one line of text; where the wire does not beat the predictor, that comes first."""
    _, skill, least, _ = _skill(statistics)
    if isnan(skill):
        return ""
    name = statistics.get("strongest_null") if number(statistics.get("skill_strongest")) != NOTHING else "centreline"
    rival = f"the predictor {predictor_label(str(name))!r}"
    value = " ".join(filter(None, (f"skill {_at_least(skill, f'{skill:.3f}')}", fewer_frames(statistics))))
    said = {
        TIPS_OFF: f"the tips lie off, judge by tip_median_mm ({value} against {rival})",
        WORSE: f"the simulated wire is worse than {rival} ({value})",
        NO_BETTER: f"the simulated wire is no better than {rival} ({value})",
        NOT_SHOWN: f"the simulated wire is not shown to be better than {rival} ({value}, {_interval_of(least)})",
    }
    return said.get(standing(statistics), f"{value} against {rival}")


def _against(statistics: Mapping[str, Any]) -> str:
    """Whether the skill, and its interval where there is one, is above zero; what else to know where frames failed."""
    rival, skill, least, _ = _skill(statistics)
    if not rival:
        return ""
    value = " ".join(filter(None, (f"skill {_at_least(skill, number(skill))}", fewer_frames(statistics))))
    unsure = f"{value}, {_interval_of(least)}" if least <= 0.0 else value
    would = "it is not shown to be better" if least <= 0.0 else "it would be better"
    said = {
        TIPS_OFF: f"By rms_mm alone {would} ({unsure})",
        WORSE: f"The wire is worse ({value})",
        NO_BETTER: f"The wire is no better ({value})",
        NOT_SHOWN: f"It is not shown to be better ({unsure})",
    }
    how = said.get(standing(statistics), f"The wire is better ({value})")
    few = _few_insertions(statistics) if least <= 0.0 < skill else ""
    how, weaker = (f"On these frames {how[0].lower()}{how[1:]}", _WEAKER) if _of_frames(statistics) else (how, "")
    return " ".join(filter(None, (f"{how} than {rival}.", few, weaker)))


# a lost half of an insertion took the partner of "another insertion": 0.926 instead of 0.563
_WEAKER = (
    "The skill may flatter: predictors that take wires of other frames or insertions are weaker without the others."
)


def _few_insertions(statistics: Mapping[str, Any]) -> str:
    """Whose doing it is that an interval over few insertions is wide: not the wire's alone."""
    few = _over_few(statistics)
    return f"Intervals over {few} are wide: a perfect wire may have such a one; scan six or more." * bool(few)


def _over_few(statistics: Mapping[str, Any]) -> str:
    """Over how many insertions intervals are, where that makes them wide; else empty."""
    told = str(statistics.get("interval")).partition("; ")[0]
    return told.removeprefix(_WIDE) if told.startswith(_WIDE) else ""


def of_these_alone(statistics: Mapping[str, Any]) -> str:
    """That a skill without an interval is only about the insertions at hand: three give a wide one."""
    withheld = "withheld" in str(statistics.get("interval")) and _skill(statistics)[1] > 0.0
    alone = (
        "The skill is of these insertions alone: three give an interval over what others would, six one not so wide."
    )
    return alone * withheld


def _of_frames(statistics: Mapping[str, Any]) -> str:
    """Over how many of the planned frames a verdict speaks, where it is not all of them; empty where it is."""
    good, planned = (_number(statistics.get(key)) for key in ("frames_ok", "frames"))
    return f"{good:.0f} of {planned:.0f} planned frames" if good < planned else ""


def _interval_of(least: float) -> str:
    return f"its interval {'has no lower end' if least == -inf else f'reaches {_at_least(least, number(least))}'}"


def _at_least(skill: float, text: str) -> str:
    """A skill in words: how far below LEAST_TOLD it is says no more, since a rival's error may be next to nothing."""
    return text if skill >= LEAST_TOLD else f"below {LEAST_TOLD:g}"


def _rival(name: str) -> str:
    """A predictor in words: what the meaning of its column says after the colon."""
    column = f"null_{name}_rms_mm"
    words = SUMMARY[column].meaning.partition("predictor: ")[2].partition(";")[0] if column in SUMMARY.names else ""
    return f"the strongest trivial predictor: {words or name.replace('_', ' ')}"
