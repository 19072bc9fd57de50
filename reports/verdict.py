"""What a page says first: the verdict in a sentence, the worst frames, the command that comes next."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reports._content import NOTHING, interval, number
from reports.case_files import WORST, read_json
from reports.schema import SUMMARY

_MANY = 5


def verdict(statistics: Mapping[str, Any]) -> str:
    """How far the simulated wire is from the traced one, and whether that beats what anybody would have guessed.

    statistics : a row of summary.csv or overall.csv.
    """
    rms = number(statistics.get("rms_mm"))
    if rms == NOTHING:
        return ""
    ends = interval(statistics.get("rms_low_mm"), statistics.get("rms_high_mm"))
    sentence = f"The simulated wire lies {rms} mm (rms) from the traced one"
    sentence += f", 95 % interval {ends} mm" if ends else ""
    tail = number(statistics.get("p95_mm"))
    sentence += f"; 95 % of its points lie within {tail} mm." if tail != NOTHING else "."
    return " ".join(filter(None, (sentence, _against(statistics))))


NO_BETTER, NOT_SHOWN = "no better than a guess", "not shown to be better than a guess"


def standing(statistics: Mapping[str, Any]) -> str:
    """NO_BETTER or NOT_SHOWN; empty where the wire beats the strongest predictor, or nothing is known of that."""
    _, skill, least = _skill(statistics)
    return NO_BETTER if skill <= 0.0 else NOT_SHOWN if least <= 0.0 else ""


def badge(status: str, good: bool, statistics: Mapping[str, Any]) -> dict[str, str]:
    """The word beside a heading and its look: good, poor or bad. What ran well but is no better than a guess is poor.

    statistics : a row of summary.csv or overall.csv, empty where nothing was scored.
    """
    poor = standing(statistics) if good else ""
    return {"text": poor or status, "look": "poor" if poor else "good" if good else "bad"}


def unscored(cases: Iterable[tuple[str, str]]) -> str:
    """Why no error stands over a whole run, from role and status of its cases; empty where a case was to be scored."""
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


def _skill(statistics: Mapping[str, Any]) -> tuple[str, float, float]:
    """A rival in words, the skill against it and the lower end of its interval; NaN for what is not known."""
    nan = float("nan")
    for column, name in (("skill_strongest", statistics.get("strongest_null")), ("skill", "centreline")):
        skill, least = (statistics.get(key) for key in (column, f"{column}_low"))
        if number(skill) != NOTHING and name:
            rival = _rival(str(name)) if column != "skill" else "the lumen's centreline"
            return rival, float(skill or 0.0), nan if number(least) == NOTHING else float(least or 0.0)
    return "", nan, nan


def _against(statistics: Mapping[str, Any]) -> str:
    """Whether the skill, and the lower end of its interval where there is one, is above zero."""
    rival, skill, least = _skill(statistics)
    if not rival:
        return ""
    said = {
        NO_BETTER: f"That is no better (skill {number(skill)})",
        NOT_SHOWN: f"It is not shown to be better (the skill's interval reaches {number(least)})",
    }
    return f"{said.get(standing(statistics), f'That is better (skill {number(skill)})')} than {rival}."


def _rival(name: str) -> str:
    """A predictor in words: what the meaning of its column says after the colon."""
    column = f"null_{name}_rms_mm"
    words = SUMMARY[column].meaning.partition("predictor: ")[2].partition(";")[0] if column in SUMMARY.names else ""
    return f"the strongest trivial predictor: {words or name.replace('_', ' ')}"


def worst_frames(tables: Mapping[str, pd.DataFrame], links: Mapping[str, str]) -> list[dict[str, Any]]:
    """The frames that are scored and worst, worst first: case, frame, text and link of each.

    tables : errors.csv by case.     links : of the cases' pages.
    """
    good = {case: table[table["status"].eq("ok") & table[WORST].notna()] for case, table in tables.items()}
    rows = [(float(v), case, int(n)) for case, t in good.items() for n, v in zip(t["frame"], t[WORST], strict=True)]
    rows.sort(key=lambda row: (-row[0], *row[1:]))
    return [
        {"case": case, "frame": frame, "text": number(value), "link": links.get(case, "")}
        for value, case, frame in rows[:_MANY]
    ]


def typed(folder: Path) -> Sequence[str]:
    """The command that wrote a run's or a case's folder; none where nothing tells."""
    words = read_json(folder / "provenance.json").get("argv", ())
    return [str(word) for word in words] if isinstance(words, list) else ()


def next_command(cases: Iterable[str], typed: Sequence[str] = ()) -> str:
    """The command that computes these cases again.

    typed : the command of this run, where it is known; MANIFEST and OUT stand where it is not. More than a few cases
    are not named: what is finished is kept anyway.
    """
    named = list(dict.fromkeys(cases))
    only = [word for case in named for word in ("--only", case)] if len(named) <= _MANY else []
    head = list(typed) if list(typed[:2]) == ["wireval", "run"] else ["wireval", "run", "MANIFEST", "-o", "OUT"]
    kept, words = [], iter(head)
    for word in words:
        if word == "--only":
            next(words, None)
        elif word != "--fresh" and not word.startswith("--only="):
            kept.append(word)
    return shlex.join([*kept, *only])
