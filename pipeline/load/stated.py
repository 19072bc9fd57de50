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
_SPEAKS = re.compile(r"(?<![a-z])ras(?![a-z])|right[ _-]*anterior", re.IGNORECASE)


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
    """Space and unit by a table's comments, wherever they stand, else by the names of its columns (its first row).

    LoadError where comments speak of RAS and do not state it: such a wire was taken for LPS.
    """
    names = {c.strip().lower() for c in rows[0]} if rows else set()
    default = ("LPS", "mm") if {"x_mm", "y_mm", "z_mm"} <= names else ("", "")
    spaces = [match for line in comments for match in SPACE.finditer(line)]
    units = [(match[1] or match[2]).lower() for line in comments for match in _UNIT.finditer(line)]
    other = next((name for name in map(named_space, spaces) if name not in ("LPS", "RAS")), None)
    if other:
        raise refused(path, f"space {other}", "LPS or RAS", "turn the wire's axes, and write '# space: LPS'")
    spoken = next((line for line in (*comments, *sorted(names)) if _SPEAKS.search(line)), None)
    if spoken and not spaces:
        why = f"a line speaks of RAS ({spoken.strip()[:60]!r}), but the space is taken from '# space: RAS' alone"
        raise unusable(path, f"{why}; write it so, or '# space: LPS' if that is what it is in")
    _require_known(path, [line for line in comments if not SPACE.search(line)])
    _require_one(path, spaces, units, default)
    return named_space(spaces[0]) if spaces else default[0], units[0] if units else default[1]


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
