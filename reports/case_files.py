"""The folder of one case, read: result.json, errors.csv, points.csv.gz, frames.h5. Any of them may be missing."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reports import frames_file, tables
from reports.frames_file import FrameArrays, ScanCrop
from reports.records import ALWAYS, read_json, run_records
from reports.result_file import read_result
from reports.schema import ERRORS, POINTS, TIMINGS
from reports.texts import size_of, unreadable

GOOD = ("ok", "simulated", "roll_fitted")
WORST = "p95_mm"
"""The one metric by which a frame or a case is called worst, wherever that is said."""
_MOST_NAMED, _MOST_FRAMES = 5, 12


@dataclass(frozen=True, eq=False, repr=False)
class CaseFiles:
    """What is on disk of one case; tables that are absent are empty, and an absent result.json is an empty mapping.

    folder : where it lies; ``view`` in it is for 3D Slicer and ParaView.     result : result.json: status, wire, wall,
    entry (the clamp that was used), warnings, assumptions, settings.     errors : a row for each frame.     samples :
    the compared points, None where they were not read; ``points`` reads them.     timings : seconds of each frame.
    scan : where the vessel's crop lies.     frames : numbers of the frames that ``read_frame`` knows.
    """

    folder: Path
    result: Mapping[str, Any]
    errors: pd.DataFrame
    samples: pd.DataFrame | None
    timings: pd.DataFrame
    scan: ScanCrop | None
    frames: tuple[int, ...]

    def __repr__(self) -> str:
        """What a prompt shows: where it lies and how many frames have arrays; not all that was read."""
        return f"CaseFiles({str(self.folder)!r}, {self.result.get('status', 'no result')}, {len(self.frames)} frames)"

    @property
    def name(self) -> str:
        """Identifier of the case; the folder's name where result.json is missing."""
        return str(self.result.get("case", self.folder.name))

    @property
    def points(self) -> pd.DataFrame:
        """Every compared point. By far the largest table: it is read here where ``read_case`` did not.

        Raises UnreadableError where frames were compared and the file is gone by then. Where ``read_case`` was to read
        it and it was absent, the table is empty, as pages need it, which leave out what it would have shown.
        """
        if self.samples is not None:
            return self.samples
        if self.result and self.errors["rms_mm"].notna().any():
            _there(self.folder / POINTS.file)
        return tables.read_if_there(self.folder / POINTS.file, POINTS)

    @property
    def good(self) -> pd.DataFrame:
        """Rows of errors.csv whose frame is ok (or simulated, where there is nothing to compare with)."""
        return self.errors[self.errors["status"].isin(GOOD)]

    @property
    def handed_in(self) -> bool:
        """Whether the simulated wires are another simulator's (the folder then also holds what our solver found)."""
        return any(str(item.get("key", "")).startswith("simulated") for item in self.result.get("inputs", ()))

    @property
    def simulator(self) -> str:
        """Whose wires they are in a score of several simulators; empty in a run."""
        return str(self.result.get("simulator", ""))

    @property
    def statistics(self) -> Mapping[str, Any]:
        """The case's row of summary.csv, as its result.json holds it.

        A case that crashed has this row, too, with the number of its frames, though it has none of the other files.
        """
        return dict(self.result.get("summary", {}))

    def read_frame(self, frame: int) -> FrameArrays:
        """Read the arrays of one frame from the disk, each time anew.

        Raises KeyError, naming the frames there are, and UnreadableError where frames.h5 is gone.
        """
        if len(self.errors):
            _there(self.folder / "frames.h5")
        if frame not in self.frames:
            there = f"there are {listed([*map(str, self.frames)])}" if self.frames else "there is none"
            raise KeyError(f"case {self.name!r} has no arrays of frame {frame!r}; {there}")
        return frames_file.read_frame(self.folder / "frames.h5", frame)


