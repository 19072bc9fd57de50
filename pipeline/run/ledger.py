"""ledger.json: every file of a case's result with its size and hash, written last.

A case is finished when its ledger exists, names what such a case always has, and all that it names is unchanged. The
tables, curves and views are the data; the pages are drawn from them, so they can be drawn again without computing the
case.
"""

import hashlib
import itertools
import re
import stat
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter

from reports.atomic import write_bytes, writing
from reports.records import ALWAYS, read_json
from reports.schema import BUDGET, ENTRIES, ERRORS, POINTS, TIMINGS
from reports.sections import declared

FILE = "ledger.json"
RESULT, FRAMES, PROVENANCE = "result.json", "frames.h5", "provenance.json"
SCORED = (RESULT, ERRORS.file, POINTS.file, FRAMES)
"""The files that numbers over many cases are computed from; traced wires are guesses of other insertions' ones."""
DATA = (*SCORED, BUDGET.file, ENTRIES.file, TIMINGS.file, PROVENANCE)
PAGES = ("report.html",)
TOP = (FILE, *DATA, *PAGES)
"""Files of a case that lie in no folder of it."""
VIEW, FIGURES = "view", "figures"
_IN_VIEW = re.compile(
    r"scene\.mrml|lumen\.(?:seg\.nrrd|vtp|stl)|wire_(?:traced|simulated|true)(?:\.pvd|_\d+\.(?:vtp|mrk\.json))"
)
Pages = Literal["", "linked", "embedded"]
"""Which pages a case has: none, ones with links to their pictures, ones with the pictures inside."""


@dataclass(frozen=True)
class Entry:
    """A file as it was written."""

    bytes: int
    sha256: str


@dataclass(frozen=True)
class Ledger:
    """The files of a case. key : cache key of everything that the result depends on.     files : by name."""

    key: str
    files: dict[str, Entry]
    pages: Pages = ""

    def amiss(self, folder: Path, names: Iterable[str]) -> str:
        """A sentence on the first of the named files that is not as it was written; empty where all are.

        One that the ledger does not name was added, or its line was removed: neither is believed.
        """
        for name in names:
            path, known = folder / name, self.files.get(name)
            if known is None:
                if name in ALWAYS or (name in DATA and path.exists()):
                    return f"{FILE} does not name {name}"
                continue
            try:
                found = path.stat()
                # a pipe is empty and would block
                if not stat.S_ISREG(found.st_mode) or found.st_size != known.bytes or entry_of(path) != known:
                    return f"{name} is not as it was written"
            except FileNotFoundError:
                return f"{name} is missing"
            except OSError as error:
                return f"{name} cannot be read ({error.strerror})"
        return ""

    @property
    def data(self) -> list[str]:
        """Names of the files that are no pages."""
        return [name for name in self.files if not is_page(name)]

    @property
    def drawn(self) -> list[str]:
        """Names of the files that are pages or belong to them."""
        return [name for name in self.files if is_page(name)]


LEDGER = TypeAdapter(Ledger)


def is_page(name: str) -> bool:
    """Whether a file is a page or belongs to one: it is drawn from the data files."""
    return name in PAGES or name.startswith(f"{FIGURES}/")


def entry_of(path: Path) -> Entry:
    """A file's size and hash."""
    with path.open("rb") as file:
        return Entry(path.stat().st_size, hashlib.file_digest(file, "sha256").hexdigest())


def read(folder: Path) -> Ledger | None:
    """The ledger of a case's folder; None where there is none, or one that cannot be read."""
    try:
        return LEDGER.validate_python(read_json(folder / FILE))
    except ValueError:
        return None


def write(folder: Path, key: str) -> None:
    """Record the data of a case that has no pages yet."""
    _write(folder, Ledger(key, {name: entry_of(folder / name) for name in _found(folder) if not is_page(name)}))


def record_pages(folder: Path, pages: Pages) -> None:
    """Record the pages that were drawn; a folder without a ledger gets none."""
    ledger = read(folder)
    if ledger is not None:
        drawn = {name: entry_of(folder / name) for name in _found(folder) if is_page(name)}
        kept = {name: ledger.files[name] for name in ledger.data}
        _write(folder, replace(ledger, files=kept | drawn, pages=pages))


def _write(folder: Path, ledger: Ledger) -> None:
    write_bytes(folder / FILE, LEDGER.dump_json(ledger, indent=1) + b"\n")


def _found(folder: Path) -> Iterator[str]:
    yield from (name for name in (*DATA, *PAGES) if (folder / name).is_file())
    for part in (VIEW, FIGURES):
        yield from sorted(f"{part}/{p.name}" for p in (folder / part).glob("*") if _is_ours(p) and p.is_file())


def remove(place: Path, known: Ledger | None) -> list[str]:
    """Remove from a case's ``view`` or ``figures`` what runs wrote there, and the folder; names of what is left in it.

    known : the ledger of what lies there. 3D Slicer saves what a user corrects over the file that it has opened: what
    the ledger does not know as it is gets another name in ``view``. Pictures are drawn from the data alone.
    """
    if not place.is_dir():
        return []
    with writing(place):
        kept = [name for path in sorted(place.iterdir()) if (name := _left_of(path, known))]
        if not kept:
            place.rmdir()
    return [f"{place.name}/{name}" for name in sorted(kept)]


def _left_of(path: Path, known: Ledger | None) -> str:
    """Remove a file if it is as a run wrote it; its name afterwards, empty where it is gone."""
    name = f"{path.parent.name}/{path.name}"
    written, half = known.files if known else {}, path.name.startswith(".tmp-")
    if path.is_dir() or not (half or name in written or _is_ours(path)):
        return path.name
    # a ledger that names nothing was emptied, and tells as little as none
    changed = known and written and (name not in written or known.amiss(path.parents[1], [name]))
    if changed and not half and path.parent.name == VIEW and path.is_file():
        return _set_aside(path)
    path.unlink(missing_ok=True)
    return ""


def _set_aside(path: Path) -> str:
    """Put ``yours`` into the name of a file that a run would write over: wire_traced_000.yours.mrk.json."""
    stem, _, ending = path.name.partition(".")
    names = (f"{stem}.yours{number or ''}.{ending}" for number in itertools.count())
    return path.rename(next(free for name in names if not (free := path.with_name(name)).exists())).name


def _is_ours(path: Path) -> bool:
    """Whether a file in ``view`` or ``figures`` has a name that runs give."""
    return bool(_IN_VIEW.fullmatch(path.name)) if path.parent.name == VIEW else path.name in _drawings()


@cache
def _drawings() -> frozenset[str]:
    """Names of the pictures of a case's page, and of their numbers."""
    return frozenset(f"{entry['figure']}{end}" for entry in declared("case") for end in (".png", ".csv"))
