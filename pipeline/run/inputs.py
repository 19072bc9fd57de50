"""The input files of a case: what result.json says of them, and whether they stayed as they were while it was computed.

A scan that is replaced between reading and the end would be recorded with the hash of what nobody has read: the result
would be taken for that of the new file, and kept.
"""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.load import Source, parts_of
from pipeline.load.wires import result_beside
from pipeline.run.hashing import file_hash
from pipeline.status import FrameStatus, StageError
from pipeline.study.manifest import Case
from pipeline.study.sources import State, files_of, state_of


@dataclass(frozen=True)
class Inputs:
    """The files of a case as they were when it began."""

    states: dict[Path, State]

    @classmethod
    def of(cls, case: Case) -> "Inputs":
        """The files of a case as they are now."""
        return cls({path: state for path in _all_of(case) if (state := state_of(path))})

    def changed(self) -> StageError | None:
        """What ends the case where a file is another one by now; one that is gone was read, or its frame says so."""
        for path, before in self.states.items():
            now = state_of(path)
            if now and now != before:
                what = f"{path} was written to, or replaced, while this case was computed from it"
                do = "allowed: files that stay as they are; once it is complete, give the same command again"
                return StageError(FrameStatus.INPUT_CHANGED, f"{what} ({before[0]} bytes before, {now[0]} now); {do}")
        return None


ANY = Inputs({})
"""Files that nobody watches."""


UNSTATED = {
    *("reference", "frames", "lumen", "traces", "truth", "projections", "simulated", "parameters", "entry_case"),
    *("calibrated", "calibrated_sigma", "calibrated_scans", "calibrated_traces"),
    *("own_parameters", "as_stated", "assumed"),
}
"""Keys that name files, whose contents count, and what is no statement of the manifest."""
OF_FILES = ("reference", "frames", "lumen", "traces")
"""Keys of which all but the files' places is a statement: how many, which dataset, item or label, the wall's level."""
NOT_LENT = {"role", "group", "phantom", "push_force_N", "push_force_sigma_N"}
"""What a case whose clamp is borrowed states for itself alone."""
SMALL_BYTES = 2**20
"""A file up to this is hashed where only a larger one's size is asked for."""


def stated(case: Case) -> str:
    """A hash of what the manifest states of a case, but for its files, whatever a calibration has made of it."""
    if case.as_stated:
        return case.as_stated
    other = _told(case.entry_case, UNSTATED | NOT_LENT) if case.entry_case is not None else ""
    return hashlib.sha256(f"{_told(case, UNSTATED)}{other}".encode()).hexdigest()[:16]


def keys_of(case: Case) -> dict[str, Any]:
    """What the manifest states of a case, defaults included, with what parameters changed in it.

    Not wire and wall, which stand beside it in result.json, what is filled in, as ``assumed``, nor files, of which
    only the dataset, item, label or level is here.
    """
    beside = {key: parts for key in OF_FILES if (parts := _parts(getattr(case, key)))}
    return case.model_dump(exclude=UNSTATED | {"calibrated_kin", "wire", "wall"}) | beside


def _parts(value: Source | Path | Sequence[Source] | None) -> list[dict[str, Any]]:
    """Which dataset, item, label or level is stated of each file; nothing where none is of any."""
    sources = value if isinstance(value, Sequence) else [value]
    stated = [vars(source) if isinstance(source, Source) else {} for source in sources]
    parts = [{name: part for name, part in of.items() if name != "path" and part not in ("", None)} for of in stated]
    return parts if any(parts) else []


def _told(case: Case, but: set[str]) -> str:
    return f"{case.model_dump_json(exclude=but)}{[_without_place(getattr(case, key)) for key in OF_FILES]}"


def _without_place(value: Source | Path | Sequence[Source] | None) -> object:
    """What is stated of files beside where they lie; a list of as many for several."""
    if isinstance(value, Source):
        return sorted((name, part) for name, part in vars(value).items() if name != "path")
    return [_without_place(one) for one in value] if isinstance(value, Sequence) else value is not None


def contents_of(files: Sequence[Mapping[str, Any]]) -> str:
    """A hash of the contents of a case's files, by their keys. files : as ``described``."""
    rows = sorted((str(row["key"]), str(row["sha256"])) for row in files)
    return hashlib.sha256(repr(rows).encode()).hexdigest()[:16]


def other_file(case: Case, known: Sequence[Mapping[str, Any]], times: Mapping[str, int]) -> str:
    """Which file of a case is not the one that ``known`` describes, its key and path; empty where all are.

    A large file in the same place, of the same size and with the same time (``times_of``) is the same; any other is
    hashed. No time is held against another machine's clock.
    """
    rows = {str(row.get("key")): row for row in known}
    for key, path in named_files(case).items():
        if not path.exists():
            continue
        row, size = rows.get(key, {}), _size(path)
        here = row.get("path") == str(path) and row.get("bytes") == size and size > SMALL_BYTES
        if not (here and _changed(path) == times.get(key)) and row.get("sha256") != file_hash(path):
            return f"{key}, now {path}"
    return ""


def described(case: Case) -> list[dict[str, Any]]:
    """Every input file of a case, once: its key in the manifest, path, hash and size."""
    named = {path: key for key, path in reversed(named_files(case).items()) if path.exists()}
    return [{"key": key, "path": str(p), "sha256": file_hash(p), "bytes": _size(p)} for p, key in named.items()][::-1]


def named_files(case: Case) -> dict[str, Path]:
    """Input files by key: the case's own, another simulator's wires, and those of the case whose clamp it borrows.

    Beside wires of a run its result, from which their statuses and warnings are.
    """
    others = {} if case.simulated is None else files_of(case.simulated, "simulated.")
    if case.simulated is not None and (result := result_beside(case.simulated.files)):
        others["simulated.result"] = result
    return files_of(case) | others | ({} if case.entry_case is None else files_of(case.entry_case, "entry."))


def _all_of(case: Case) -> Iterator[Path]:
    """Every file that is read for a case: folders with all that is in them, headers with what holds their voxels."""
    for path in dict.fromkeys(named_files(case).values()):
        if path.exists():
            yield from _with_parts(path)


def _with_parts(path: Path) -> tuple[Path, ...]:
    """A folder and all that is in it, or a file and what belongs to it."""
    return (path, *(path.rglob("*") if path.is_dir() else parts_of(path)))


def times_of(case: Case) -> dict[str, int]:
    """When each input file was last written or put in its place, by its key."""
    return {key: _changed(path) for key, path in named_files(case).items() if path.exists()}


def _changed(path: Path) -> int:
    """When a file, or any of a folder or behind a header, was last written or put in its place, ns from 1970.

    That of its entry, which nobody can put back, as that of the content may be.
    """
    return max((file.stat().st_ctime_ns for file in _with_parts(path) if file.exists()), default=0)


def _size(path: Path) -> int:
    """Bytes of a file, or of all files of a folder."""
    return sum(p.stat().st_size for p in path.rglob("*") if p.is_file()) if path.is_dir() else path.stat().st_size
