"""What a page says first: the verdict in a sentence, the worst frames, the command that comes next."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from reports._content import NOTHING, interval, number
from reports.case_files import WORST

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


def _against(statistics: Mapping[str, Any]) -> str:
    """Whether the skill, and the lower end of its interval where there is one, is above zero."""
    for column, name in (("skill_strongest", statistics.get("strongest_null")), ("skill", "centreline")):
        skill = statistics.get(column)
        if number(skill) != NOTHING and name:
            least = statistics.get(f"{column}_low")
            known = number(least) != NOTHING
            rival = f"the predictor {str(name).replace('_', ' ')}" if column != "skill" else "the lumen's centreline"
            if float(skill or 0.0) <= 0.0:
                return f"That is no better than {rival} (skill {number(skill)})."
            if known and float(least or 0.0) <= 0.0:
                return f"That it is better than {rival} is not shown: the skill's interval reaches {number(least)}."
            return f"That is better than {rival} (skill {number(skill)})."
    return ""


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
