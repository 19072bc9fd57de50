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


def gates_in(out_dir: Path, top: Path | None = None) -> dict[str, Sequence[str]]:
    """A sentence for each gate of a run, or of one simulator of a score: those that are ``closed``, and ``open``.

    top : the folder that pages are named from; by default ``out_dir`` itself.
    """
    told, folder = read_json(out_dir / GATES), out_dir.relative_to(top or out_dir)
    pages = told.get("worst_pages", {})
    closed = [with_page(why, pages.get(why, ""), folder) for why in told.get("closed", ())]
    return {"closed": closed, "open": told.get("open", ())}


def with_page(why: str, page: str, folder: Path) -> str:
    """The sentence on a closed gate, with the page to look at where there is one. page : below the run's folder."""
    return f"{why}, {(folder / page).as_posix()}" if page else why