def read_case(folder: Path, points: bool = True, rest: bool = True) -> CaseFiles:
    """Read a case's folder. Raises ValueError, naming the file, where one is damaged.

    points : False leaves points.csv.gz unread, by far the largest table.     rest : False leaves out the run times and
    the geometry of the scan. The page of a run needs neither.
    """
    errors = tables.read_if_there(folder / ERRORS.file, ERRORS)
    samples = tables.read_if_there(folder / POINTS.file, POINTS) if points else None
    timings = tables.read_if_there(folder / TIMINGS.file if rest else None, TIMINGS)
    scan, numbers = _frames(folder / "frames.h5", rest)
    # absolute: much of it is read later, perhaps from another working directory, where another run may lie
    return CaseFiles(folder.absolute(), read_result(folder / "result.json"), errors, samples, timings, scan, numbers)


def results_in(out_dir: Path) -> dict[str, dict[str, Any]]:
    """result.json by case; empty where there is none, or where it cannot be read, which is said elsewhere."""
    found: dict[str, dict[str, Any]] = {}
    for folder in find_cases(out_dir):
        try:
            found[folder.name] = read_result(folder / "result.json")
        except ValueError:
            found[folder.name] = {}
    return found


def find_cases(out_dir: Path) -> list[Path]:
    """Folders of the cases of a run, by name, less those of another study: no run into the folder names these."""
    return _folders(out_dir, named=True)


def left_over(out_dir: Path) -> list[Path]:
    """Folders of finished cases that no run into the folder names any more, by name."""
    return [folder for folder in _folders(out_dir, named=False) if (folder / "result.json").exists()]


def left_over_sentence(out_dir: Path) -> str:
    """Which cases are not counted since no run names them any more, and how to remove them; empty if there are none."""
    names = listed([folder.name for folder in left_over(out_dir)])
    return f"not counted, since no manifest of this folder names them any more: {names}" * bool(names)


def not_run_sentence(out_dir: Path) -> str:
    """Cases that runs into a folder name, but that have no result in it, such as those of a shard not merged yet."""
    names = listed(not_run(out_dir))
    return f"named by the manifest and without a result here: {names}" * bool(names)


def not_run(out_dir: Path) -> list[str]:
    """Identifiers of these cases; those that were left out are not among them."""
    return [name for name, asked in _without_result(out_dir).items() if asked]


def planned_frames(out_dir: Path) -> dict[str, int]:
    """Frames that the manifests of a folder plan, by case that is to be scored; less than all of an older version."""
    return {str(name): int(count) for run in runs_in(out_dir) for name, count in (run.get("to_score") or {}).items()}


def amiss(folder: Path) -> str:
    """Which file of a finished case is missing, or has another size than its ledger.json says; empty if none.

    Pages and views are left out, since they can be drawn again. Contents are not read. A case that crashed has no
    ledger.
    """
    if not (folder / "ledger.json").exists():
        return ""
    try:
        files = dict(read_json(folder / "ledger.json").get("files", {}))
        known = {str(n): int(entry["bytes"]) for n, entry in files.items() if "/" not in n and n != "report.html"}
    except (ValueError, TypeError, KeyError):
        return "ledger.json cannot be read"
    for name in ALWAYS:
        if name not in known:
            return f"ledger.json does not name {name}"
    for name, expected in known.items():
        path = folder / name
        if not path.is_file():
            return f"{name} is missing"
        if path.stat().st_size != expected:
            return f"{name} is not as it was written"
    return ""


def manifests_in(runs: Iterable[Mapping[str, Any]]) -> list[str]:
    """The manifests that runs say they are of, each once: the first digits of their hashes."""
    return list(dict.fromkeys(str(run["manifest_sha256"])[:12] for run in runs if "manifest_sha256" in run))


def left_out_sentence(out_dir: Path) -> str:
    """Cases without a result that no run into a folder was to compute, since ``--only`` named others."""
    names = listed([name for name, asked in _without_result(out_dir).items() if not asked])
    return f"left out by --only and without a result here: {names}" * bool(names)


