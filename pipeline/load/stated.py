"""What the numbers of a curve's file mean, by what it or its format says: space and unit."""

import re
from pathlib import Path

from pipeline.load.geometry import refused
from pipeline.load.outside import UNITS_MM
from pipeline.load.surfaces import space_of

HEAD = 4096  # bytes of a file in which it says what it is
_SPACE = re.compile(r"(?:SPACE|coordinateSystem)\"?\s*[:=]\s*\"?(LPS|RAS|[01]\b)", re.IGNORECASE)
_SPACES = {"1": "LPS", "0": "RAS"}  # as 3D Slicer numbers them
_UNIT = re.compile(r"(?:units?|coordinateUnits)\"?\s*[:=]\s*\"?([A-Za-z]+)|lengths in (\w+)", re.IGNORECASE)


def stated_in(path: Path, kind: str) -> tuple[str, str]:
    """Space and unit that a file states, or that its format implies; empty where neither says."""
    with path.open("rb") as file:
        head = file.read(HEAD).decode("latin-1")
    default = ("", "")
    if kind == ".csv":
        rows = [line for line in head.splitlines() if line.strip()]
        names = {c.strip().lower() for r in rows if not r.lstrip().startswith("#") for c in r.split(",")[:40]}
        head = "\n".join(line for line in rows if line.lstrip().startswith("#"))
        default = ("LPS", "mm") if {"x_mm", "y_mm", "z_mm"} <= names else ("", "")
    else:
        # 3D Slicer's files: LPS and mm unless they say otherwise; in VTK's it writes the space
        slicer, vtk = kind == ".mrk.json", space_of(head.encode("latin-1"))
        default = ("LPS" if slicer else vtk, "mm" if slicer or vtk else "")
    space, unit = _SPACE.search(head), _UNIT.search(head)
    if kind == ".csv":
        _require_one(path, head, default)
    said = _SPACES.get(space[1], space[1].upper()) if space else default[0]
    return said, (unit[1] or unit[2]).lower() if unit else default[1]


def _require_one(path: Path, head: str, default: tuple[str, str]) -> None:
    """LoadError where the lines above a table contradict each other, or the names of its columns."""
    spaces = {match[1].upper(): _SPACES.get(match[1], match[1].upper()) for match in _SPACE.finditer(head)}
    named = [(match[1] or match[2]).lower() for match in _UNIT.finditer(head)]
    units = {unit: UNITS_MM.get(unit, unit) for unit in named}
    if units and default[1]:
        units[default[1]] = UNITS_MM[default[1]]
    for said in (spaces, units):
        if len(set(said.values())) > 1:
            got = " and ".join(sorted(said))
            where = "in the lines above its table" + ", or its columns (x_mm)" * (said is not spaces)
            raise refused(path, f"{got} {where}", "one of them", "correct the file")
