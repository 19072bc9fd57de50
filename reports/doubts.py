"""What is doubtful of the cases of a run, each alone and among themselves, and what is assumed, as it was written."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from reports.case_files import listed, results_in, runs_in
from reports.records import read_json

AMONG = "doubts.json"
"""What is assumed and doubted of the cases of a folder among themselves; each run and ``wireval report`` look again."""
_NUMBER = re.compile(r"[0-9]+(?:\.[0-9]+)?(?:e-?[0-9]+)?")
COUNT_AS = ", and count as "
"""What is said of insertions that look like fewer."""
MADE_FROM_TRACES = "only wires that were made from the traces"
"""What a warning of wires that lie nearer to the traces than these are known says; their errors are none."""
OFF_THE_SCANS = "own curves are not where the scans show the wire"
"""What a warning of the user's own traces says that lie off the wires in the scans: every error is from these traces.

Mirrored ones were met within 0.055 mm after their own advice, to fit the roll, while they lay 0.7 mm off the scans."""
MOSTLY_LINES = "most frames are one line"
"""What a warning says where more than half of a case's wires are of two points, which show no roll."""
OF_THEIR_RUN = "in the run that made these wires: "
"""How a warning begins that a score has from the run whose wires it scores."""
AGAINST_INPUTS = (
    " from the traced one, as stated ",
    " insertion_mm states",
    " in entry_direction as stated",
    "the given lumen lies ",
    " the reference's, all around",
)
"""What warnings say that speak against an input: roll, tip's curve or catheter; depths; the clamp; a given lumen; the
reference's vessel, which is wider or narrower."""

_OTHERS = 2


class Caveats(NamedTuple):
    """Why the numbers may not mean what they say.

    copied : the warning that the wires were made from the traces, so that no number counts; empty if there is none.
    twins : the doubt that some insertions look like one that was scanned twice, but count as several; empty likewise.
    warnings : all that stand on the page, those against the traces first, then those that speak against an input.
    """

    copied: str = ""
    twins: str = ""
    warnings: Sequence[str] = ()

    @property
    def against(self) -> str:
        """The weightiest warning that traces or an input are wrong; empty where none says so."""
        return next((text for text in weightiest_first(self.warnings) if _rank(text) < _OTHERS), "")

    @property
    def shows_no_roll(self) -> bool:
        """Whether traces lie off the wires that the scans show, or most wires are one line: neither shows a roll."""
        return any(words in text for text in self.warnings for words in (OFF_THE_SCANS, MOSTLY_LINES))


NO_CAVEATS = Caveats()


def weightiest_first(warnings: Iterable[str]) -> list[str]:
    """Warnings, those first that speak against the traces, then those against an input: a page shows five, and a wrong
    roll moves all wires.
    """
    return sorted(warnings, key=_rank)


def _rank(warning: str) -> int:
    if OFF_THE_SCANS in warning:
        return 0
    return 1 if any(words in warning for words in AGAINST_INPUTS) else _OTHERS


def warnings_in(out_dir: Path) -> dict[str, list[str]]:
    """What each case below an output folder was warned of; nothing of one whose result cannot be read."""
    return {case: list(result.get("warnings", ())) for case, result in results_in(out_dir).items()}


def copied_from_traces(warnings: Mapping[str, Sequence[str]]) -> str:
    """The warning that simulated wires were made from the traces; empty where no case has it. warnings : by case."""
    said = (f"{case}: {text}" for case, texts in warnings.items() for text in texts)
    return next((text for text in said if MADE_FROM_TRACES in text), "")


def twins(doubts: Iterable[str]) -> str:
    """The doubt that insertions are one that was scanned again; empty without it."""
    return next((text for text in doubts if COUNT_AS in text), "")


def said_by_cases(results: Mapping[str, Mapping[str, Any]], key: str) -> list[str]:
    """What the cases of a run say under ``warnings`` or ``assumptions``, a line each, with the cases that say it.

    What differs in its numbers alone is one line, that of the first case, which is named where others say it, too.
    results : result.json by case.
    """
    if len(results) == 1:
        return [str(text) for result in results.values() for text in result.get(key, ())]
    said: dict[str, dict[str, list[str]]] = {}
    for case, result in results.items():
        for text in map(str, result.get(key, ())):
            said.setdefault(_NUMBER.sub("#", text), {}).setdefault(text, []).append(case)
    lines = []
    for texts in said.values():
        cases = dict.fromkeys(case for named in texts.values() for case in named)
        (text, own), others = next(iter(texts.items())), len(texts) - 1
        whose = f"numbers of {listed(list(dict.fromkeys(own)))}; " * (cases.keys() != {*own})
        more = f" ({whose}{others} more with other numbers, on the pages of the cases)" * (others > 0)
        lines.append(f"{listed([*cases])}: {text}{more}")
    return lines


def caveats_of(out_dir: Path, results: Mapping[str, Mapping[str, Any]]) -> Caveats:
    """What is warned of on a run's page: of its cases among themselves, then of each. results : result.json by case."""
    doubts, copied = doubted(out_dir), {case: result.get("warnings", ()) for case, result in results.items()}
    said = weightiest_first([*doubts, *said_by_cases(results, "warnings")])
    return Caveats(copied_from_traces(copied), twins(doubts), said)


def caveats_in(out_dir: Path) -> Caveats:
    """What is warned of on a run's page, from its folder alone."""
    return caveats_of(out_dir, results_in(out_dir))


def doubted(out_dir: Path) -> list[str]:
    """What is doubtful of the runs into a folder, and of its cases among themselves, each sentence once."""
    return _told(out_dir, "doubts")


def assumed(out_dir: Path) -> list[str]:
    """What the runs into a folder assumed, and what is assumed of its cases among themselves, each sentence once."""
    return _told(out_dir, "assumptions")


def _told(out_dir: Path, key: str) -> list[str]:
    told = [*runs_in(out_dir), read_json(out_dir / AMONG)]
    return list(dict.fromkeys(str(text) for run in told for text in run.get(key, ())))
