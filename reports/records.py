"""What runs and cases say of themselves (run.json, result.json, ledger.json, ...): read, and of the kinds it should be.

A file that a disk or an editor has damaged is named; nothing is taken from it.
"""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from reports import texts

WRITTEN, AGAIN = "what `wireval run` wrote", "give the command of the run again, with --resume"
HELD: dict[str, tuple[type[Any], ...]] = {
    "config": (dict, dict, dict), "provenance": (dict,), "summary": (dict,), "counters": (dict,), "entry": (dict,),
    "manifest_keys": (dict,),
    "chosen": (dict,), "inputs": (list, dict), "failures": (list, dict), "frames": (list, dict), "sweep": (list, dict),
    "planned": (list, str), "left_out": (list, str), "swept": (list, str), "warnings": (list, str),
    "warnings_of_wires": (list, str),
    "assumptions": (list, str), "argv": (list, str), "doubts": (list, str), "fail_if": (list, str),
    "closed": (list, str), "open": (list, str), "worst_pages": (dict, str), "own": (dict, str),
}  # fmt: skip
"""What their keys hold: an object or a list, and what this consists of."""
ALWAYS = ("result.json", "errors.csv", "frames.h5", "timings.csv", "provenance.json")
"""The files of every case that went through the stages, however far and however well, that is of every ledger."""
KEYS = {"sweep": ("parameter", "value", "unchanged"), "inputs": ("path", "sha256"), "frames": ("frame",)}
"""What each object in such a list names."""
_RUN = re.compile(r"run(?:\.\d+-\d+)?\.json")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object; an absent file is an empty one, and a key that is null says as little as one that is absent.

    Raises UnreadableError where it is not an object, or one of its keys does not hold what ``HELD`` says.
    """
    if not path.exists():
        return {}
    try:
        content = texts.read_json(path, WRITTEN)
    except texts.UnreadableError as error:  # nobody shall correct or copy it, as the sentence ends
        raise texts.UnreadableError(f"{str(error).rpartition('; ')[0]}; {AGAIN}") from None
    if not isinstance(content, dict):
        raise texts.unreadable(path, f"no table of keys and values; expected {WRITTEN}; {AGAIN}")
    known = {key: value for key, value in content.items() if value is not None}
    for key, kinds in HELD.items():
        if key in known and not _holds(known[key], kinds, KEYS.get(key, ())):
            raise texts.unreadable(path, f"{key} is of another kind than expected: {WRITTEN}; {AGAIN}")
    return known


def _holds(value: Any, kinds: Sequence[type[Any]], keys: Iterable[str]) -> bool:
    """Whether a value, and what it consists of, are of these kinds. keys : of each object in a list."""
    if not isinstance(value, kinds[0]):
        return False
    inside: Iterable[Any] = value.values() if isinstance(value, dict) else value
    return len(kinds) == 1 or all(
        _holds(one, kinds[1:], ()) and all(one.get(key) is not None for key in keys) for one in inside
    )


def run_records(out_dir: Path) -> list[Path]:
    """What the runs into a folder say of themselves, by name: run.json, and run.I-N.json of shards.

    A user's own run_notes.json is none: one was taken for damaged, and removed.
    """
    return sorted(path for path in out_dir.glob("run*.json") if _RUN.fullmatch(path.name))


def damaged_records(out_dir: Path) -> list[str]:
    """A sentence each on what the runs into a folder say of themselves, where that cannot be read."""
    found = []
    for path in run_records(out_dir):
        try:
            read_json(path)
        except texts.UnreadableError as error:
            found.append(str(error))
    return found
