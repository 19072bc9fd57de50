"""What a page says first: how far the wire is off, and whether that is better than a guess."""

import re
from collections.abc import Iterator, Mapping
from math import inf, isnan, nan
from typing import Any

from reports._content import NOTHING, fewer_frames, interval, length, number, predictor_label, skill_told, value_of
from reports.case_files import counted
from reports.doubts import NO_CAVEATS, Caveats
from reports.few_insertions import alone_in, narrow_of_short, of_these_alone, over_few, wide_over_few
from reports.schema import OURS, SUMMARY
from reports.tips import tips_off

_LISTS = re.compile(r" \([^()]*\b(?:frame|case)s? [^()]*\)")  # frame after frame, which the warning itself has


def verdict(statistics: Mapping[str, Any], simulator: str = "", caveats: Caveats = NO_CAVEATS) -> str:
    """How far the simulated wire is from the traced one, and whether that is better than the best guess, in sentences.

    statistics : a row of summary.csv or overall.csv.     simulator : whose wire it is, where there are several.
    """
    return " ".join(text for text, _ in _sentences(statistics, simulator, caveats, defined=True))


def headline(
    statistics: Mapping[str, Any], simulator: str = "", caveats: Caveats = NO_CAVEATS, *, defined: bool = True
) -> tuple[str, list[str]]:
    """The ``verdict`` as a page has it: what comes first, and the sentences of the list below.

    Ten lines, a whole screen of a telephone, stood before the first number. defined : whether the list says what the
    predictor is, which a page of several simulators says once for all.
    """
    said = list(_sentences(statistics, simulator, caveats, defined=False))
    more, rival = [text for text, first in said if not first], statistics.get("strongest_null")
    if defined and said and not caveats.copied and number(statistics.get("skill_strongest")) != NOTHING:
        more.append(f"The predictor {predictor_label(str(rival))!r} is {meaning_of_rival(str(rival))}.")
    return " ".join(text for text, first in said if first), more


def _sentences(
    statistics: Mapping[str, Any], simulator: str, caveats: Caveats, *, defined: bool
) -> Iterator[tuple[str, bool]]:
    """The verdict's sentences, each with whether it belongs into the headline."""
    if caveats.copied:
        yield _ended(caveats.copied), True
        return
    rms, true = (length(statistics.get(key)) for key in ("rms_mm", "truth_rms_mm"))
    if rms == NOTHING:
        return
    against, few, weaker = _against(statistics, defined=defined)
    again = f"But {TWINS} that was scanned again, and count as several: see the warnings." * bool(caveats.twins)
    said = [
        (_far(statistics, simulator, rms), True),
        (f"From the true wire it lies {true} mm." * (true != NOTHING), True),
        (_at_the_floor(statistics), False),
        (_beyond_inputs(statistics), True),
        (_warned(caveats, beside=bool(remarks(statistics, simulator, caveats))), True),
        (tips_off(statistics), True),
        (against, True),
        (weaker, True),
        (of_these_alone(alone_in(statistics, *_skill(statistics)[1:])), True),
        (few, False),
        (narrow_of_short(statistics), False),
        (_unknown_roll(statistics, simulator, caveats), True),
        (again, True),
    ]
    yield from ((text, first) for text, first in said if text)


def _far(statistics: Mapping[str, Any], simulator: str, rms: str) -> str:
    """How far the wire lies off, with its interval."""
    ends = interval(statistics.get("rms_low_mm"), statistics.get("rms_high_mm"))
    whose = f"he wire of {simulator}" if simulator else "he simulated wire"
    some = _of_frames(statistics)
    sentence = f"{f'On {some} alone t' if some else 'T'}{whose} lies {rms} mm (rms) from the traced one"
    few = over_few(statistics)
    sentence += f", 95 % interval {ends} mm" + f" (from {few} only)" * bool(few) if ends else ""
    tail = length(statistics.get("p95_mm"))
    return sentence + (f"; 95 % of its points lie within {tail} mm." if tail != NOTHING else ".")


def _ended(text: str) -> str:
    """A sentence with its full stop; a warning may end with a question."""
    return text if text.endswith(("?", ".")) else f"{text}."


def _warned(caveats: Caveats, *, beside: bool) -> str:
    """How many warnings stand below, and what the weightiest finds that speaks against an input: with a roll 25 degrees
    off a wire was better than a guess, which was all that the first screen said.

    beside : whether the verdict itself holds what a terminal shows as one more warning.
    """
    if not caveats.against:
        what = "more warning" if beside else "warning"
        return f"{counted(len(caveats.warnings), what)} below." * bool(caveats.warnings)
    others = f"The weightiest of {len(caveats.warnings)} warnings" if len(caveats.warnings) > 1 else "A warning"
    found = _LISTS.sub("", caveats.against.partition(": check ")[0])
    return f"{others}: {_ended(found)}"


