"""What was asked of a whole run (``--fail-if``), and the answers as ``gates.json`` has them for pages and notebooks."""

from collections.abc import Sequence
from pathlib import Path

from reports.case_files import runs_in
from reports.records import read_json

GATES = "gates.json"
"""A run and ``wireval report`` write it anew, from the numbers that stand in overall.csv then."""


def asked_of(out_dir: Path) -> list[str]:
    """The conditions that the last run into a folder was given; an earlier one's, as of a shard, are given up."""
    return list(next((run.get("fail_if", ()) for run in reversed(runs_in(out_dir))), ()))


def gates_in(out_dir: Path) -> dict[str, Sequence[str]]:
    """A sentence for each gate of a run, or of one simulator of a score: those that are ``closed``, and ``open``."""
    told = read_json(out_dir / GATES)
    return {name: told.get(name, ()) for name in ("closed", "open")}
