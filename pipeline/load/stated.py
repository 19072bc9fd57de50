"""What the numbers of a curve's file mean, by what it or its format says: space and unit."""

import re
from collections.abc import Sequence
from pathlib import Path

from pipeline.arrays.polyline import UNITS_MM
from pipeline.load.geometry import refused, unusable
from pipeline.load.surfaces import SPACE, named_space, space_of

HEAD = 4096  # bytes of a file of 3D Slicer or VTK in which it says what it is
_UNIT = re.compile(
    r"(?:units?|coordinateUnits)\"?\s*[:=,]\s*\"?(?:in[ \t]+)?([A-Za-zµμ]+)|lengths in (\w+)", re.IGNORECASE
)
"""A word before the unit may be a preposition: "in mm" is no inch."""
_SPACE_OF = re.compile(
    r"(?<![a-z])(?:(?:space|coordinate[ _-]?system)\"?\s*[:=,]\s*\"?([a-z]\w*)"
    r"|(?:coordinates|orientation|axes)\"?\s*[:=,]\s*\"?([RLAPSI]{3})\b)",
    re.IGNORECASE,
)
"""Any word that is given as the space: SPACE knows some."""
_OTHER_UNITS = "|".join(name for name, mm in UNITS_MM.items() if mm != 1.0 and name not in ("in", "m"))
_ENDS = r"(?=[\s,;:()\[\]]|\.?\s*$)"
_SPEAKS = {
    of: re.compile(rf"(?<![a-z])(?:{pattern})", re.IGNORECASE)
    for of, pattern in {
        "RAS": r"ras(?![a-z])|right[ _-]*anterior",
        "voxels": r"in[ \t]+(?:vox|pix)els(?![a-z])|(?:vox|pix)els?[ _-]*(?:ind|coord|unit)|ijk(?![a-z])"
        r"|(?<!smoothed in )(?<!filtered in )(?:vox|pix)els?[ _-]*space",
        "a unit": rf"(?:in[ \t]+m|(?:in|is|are)[ \t]+(?:{_OTHER_UNITS})){_ENDS}"
        rf"|(?<=[\[(])(?:m|in|{_OTHER_UNITS})(?=[\])])|^\s*#+\s*(?:m|{_OTHER_UNITS})\s*$",
    }.items()
}
"""What a line may speak of without stating it. "is m1" and "is m. cerebri media" name arteries."""
_MM = r"(?<!radius )(?<!radii )(?<![a-z])(?:in|is|are)[ \t]+(?:mm|millimet(?:er|re)s?)(?![a-z])"
_STATES = {
    of: re.compile(pattern, re.IGNORECASE)
    for of, pattern in {"RAS": r"(?!)", "voxels": rf"{_MM}|(?<![a-z])lps(?![a-z])", "a unit": _MM}.items()
}
"""What says that a line is of mm, whatever else it speaks of: "in mm (LPS), resampled from ijk". None for RAS."""


def stated_in(path: Path, kind: str) -> tuple[str, str]:
    """Space and unit that a file states, or that its format implies; empty where neither says. Not of tables."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    # 3D Slicer's files are in mm: its own, LPS unless they say otherwise, and VTK's, in which it writes SPACE=;
    # "space = ras" in a title is not written by Slicer, and says nothing of the unit
    markups, space = kind == ".mrk.json", space_of(head)
    slicer = markups or (bool(space) and b"SPACE" in head)
    unit = _UNIT.search(head.decode("latin-1"))
    return space or "LPS" * markups, (unit[1] or unit[2]).lower() if unit else "mm" * slicer


def stated_in_table(path: Path, rows: Sequence[Sequence[str]], comments: Sequence[str]) -> tuple[str, str]:
    """Space and unit by the comments of a table or tree, wherever they stand, else by names of columns (its first row).

    LoadError where comments speak of RAS, voxels or another unit and do not state it: such a wire was taken for LPS mm.
    """
    names = {c.strip().lower() for c in rows[0]} if rows else set()
    default = ("LPS", "mm") if {"x_mm", "y_mm", "z_mm"} <= names else ("", "")
    spaces = [match for line in comments for match in SPACE.finditer(line)]
    units = [(match[1] or match[2]).lower() for line in comments for match in _UNIT.finditer(line)]
    other = next((name for name in map(named_space, spaces) if name not in ("LPS", "RAS")), None)
    if other:
        raise refused(path, f"space {other}", "LPS or RAS", "turn the wire's axes, and write '# space: LPS'")
    if not spaces and (line := _spoken("RAS", (*comments, *sorted(names)))):
        raise unusable(path, f"a line speaks of RAS ({line!r}), but {_taken('space: RAS', 'LPS')}")
    if not units and not default[1] and (line := _spoken("a unit", comments)):
        raise unusable(path, f"a line speaks of a unit ({line!r}), but {_taken('unit: m', 'mm')}")
    if not spaces and not default[0] and (line := _spoken("voxels", comments)):
        raise refused(path, f"a line that speaks of voxels ({line!r})", "LPS or RAS", "write mm, and '# space: LPS'")
    _require_known(path, [line for line in comments if not SPACE.search(line)])
    _require_one(path, spaces, units, default)
    return named_space(spaces[0]) if spaces else default[0], units[0] if units else default[1]


def _spoken(of: str, lines: Sequence[str]) -> str:
    """The first line that speaks of something, and does not say that it is mm; empty where none does."""
    found = (line for line in lines if _SPEAKS[of].search(line) and not _STATES[of].search(line))
    return next((line.strip()[:60] for line in found), "")


def _taken(stated: str, usual: str) -> str:
    """How a space or unit is stated, as by ``stated``. usual : what it is mostly."""
    what = stated.partition(":")[0]
    taken = f"the {what} is taken from '# {stated}' alone"
    return f"{taken}; write it so, or '# {what}: {usual}' if that is what it is in"


def _require_known(path: Path, comments: Sequence[str]) -> None:
    """LoadError for a space that is none of an anatomy's, as voxels are: its numbers passed for LPS mm."""
    named = [match[1] or match[2] for line in comments for match in _SPACE_OF.finditer(line)]
    if other := next((name for name in named if name.upper() != "LPS"), None):
        raise refused(path, f"space {other}", "LPS or RAS", "write the points in one of these, and '# space: LPS'")


def _require_one(path: Path, spaces: Sequence[re.Match[str]], named: list[str], default: tuple[str, str]) -> None:
    """LoadError where the comments of a table contradict each other, or the names of its columns."""
    units = {unit: UNITS_MM.get(unit, unit) for unit in named}
    if units and default[1]:
        units[default[1]] = UNITS_MM[default[1]]
    for said in ({match[1].upper(): named_space(match) for match in spaces}, units):
        if len(set(said.values())) > 1:
            got = " and ".join(sorted(said))
            where = "in the comments of its table" + ", or its columns (x_mm)" * (said is units)
            raise refused(path, f"{got} {where}", "one of them", "correct the file")
