"""What few or short insertions tell: three have a wide interval, fewer have none, and short ones one too narrow."""

import re
from collections.abc import Mapping
from math import floor, isnan
from typing import Any

from reports._content import value_of
from reports.case_files import counted

SHORT = 25
"""Frames of an insertion from which its interval holds the true value as often as it says (in 92 to 98 %)."""
_WITHHELD = re.compile(r"withheld: (\d+) insertion")
_FEW = re.compile(r"from (.*) only")  # the note on an interval over few insertions


def wide_over_few(statistics: Mapping[str, Any]) -> str:
    """Whose doing it is that an interval over few insertions is wide: not the wire's alone."""
    few = over_few(statistics)
    return f"Intervals over {few} are wide, even of a perfect wire: scan six or more." * bool(few)


def over_few(statistics: Mapping[str, Any]) -> str:
    """Over how many insertions intervals are, where that makes them wide; else empty."""
    found = _FEW.fullmatch(str(statistics.get("interval")).partition("; ")[0])
    return found[1] if found else ""


def narrow_of_short(statistics: Mapping[str, Any]) -> str:
    """That intervals over insertions of few frames may be too narrow: most of these hold no frame that is far off."""
    good, of = (value_of(statistics.get(key)) for key in ("frames_ok", "insertions"))
    if isnan(value_of(statistics.get("rms_low_mm"))) or not good < SHORT * of:
        return ""
    frames = counted(max(1, floor(good / of)), "frame")
    return f"Insertions of {frames} miss rare ones that are far off: below {SHORT}, intervals may be too narrow."


def alone_in(statistics: Mapping[str, Any], skill: float, least: float, most: float) -> str:
    """That insertions which are too few for an interval of their skill show nothing; empty where it has one, or is no
    claim. least, most : its ends.

    One insertion of skill 0.07 was better than a guess, and four of the same skill were not shown to be.
    """
    found = _WITHHELD.search(str(statistics.get("interval")))
    if not found or not skill > 0.0 or not (isnan(least) and isnan(most)):
        return ""
    return "one insertion shows nothing" if found[1] == "1" else f"{found[1]} insertions show nothing"


def of_these_alone(alone: str) -> str:
    """The same as a sentence, with how many insertions show more."""
    return f"{alone[0].upper()}{alone[1:]} about others: an interval needs three, a narrow one six." if alone else ""
