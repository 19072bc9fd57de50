"""The files of a case as its page lists them: name, link, size."""

from pathlib import Path
from typing import Any
from urllib.parse import quote

from reports._content import size
from reports.schema import TIMINGS

_LISTED_FILES = ("result.json", "errors.csv", "points.csv.gz", "frames.h5")
_OF_THE_RUN = (TIMINGS.file, "provenance.json", "log.txt")
"""When and where a case was computed, and how long it took: a page of what is ok says nothing of it, so that the same
results give the same; one with failures repeats the command."""


def listed_files(case_dir: Path) -> list[dict[str, str]]:
    """The files of a case, those with the numbers first: name, link and size of each."""
    paths = [case_dir / name for name in _LISTED_FILES]
    listed = [_file(case_dir, path) for path in paths if path.exists()]
    return listed + [{"name": n, "link": n, "size": ""} for n in _OF_THE_RUN if (case_dir / n).exists()]


def _file(case_dir: Path, path: Path) -> dict[str, str]:
    name = path.relative_to(case_dir).as_posix()
    return {"name": name, "link": quote(name), "size": size(path.stat().st_size)}


def listed_view(case_dir: Path) -> dict[str, Any]:
    """The files of ``view/``, some seven a frame, and what they hold together."""
    paths = sorted(p for p in (case_dir / "view").glob("*") if not p.name.startswith("."))
    return {"files": [_file(case_dir, p) for p in paths], "size": size(sum(p.stat().st_size for p in paths))}
