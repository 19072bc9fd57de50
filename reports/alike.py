"""Failures that say the same of many frames, said once."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from reports.case_files import counted, listed

_SCAN = re.compile(r" \(scan [^()]*\)$")
_FILE = re.compile(r"^(\S.*?): ")
_MOST_FILES = 6
_NUMBER = re.compile(r"\d+(\.\d+)?")


def alike(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows of failures.csv, those of a case that differ in frame, scan and numbers alone merged into the first.

    Each has ``count``, how many rows it stands for, ``failed``, what they are of (case, and frame or ""), ``frames``,
    the frames' numbers in words, and ``of``, the same behind ``frame`` or ``frames`` (empty for a whole case), and
    ``files``, the files that could not be read where there are several.
    """
    groups: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        message = _NUMBER.sub("#", _SCAN.sub("", str(row.get("message") or "")))
        key = (*(str(row.get(name) or "") for name in ("simulator", "case", "stage", "status")), message)
        groups.setdefault(key, []).append(row)
    return [{**own[0], "count": len(own), "files": _files(own), **_of_frames(own)} for own in groups.values()]


def line_of(row: Mapping[str, Any]) -> str:
    """One line for all frames that failed alike: a row that ``alike`` gave."""
    of = f" {row['of']}" * bool(row["of"])
    said = f"in frame {row['frame']}: {row['message']}" if row["count"] > 1 and row["message"] else row["message"]
    files = f"{row['files']}; " * bool(row["files"])
    return f"{row['case']}{of}: {row['status']}: {files}{said or row['sentence']}"


def _of_frames(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    numbers = [row["frame"] for row in rows if _stated(row)]
    failed = {(str(row["case"]), str(int(row["frame"])) if _stated(row) else "") for row in rows}
    return {"failed": failed, "frames": in_words(numbers), "of": frames_in_words(numbers) if numbers else ""}


def _files(rows: Sequence[Mapping[str, Any]]) -> str:
    """The files with which the messages of rows begin, no more than a few; empty unless they are several.

    Without their folders, where that tells them apart.
    """
    heads = (_FILE.match(str(row.get("message") or "")) for row in rows)
    paths = list(dict.fromkeys(head[1] for head in heads if head and re.search(r"[/\\]|\.\w+$", head[1])))
    names = [re.split(r"[/\\]", path)[-1] for path in paths]
    shown = names if len(set(names)) == len(names) else paths
    return listed(shown, _MOST_FILES) if len(shown) > 1 else ""


def in_words(frames: Sequence[int]) -> str:
    """``0 to 3, 5`` of frames' numbers."""
    runs: list[list[int]] = []
    for frame in map(int, frames):
        if runs and frame == runs[-1][-1] + 1:
            runs[-1].append(frame)
        else:
            runs.append([frame])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs)


def frames_in_words(numbers: Sequence[int]) -> str:
    """``frame 1``, ``frames 0 to 3, 5``."""
    return f"frame{'s' * (len(numbers) > 1)} {in_words(numbers)}"


def of_what(rows: Iterable[Mapping[str, Any]]) -> str:
    """``2 frames, 1 case`` of the rows that ``alike`` gave; a case without any result is not counted as a frame.

    A frame of which several simulators have no result, as one without a trace, is one frame.
    """
    failed = set[tuple[str, str]]().union(*(row["failed"] for row in rows))
    counts = {"frame": sum(bool(frame) for _, frame in failed), "case": sum(not frame for _, frame in failed)}
    return ", ".join(counted(count, what) for what, count in counts.items() if count)


def _stated(row: Mapping[str, Any]) -> bool:
    return str(row.get("frame")) not in ("", "None", "nan", "<NA>")
