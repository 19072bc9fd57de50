"""What a reader looks at next: the worst frames, what is warned of, the command that comes after this one."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reports._content import number
from reports.case_files import WORST, counted, results_in
from reports.doubts import doubted, said_by_cases, weightiest_first
from reports.records import read_json

_MANY = 5
_LIMITS = "--case-timeout", "--case-memory"
"""Options that the next command leaves out where they stopped a case: they would again."""


def worst_frames(tables: Mapping[str, pd.DataFrame], links: Mapping[str, str]) -> list[dict[str, Any]]:
    """The scored frames with the largest errors, worst first: case, frame, text and link of each.

    tables : errors.csv by case.     links : those of the cases' pages.
    """
    good = {case: table[table["status"].eq("ok") & table[WORST].notna()] for case, table in tables.items()}
    rows = [(float(v), case, int(n)) for case, t in good.items() for n, v in zip(t["frame"], t[WORST], strict=True)]
    rows.sort(key=lambda row: (-row[0], *row[1:]))
    return [
        {"case": case, "frame": frame, "text": number(value), "link": links.get(case, "")}
        for value, case, frame in rows[:_MANY]
    ]


def warned(out_dir: Path) -> list[str]:
    """What is doubtful among the cases of a run, and a few of the warnings in each, one line for each text.

    A text that several cases share is said once: on a screen of 30 lines the failures above should stay in sight.
    """
    lines = [f"warning: {text}" for text in weightiest_first(said_by_cases(results_in(out_dir), "warnings"))]
    rest = len(lines) - _MANY
    more = [f"{counted(rest, 'more warning')} on the pages of the cases"] * (rest > 0)
    return [*(f"warning: {text}" for text in doubted(out_dir)), *lines[:_MANY], *more]


def typed(folder: Path, name: str = "provenance.json") -> Sequence[str]:
    """The command that wrote a run's or a case's folder; none where nothing tells. name : that of a shard, say."""
    words = read_json(folder / name).get("argv", ())
    return [str(word) for word in words] if isinstance(words, list) else ()


def next_command(cases: Iterable[str], typed: Sequence[str] = (), statuses: Iterable[str] = ()) -> str:
    """The command that computes these cases again once what the messages say has been done.

    typed : the command of this run; where it is not known, MANIFEST and OUT stand for its arguments. More than a few
    cases are not named, since what is finished is kept anyway; ``score`` names none and keeps it without being asked.
    statuses : of what failed.
    """
    if list(typed[:2]) == ["wireval", "score"]:
        return shlex.join(word for word in typed if word != "--fresh")
    named = list(dict.fromkeys(cases))
    only = [word for case in named for word in ("--only", case)] if len(named) <= _MANY else []
    head = list(typed) if list(typed[:2]) == ["wireval", "run"] else ["wireval", "run", "MANIFEST", "-o", "OUT"]
    limits = _LIMITS if "over_limit" in statuses else ()
    kept, words, left_out = [], iter(head), ("--only", *limits, *("--shard",) * bool(only))
    for word in words:
        name, equals, _ = word.partition("=")
        if name in left_out:
            if not equals:
                next(words, None)
        elif word not in ("--fresh", "--resume"):
            kept.append(word)
    return shlex.join([*kept, *only, "--resume"])