def _without_result(out_dir: Path) -> dict[str, bool]:
    """By case of the manifests without a result, whether a run was to compute it, or a shard that is not here.

    A shard names all cases and leaves out what ``--only`` left out of all of them: what it left to others is asked.
    """
    named: dict[str, bool] = {}
    for run in runs_in(out_dir):
        left_out = run.get("left_out") or ()
        for name in map(str, run.get("planned") or ()):
            named[name] = named.get(name, False) or name not in left_out
    return {name: asked for name, asked in named.items() if not (out_dir / "cases" / name / "result.json").exists()}


def listed(names: Sequence[str], most: int = _MOST_NAMED) -> str:
    """Names in a sentence, no more than a few."""
    rest = len(names) - most
    return ", ".join(names[:most]) + f" and {rest} more" * (rest > 0)


def frames_named(which: Sequence[int | str]) -> str:
    """``frame 1``, ``frames 1, 2``: frames in a sentence, no more than a dozen."""
    return f"frame{'s' * (len(which) != 1)} {listed([*map(str, which)], _MOST_FRAMES)}"


def counted(count: int, noun: str) -> str:
    """A number of things: ``1 case``, ``2 cases``."""
    return f"{count} {noun}{'s' * (count != 1)}"


def counted_scans(good: int, planned: int, fitted: int, word: str) -> str:
    """``6 scans: 1 used for the roll, 5 scored``, and where not all are good ``4 scored, 1 without a result``.

    A scan that the roll was fitted on is no frame that is scored.

    good, planned : of the frames beside the ``fitted`` ones.     word : what a good one is called.
    """
    lost = f", {planned - good} without a result" * (good < planned)
    return f"{counted(planned + fitted, 'scan')}: {fitted} used for the roll, {good} {word}{lost}"


def not_reached(out_dir: Path) -> str:
    """Why nothing is scored, where every run into a folder was to end before frames are compared; else empty."""
    ends = [str(run.get("until", "")) for run in runs_in(out_dir)]
    early = bool(ends) and all(end in ("load", "segment", "trace", "simulate") for end in ends)
    return f"Nothing is scored: the run was to end before frames are compared (--until {ends[0]})." if early else ""


def runs_in(out_dir: Path) -> list[dict[str, Any]]:
    """What the runs into a folder say of themselves, the earliest first; nothing where that is damaged, which
    ``wireval run`` refuses.
    """
    try:
        return [read_json(path) for path in sorted(run_records(out_dir), key=_began)]
    except ValueError:
        return []


def _began(run: Path) -> str:
    """When a run began, ISO 8601; of one that does not say it, later than all: what it says is to be heeded."""
    return str(read_json(provenance_of(run)).get("started", "~"))


def provenance_of(run: Path) -> Path:
    """Where the machine and time of a run stand, beside what it says of itself: run.json, run.1-2.json, ..."""
    return run.with_name(run.name.replace("run", "provenance"))


def _folders(out_dir: Path, named: bool) -> list[Path]:
    """Runs name all cases of their manifest. What does not (golden tables, an older run) is taken to name every one."""
    planned = [run.get("planned") for run in runs_in(out_dir)]
    names = None if not planned or None in planned else {name for ids in planned for name in ids or ()}
    found = sorted(p for p in (out_dir / "cases").glob("*") if p.is_dir())
    return [p for p in found if (names is None or p.name in names) == named]


def thinned(count: int, most: int) -> NDArray[np.int_]:
    """Places of at most ``most`` of ``count`` frames, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).round().astype(int))


def _there(path: Path) -> None:
    """Raise UnreadableError where a file is gone: of an empty table nobody could tell it from one without rows."""
    if not path.is_file():
        raise unreadable(path, "no such file, though the case had one; put the folder back, or run the case again")


def _frames(path: Path, scan: bool) -> tuple[ScanCrop | None, tuple[int, ...]]:
    if not path.exists():
        return None, ()
    size_of(path)
    try:
        return frames_file.read_scan(path) if scan else None, frames_file.frame_numbers(path)
    except (OSError, KeyError, AttributeError, TypeError, RuntimeError) as error:
        raise ValueError(f"{path}: not a readable HDF5 file; remove the folder and run the case again") from error
