"""The verdict on two scores: every simulator that both hold, each against itself, as one."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from reports.diff import Difference
from reports.origin import ABSENT
from reports.schema import ALL
from reports.two_runs import Judged, Verdict


def together(runs: tuple[Path, Path], parts: Mapping[str, Verdict], gone: list[str], come: list[str]) -> Verdict:
    """One verdict from those on simulators by name, whose worst it is.

    gone, come : simulators that only the first run has, which is a regression, and only the second, which is new.
    """
    whole = {"case": ALL, "frame": pd.NA, "column": "simulator", "change": math.nan, "allowed": math.nan}
    lost = {"before": "present", "after": "missing", "verdict": "regression"}
    found = {"before": "missing", "after": "present", "verdict": "new"}
    lone = [{"simulator": n} | whole | what for names, what in ((gone, lost), (come, found)) for n in names]
    tables = [part.frames.rows.assign(simulator=name) for name, part in parts.items()]
    rows = pd.concat([*tables, *[pd.DataFrame(lone)] * bool(lone)], ignore_index=True)
    rows = rows[["simulator", *rows.columns.drop("simulator")]]
    empty = tuple(f"{name}: {case}" for name, part in parts.items() for case in part.frames.empty)
    unscored = dict.fromkeys(case for part in parts.values() for case in part.frames.unscored)
    judged: Judged = "holds"
    for word in ("withheld", "worse"):
        judged = word if any(part.judged == word for part in parts.values()) else judged
    told = list(dict.fromkeys(part.alike for part in parts.values()))
    return Verdict(
        runs,
        [*_others(gone, come), *_differs(parts)],
        [{"simulator": name, **row} for name, part in parts.items() for row in part.pooled],
        "; ".join(f"{name}: {part.paired}" for name, part in parts.items() if part.paired),
        judged,
        Difference(rows, empty, tuple(unscored)),
        _caveats({name: part.caveat for name, part in parts.items()}, several=len(parts) + len(lone) > 1),
        "; ".join(told) if all(told) and not lone else "",
        [{"simulator": name, **row} for name, part in parts.items() for row in part.warned],
        "; ".join(f"{name}: {part.void}" for name, part in parts.items() if part.void),
    )


def _others(gone: list[str], come: list[str]) -> list[dict[str, str]]:
    """Simulators that one run alone has, as what differs between the two."""
    held = [(name, "present", ABSENT) for name in gone] + [(name, ABSENT, "present") for name in come]
    return [{"what": f"simulator {name}", "before": before, "after": after} for name, before, after in held]


def _caveats(said: Mapping[str, str], *, several: bool) -> str:
    """What is to be added of all simulators once, else behind the names of those that it is said of.

    several : whether there are more of them than one, whether in both runs or not.
    """
    owners = {text: [name for name, own in said.items() if own == text] for text in said.values() if text}
    everyone = next(iter(owners), "") if len(owners) == 1 and len(said) > 1 else ""
    if everyone and len(owners[everyone]) == len(said):
        return everyone
    return "; ".join(f"{', '.join(names)}: {text}" if several else text for text, names in owners.items())


def _differs(parts: Mapping[str, Verdict]) -> list[dict[str, Any]]:
    """What differs for every simulator once, and the rest with the simulator's name before it."""
    told = {name: [dict(row) for row in part.differs] for name, part in parts.items()}
    first = next(iter(told.values()), [])
    common = [row for row in first if all(row in rows for rows in told.values())]
    own = [row | {"what": f"{name}: {row['what']}"} for name, rows in told.items() for row in rows if row not in common]
    return [*common, *own]
