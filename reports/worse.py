"""Cases that a number over all of them hides: worse than a guess, or far off beside the others."""

from collections.abc import Iterable, Mapping, Sequence
from statistics import median
from typing import Any

from reports._content import NOTHING, number
from reports.case_files import listed
from reports.verdict import WORSE, standing


def worse_cases(rows: Iterable[Mapping[Any, Any]]) -> list[str]:
    """Cases whose wire is worse than a guess, which a number over all cases does not show. rows : of summary.csv."""
    return [str(row["case"]) for row in _scored(rows) if standing(row) == WORSE]


def worse_sentence(rows: Sequence[Mapping[Any, Any]]) -> str:
    """The cases worse than a guess, and the one with far larger errors than the others; empty without any.

    Empty, too, for one case alone, of which everything else on the page speaks.
    """
    worse, scored = worse_cases(rows), len(_scored(rows))
    are = "is" if len(worse) == 1 else "are"
    said = f"{len(worse)} of {scored} cases {are} {WORSE}: {listed(worse)}." if worse and scored > 1 else ""
    return " ".join(filter(None, (said, _far_off(rows))))


def one_case(rows: Sequence[Mapping[Any, Any]]) -> str:
    """What the sentence says, for a badge."""
    if len(_scored(rows)) > 1 and worse_cases(rows):
        return f"a case is {WORSE}"
    return "a case lies far off" * bool(_far_off(rows))


FAR_OFF, FAR_OFF_MM = 4.0, 0.2
"""Times the median case's rms, and mm, from which a case has an error of its own: those of `make validate` are within
1.3 times. It makes an interval as wide as may be, which more insertions would not mend."""


def _far_off(rows: Sequence[Mapping[Any, Any]]) -> str:
    """That one case of several lies far off; empty where none does."""
    off = {str(row["case"]): float(row["rms_mm"]) for row in _scored(rows)}
    if len(off) < 3:
        return ""
    usual, case = median(off.values()), max(off, key=lambda name: off[name])
    if not off[case] > max(FAR_OFF * usual, FAR_OFF_MM):
        return ""
    return (
        f"{case} lies {off[case] / max(usual, 1e-3):.0f} times as far off as the median case ({number(off[case])} "
        f"against {number(usual)} mm): look at its inputs first."
    )


def _scored(rows: Iterable[Mapping[Any, Any]]) -> list[Mapping[Any, Any]]:
    return [row for row in rows if row.get("role") != "calibration" and number(row.get("rms_mm")) != NOTHING]
