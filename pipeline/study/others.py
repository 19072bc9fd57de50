"""Another simulator's wires as a manifest names them (``simulated``) and as ``wireval score --curves`` finds them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field
from pydantic.config import JsonDict

from pipeline.load.geometry import LoadError
from pipeline.load.guard import is_folder, size_of, status_of
from pipeline.load.order import in_order
from pipeline.load.wires import KINDS, kind_of
from pipeline.ranges import Strict
from pipeline.status import UsageError
from pipeline.study.sources import NAMES, Sources


class Others(Strict):
    """The files of one case. space, unit : of coordinates that no file states; where a file does, both must agree."""

    files: Sources = ()
    space: Literal["", "LPS", "RAS"] = ""
    unit: Literal["", "mm", "um", "cm", "m", "inch"] = ""


def written_out(value: Any) -> Any:
    """A pattern or a list stands for the files alone; a table names some."""
    if isinstance(value, dict) and "files" not in value:
        raise ValueError("a table without files; write {files = ...}, or leave the key out")
    return {"files": value} if isinstance(value, (str, list)) else value


WORDS: JsonDict = {"$comment": f"{NAMES['$comment']}, or a table {{files = ..., space = ..., unit = ...}}"}
OthersText = Annotated[Others | None, BeforeValidator(written_out), Field(json_schema_extra=WORDS)]


def found_for(case: str, place: Path, cases: Sequence[str]) -> list[Path]:
    """The files that a place holds for a case, in natural order: of ``--curves``, a folder, a file or a pattern.

    A folder holds one of its own for each case (``CASE/`` or ``CASE.h5``) or is an output of `wireval run`; where the
    manifest has one case, it may hold the files themselves. Of a case that has none there, where another of ``cases``
    has, nothing is found: the simulator wrote nothing for it. Raises UsageError where none of this is so.
    """
    alone = len(cases) == 1
    if any(mark in place.name for mark in "*?["):
        return _matching(case, place) if alone else _refuse(case, place, "a pattern serves one case")
    if status_of(place) is None:
        raise UsageError([f"--curves {place}: no such file or folder"])
    if not is_folder(place):
        size_of(place)
        return [place] if alone else _refuse(case, place, "one file serves one case")
    ran = [path.name for path in place.glob("cases/*") if is_folder(path)]
    if ran and case not in ran:
        has = f"{', '.join(sorted(ran)[:4])}{' ...' * (len(ran) > 4)}"
        return _refuse(case, place, f"it is the output of a run, of {has}")
    here = next((path for path in [*_places(case, place), *[place] * alone] if path.exists()), None)
    if here is None and case in lost_in(place, cases):
        return []
    if here is None:
        return _refuse(case, place, f"found neither {case}/ nor {case}.h5 in it")
    if here.is_file():
        return [here]
    inside = _wires_in(here)
    kinds = sorted({kind_of(path) for path in inside})
    if len(kinds) > 1:
        return _refuse(case, here, f"it holds {' and '.join(kinds)} files; name one kind, as in {here}/*{kinds[0]}")
    names = sorted((f"{p.name}/" * p.is_dir() or p.name) for p in here.iterdir() if not p.name.startswith("."))
    # beside wires of other cases what lies there may be the log of a crash
    unread = names and not any(_wires_in(path) for one in cases for path in _places(one, place))
    if not inside and (here == place or unread):
        found = f"; found {', '.join(names[:4])}{' ...' * (len(names) > 4)}" if names else "; it is empty"
        return _refuse(case, here, f"no wire in it ({', '.join(KINDS)}){found}")
    return _sorted(inside)


def _wires_in(place: Path) -> list[Path]:
    """The files of a folder that are read as wires; a file that is read so is all there is."""
    paths = place.iterdir() if is_folder(place) else [place]
    return [path for path in paths if path.is_file() and kind_of(path)]


def _places(case: str, place: Path) -> list[Path]:
    """Where a folder may have a case's wires."""
    return [place / "cases" / case / "frames.h5", place / case, place / f"{case}.h5"]


def lost_in(place: Path, cases: Sequence[str]) -> list[str]:
    """The cases for which a simulator wrote nothing into a folder that holds wires of others; none elsewhere."""
    lost = [case for case in cases if not any(path.exists() for path in _places(case, place))]
    return lost if len(lost) < len(cases) else []


def _matching(case: str, pattern: Path) -> list[Path]:
    """The files that a pattern matches; at least one."""
    found = list(pattern.parent.glob(pattern.name))
    if not found:
        return _refuse(case, pattern, "it matches no file")
    folder = next((path for path in found if is_folder(path)), None)
    return _sorted(found) if folder is None else _refuse(case, pattern, f"it matches a folder, {folder.name}")


def _sorted(paths: list[Path]) -> list[Path]:
    return in_order(paths, lambda path: path.name)


def _refuse(case: str, place: Path, why: str) -> list[Path]:
    do = f"give a folder with one file a frame in {case}/ (left empty, every frame counts as failed), "
    do += "or the output of a run of this manifest"
    raise UsageError([f"case {case!r}: --curves {place}: {why}; {do}"])


def _there(text: str) -> bool:
    """Whether a text, which may hold anything, is the name of something."""
    try:
        return status_of(Path(text)) is not None
    except LoadError:
        return False


LONGEST_NAME = 100
"""Most characters of a name that a folder is called after: an id of a case, a simulator."""
NO_NAMES = ("nan", "na", "n.a", "null", "none")


def named(texts: Sequence[str]) -> dict[str, Path]:
    """``NAME=PLACE`` texts by name; one without a name is called as its folder is. Raises UsageError."""
    found: dict[str, Path] = {}
    for text in texts:
        name, equals, place = text.partition("=") if "=" in text and not _there(text) else ("", "", text)
        name = name if equals else Path(place).absolute().stem
        if not name.replace("-", "").replace("_", "").replace(".", "").isalnum() or name.lower() == "wireval":
            raise UsageError([f"--curves {text!r}: the name {name!r}: letters, digits, - . _, and not 'wireval'"])
        if len(name) > LONGEST_NAME and _there(place):  # else the place is to be mended first
            what = f"--curves {name[:20]}...: the name has {len(name)} characters"
            raise UsageError([f"{what}; allowed: {LONGEST_NAME}; write NAME=PLACE with a shorter one"])
        if name.lower() in NO_NAMES:
            raise UsageError(
                [f"--curves {text!r}: tables are often read so that {name!r} is no value; name it otherwise"]
            )
        if not place:
            raise UsageError([f"--curves {text!r}: no place after the name; write NAME=DIR"])
        if name.lower() in map(str.lower, found):  # they name folders, which some disks do not tell apart
            raise UsageError([f"--curves {text!r}: the name {name!r} is taken; write NAME={place}"])
        found[name] = Path(place)
    return found