FLOOR_SIGMAS = 1.4142
"""The distance of a right wire from its trace over the trace's standard deviation along each of two axes."""


def _at_the_floor(statistics: Mapping[str, Any]) -> str:
    """That an error is no larger than a perfect wire's, where the traces are known no better than that."""
    floor = FLOOR_SIGMAS * value_of(statistics.get("trace_sigma_mm"))
    if not value_of(statistics.get("rms_mm")) <= floor:
        return ""
    return (
        f"By the traces' own standard deviation a perfect wire would lie {number(floor)} mm from them: of two wires "
        "that lie nearer than that, the nearer is not for that the better one."
    )


BEYOND_INPUTS = 0.1
"""Share of points beyond 2 u, of which chance makes 0.05, that is said beside the error itself: a wire that is better
than a guess, and for that ok, may still be farther off than anything that is not known of it explains."""


def _beyond_inputs(statistics: Mapping[str, Any]) -> str:
    """How much of an error is larger than its uncertainty, where that is more than chance."""
    share = value_of(statistics.get("share_beyond_2u"))
    if not share > BEYOND_INPUTS:
        return ""
    return (
        f"{100 * share:.0f} % of its points lie farther off than trace and inputs explain (5 % would by chance): "
        "there the model is wrong, or an input is less certain than stated."
    )


WORSE = "worse than a guess"
NO_BETTER, NOT_SHOWN = "no better than a guess", "not shown to be better than a guess"
TOO_FEW = "too few insertions to tell from a guess"
TIPS_OFF, COPIED, TWINS = "the tips lie off", "made from the traces", "insertions look like one"
NEVER_NEAREST = TIPS_OFF, COPIED
"""Why a simulator leads nowhere, whatever its distances to the traced wire."""


FAR_BELOW = 0.7
WORSE_BELOW = -0.1
"""Skill without an interval below which a wire is worse than its rival: an rms 5 % above that one's."""


def remarks(statistics: Mapping[str, Any], simulator: str = "", caveats: Caveats = NO_CAVEATS) -> list[str]:
    """What rms_mm and skill alone do not show, one sentence each. simulator, caveats : as in :func:`verdict`."""
    return [text for text in (tips_off(statistics), _unknown_roll(statistics, simulator, caveats)) if text]


def _unknown_roll(statistics: Mapping[str, Any], simulator: str, caveats: Caveats) -> str:
    """That a roll which is stated does worse than none, where the wire is no better than a guess.

    Not of traces that lie off the scans: a roll that is fitted to these hides it.
    """
    if caveats.shows_no_roll:
        return ""
    rms, unknown = (value_of(statistics.get(key)) for key in ("rms_mm", "null_roll_unknown_rms_mm"))
    if not _skill(statistics)[1] <= 0.0 or not unknown < FAR_BELOW * rms:
        return ""
    mend = 'check axes (LPS or RAS) and roll; roll_deg = "fit" finds the roll of a wire that is simulated here'
    if simulator not in ("", OURS):
        nearer = f"The mean of {OURS}'s wires of all rolls lies nearer ({number(unknown)} mm)"
        return f"{nearer}: check axes (LPS or RAS), and the roll that this one was simulated with."
    if value_of(statistics.get("frames_fitted")) > 0:
        mend = "check axes (LPS or RAS) and the wire's tip; the roll was fitted on a frame: state it, or begin deeper"
    return f"With an unknown roll the wire lies nearer ({number(unknown)} mm): {mend}."


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


def badge(
    status: str, good: bool, statistics: Mapping[str, Any], caveats: Caveats = NO_CAVEATS, one_case: str = ""
) -> dict[str, str]:
    """The word beside a heading, and its look: good, poor (no better than a guess, though nothing failed) or bad.

    statistics : a row of summary.csv or overall.csv, empty where nothing was scored. What is ok and has warnings says
    how many, and is poor where one of them speaks against an input; its ``link`` leads to them. So is what too few
    insertions show.     one_case : what one case is that the numbers of all hide.
    """
    if good and caveats.copied:
        return {"text": COPIED, "look": "bad"}
    poor = (TWINS if caveats.twins else standing(statistics) or one_case) if good else ""
    if poor == NOT_SHOWN and _skill(statistics)[1] > 0.0 and wide_over_few(statistics):
        # wires of skill 0.97, 0.44 and 0.07 had one badge, as if none were any good
        poor = f"skill {number(_skill(statistics)[1])}: {TOO_FEW}"
    if not good or poor:
        return {"text": poor or status, "look": "poor" if poor else "bad"}
    alone = alone_in(statistics, *_skill(statistics)[1:])
    text = f"skill {number(_skill(statistics)[1])}: {alone} about others" if alone else status
    look = {"look": "poor" if alone or caveats.against else "good"}
    if not caveats.warnings:
        return {"text": text, **look}
    return {"text": f"{text}, {counted(len(caveats.warnings), 'warning')}", **look, "link": "#warnings"}


def _skill(statistics: Mapping[str, Any]) -> tuple[str, float, float, float]:
    """A rival in words, the skill against it and the ends of its interval; NaN for what is not known."""
    for column, name in (("skill_strongest", statistics.get("strongest_null")), ("skill", "centreline")):
        skill, least, most = (value_of(statistics.get(key)) for key in (column, f"{column}_low", f"{column}_high"))
        if isnan(least) and f"{column}_low" in str(statistics.get("interval")):  # named there: it has no lower end
            least = -inf
        if not isnan(skill) and name:
            strongest = f"the strongest trivial predictor: {meaning_of_rival(str(name))}"
            return strongest if column != "skill" else "the lumen's centreline", skill, least, most
    return "", nan, nan, nan


def in_short(statistics: Mapping[str, Any]) -> str:
    """The number to quote in one line of text; where the wire does not beat the predictor, that comes first."""
    _, skill, least, _ = _skill(statistics)
    if isnan(skill):
        return ""
    name = statistics.get("strongest_null") if number(statistics.get("skill_strongest")) != NOTHING else "centreline"
    rival = f"the predictor {predictor_label(str(name))!r}"
    value = " ".join(filter(None, (f"skill {skill_told(skill, f'{skill:.3f}')}", fewer_frames(statistics))))
    said = {
        TIPS_OFF: f"the tips lie off, judge by tip_median_mm ({value} against {rival})",
        WORSE: f"the simulated wire is worse than {rival} ({value})",
        NO_BETTER: f"the simulated wire is no better than {rival} ({value})",
        NOT_SHOWN: f"the simulated wire is not shown to be better than {rival} ({value}, {_interval_of(least)})",
    }
    return said.get(standing(statistics), f"{value} against {rival}")


def _against(statistics: Mapping[str, Any], *, defined: bool) -> tuple[str, str, str]:
    """Whether the skill, and its interval where there is one, is above zero; whose doing a wide interval is; and what
    else to know where frames failed."""
    rival, skill, least, _ = _skill(statistics)
    if not rival:
        return "", "", ""
    if not defined and number(statistics.get("skill_strongest")) != NOTHING:
        rival = f"the predictor {predictor_label(str(statistics.get('strongest_null')))!r}"
    value = " ".join(filter(None, (f"skill {skill_told(skill)}", fewer_frames(statistics))))
    unsure = f"{value}, {_interval_of(least)}" if least <= 0.0 else value
    would = "it is not shown to be better" if least <= 0.0 else "it would be better"
    said = {
        TIPS_OFF: f"By rms_mm alone {would} ({unsure})",
        WORSE: f"The wire is worse ({value})",
        NO_BETTER: f"The wire is no better ({value})",
        NOT_SHOWN: f"It is not shown to be better ({unsure})",
    }
    how = said.get(standing(statistics), f"The wire is better ({value})")
    few = wide_over_few(statistics) if least <= 0.0 < skill else ""
    if not _of_frames(statistics):
        return f"{how} than {rival}.", few, ""
    return f"On these frames {how[0].lower()}{how[1:]} than {rival}.", few, _weaker(statistics)


def _weaker(statistics: Mapping[str, Any]) -> str:
    """That predictors which guess from other wires had fewer of them, where frames failed.

    A lost half of an insertion took the partner of "another insertion": 0.926 instead of 0.563.
    """
    previous, another = (predictor_label(name) for name in ("previous", "another"))
    others = number(statistics.get("null_another_rms_mm")) != NOTHING
    whose = f"the predictors {previous!r} and {another!r}" if others else f"the predictor {previous!r}"
    return f"Frames failed, so {whose} had fewer wires to guess from: the skill may look better than it is."


def _of_frames(statistics: Mapping[str, Any]) -> str:
    """Over how many of the planned frames a verdict speaks, where it is not all of them; empty where it is."""
    good, planned = (value_of(statistics.get(key)) for key in ("frames_ok", "frames"))
    return f"{good:.0f} of {planned:.0f} planned frames" if good < planned else ""


def _interval_of(least: float) -> str:
    return f"its interval {'has no lower end' if least == -inf else f'reaches {skill_told(least)}'}"


def meaning_of_rival(name: str) -> str:
    """A predictor in words: what the meaning of its column says after the colon."""
    column = f"null_{name}_rms_mm"
    words = SUMMARY[column].meaning.partition("predictor: ")[2].partition(";")[0] if column in SUMMARY.names else ""
    return words or name.replace("_", " ")
