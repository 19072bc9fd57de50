"""The page of several simulators side by side, from simulators.csv and where.csv."""

from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from reports import _content
from reports.alike import alike
from reports.case_files import counted, listed, not_reached, not_run_sentence
from reports.doubts import (
    MOSTLY_LINES,
    OF_THEIR_RUN,
    OFF_THE_SCANS,
    Caveats,
    caveats_in,
    copied_from_traces,
    doubted,
    twins,
    warnings_in,
)
from reports.figures.simulators import SimulatorFiles, leads
from reports.gates import gates_in
from reports.nearer import farther_mm, nearer
from reports.origin import why_not_pooled
from reports.page import draw_sections, write_page
from reports.schema import FAILURES, OURS, OVERALL_FILE, SIMULATORS, SUMMARY, WHERE, Column
from reports.tables import first_row, in_texts, read_if_there
from reports.tips import tips_off
from reports.verdict import NEVER_NEAREST, badge, first_that_holds, headline, meaning_of_rival

PAGE = "simulators.html"
_MOST_WARNINGS, _MOST_REASONS = 5, 3
_MOST_SHARED = 0.75
"""Share of a simulator's frames up to which those that count for all of them are few."""


def render_simulators(out_dir: Path, embed: bool = False) -> Path:
    """Draw the figure and write simulators.html; returns its path. embed : pictures and numbers into the page."""
    files = SimulatorFiles(*(read_if_there(out_dir / table.file, table) for table in (SIMULATORS, WHERE)))
    places = folders_in(out_dir)
    warnings = {name: warnings_in(folder) for name, folder in places.items()}
    copied = {name: said for name, own in warnings.items() if (said := copied_from_traces(own))}
    table, columns = _one_table(files.simulators, copied)
    grid = _content.grid(table, columns, bad=_doubtful(table, copied), nothing=_content.NOTHING)
    folders = {name: places[name] for name in table["simulator"]}
    links = {name: quote((folder / "index.html").relative_to(out_dir).as_posix()) for name, folder in folders.items()}
    for row, name in zip(grid["rows"], table["simulator"], strict=True):
        row["cells"][0]["link"] = links[name]
    alien = {name: _not_ours(own, warnings.get(OURS, {})) for name, own in warnings.items()}
    alone = {str(row["simulator"]): row for row in table.to_dict("records")}
    few = set(_with_few(table)["simulator"])
    closed = {name: gates_in(folder, out_dir)["closed"] for name, folder in folders.items()}
    told = [
        {"name": name, "link": links[name]}
        | _said(alone[name], folder, alien[name], copied.get(name, ""), closed[name], few=name in few)
        for name, folder in folders.items()
    ]
    page = {
        "title": "Simulators side by side - wireval",
        "names": list(folders),
        "nearer": nearer(files.simulators.to_dict("records"), off=_off(table, copied)),
        "first": next(iter(places)),
        "said": told,
        "rivals": _rivals(told),
        **_ours(folders.get(OURS), links.get(OURS, "")),
        "interval": next(iter(table["interval"].dropna()), ""),
        "simulators": grid,
        "few": in_common(files.simulators),
        "sections": draw_sections("simulators", files, out_dir, embed),
        "where": _where(files.where),
        "off": _never_nearest(files.where),
    }
    return write_page("simulators.html.j2", page, out_dir / PAGE)


def _rivals(told: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """What is meant by each predictor that a verdict names."""
    named = dict.fromkeys(one["rival"] for one in told if one["rival"])
    return {_content.predictor_label(rival): meaning_of_rival(rival) for rival in named}


def folders_in(out_dir: Path) -> dict[str, Path]:
    """Where each simulator's own pages lie, by name: the first one's beside this page. Empty without a score."""
    names = read_if_there(out_dir / SIMULATORS.file, SIMULATORS)["simulator"].unique()
    return {name: out_dir / "simulators" / name if number else out_dir for number, name in enumerate(names)}


def _said(
    alone: Mapping[Any, Any], folder: Path, lines: Sequence[str], copied: str, closed: Sequence[str], *, few: bool
) -> dict[str, Any]:
    """Badge and verdict of a simulator, and warnings of its cases: these ``lines``.

    alone : its row of simulators.csv, which counts its frames also where nothing is pooled over them, and whose skill
    is over frames that count for all.     copied : that its wires were made from the traces.     few : it has too few
    frames to be judged beside the others.
    """
    row = first_row(read_if_there(folder / OVERALL_FILE, SUMMARY))
    alone_skill = row.get("skill_strongest"), row.get("strongest_frames")
    row |= {name: value for name, value in alone.items() if "strongest" in name or name in ("frames", "frames_ok")}
    if few:  # nor has it a skill against the centreline beside those of the others
        row.pop("skill", None)
    missing, mixed, good = not_run_sentence(folder), why_not_pooled(folder), alone["frames_ok"]
    failed = good < alone["frames"]
    why = {"cases missing": missing, "frames failed": failed, "not pooled": mixed, "gate closed": closed}
    status = first_that_holds(why)
    on_its_page = caveats_in(folder).warnings
    off_scans = [text for text in on_its_page if OFF_THE_SCANS in text]
    in_line = [line for line in lines if MOSTLY_LINES in line]
    caveats = Caveats("" if missing or failed or mixed else copied, twins(doubted(folder)), [*off_scans, *in_line])
    said, more = headline(row, alone["simulator"], caveats, defined=False)
    rival = row.get("strongest_null") if said and not caveats.copied else None
    lines = [line for line in lines if line not in (caveats.copied, *off_scans)]
    said = said or mixed or not_reached(folder) or "No frame of it has a result." * (not good)
    beside = "" if caveats.copied else _without_others(*alone_skill, row)
    more += filter(None, [beside, f"Of the study {missing}." * bool(missing)])
    return {
        "badge": badge(status, status == "ok", row, caveats._replace(warnings=on_its_page)),
        "verdict": said,
        "more": more,
        "rival": str(rival) if pd.notna(rival) else "",
        "closed": closed,
        "failures": _failed(folder, alone["simulator"]) if failed else [],
        "warnings": _first_of(lines),
    }


def _ours(folder: Path | None, link: str) -> dict[str, Any]:
    """The name of our own wires where they are among the others, and how many warnings stand on their page, and where:
    below they are left out, as the same scans, lumen and clamp give them to all.
    """
    count = len(caveats_in(folder).warnings) if folder else 0
    shared = {"count": counted(count, "warning"), "link": link} if count else {}
    return {"ours": OURS * bool(folder), "shared": shared}


def _first_of(lines: Sequence[str]) -> list[str]:
    rest = len(lines) - _MOST_WARNINGS
    more = f"{counted(rest, 'more warning')} on the pages of its cases"
    return [*lines[:_MOST_WARNINGS], *[more] * (rest > 0)]


def _without_others(skill: Any, frames: Any, beside: Mapping[str, Any]) -> str:
    """That its own pages tell another skill, over other frames; empty where these are the same, or not known."""
    if pd.isna(frames) or pd.isna(skill) or frames == beside.get("strongest_frames"):
        return ""
    own = f"{_content.number(skill)}, over {counted(int(frames), 'frame')}"
    return f"This skill is on the frames of all; the skill on its own pages is {own}."


def _failed(folder: Path, name: str) -> list[str]:
    """Which frames of a simulator have no result, and why, a line for those that are alike.

    The first simulator's folder has the failures of all, with their names.
    """
    rows = in_texts(read_if_there(folder / FAILURES.file, FAILURES))
    found = alike(row for row in rows if row["simulator"] in ("", name))
    lines = [f"{row['case']}, {row['of'] or 'all frames'}: {row['status']}: {row['sentence']}" for row in found]
    rest = len(lines) - _MOST_REASONS
    return [*lines[:_MOST_REASONS], *[f"and {counted(rest, 'more reason')}"] * (rest > 0)]


def _not_ours(warnings: Mapping[str, list[str]], ours: Mapping[str, list[str]]) -> list[str]:
    """Warnings, by case, that the same scans do not give with our wires, a line each."""
    return [
        f"{case}: {text}"
        for case, said in warnings.items()
        for text in said
        if text.removeprefix(OF_THEIR_RUN) not in ours.get(case, ())
    ]


def _one_table(rows: pd.DataFrame, copied: Container[str]) -> tuple[pd.DataFrame, list[Column]]:
    """A row for each simulator: its own numbers, then the ratio of its error to that of every other one.

    In order of rms_mm or, where it is larger, back_rms_mm: what a wire leaves out is no gain. Below those, who has
    failed frames, which neither counts, tips that rms_mm does not see, or wires made from the traces. copied : these.
    """
    table = rows[rows["against"].isna()]
    table = table.assign(doubtful=_doubtful(table, copied), far=[farther_mm(row) for row in table.to_dict("records")])
    table = table.sort_values(["doubtful", "far"], kind="stable")
    table = table.drop(columns=["doubtful", "far"]).reset_index(drop=True)
    columns = _content.quoted_first(SIMULATORS.shown("cases"))
    pairs = rows[rows["against"].notna()]
    for other in table["simulator"][table["simulator"].isin(pairs["against"])]:
        name = f"rms_ratio_to_{other}"
        mine = pairs[pairs["against"] == other].set_index("simulator")
        for end in ("", "_low", "_high"):
            table[name + end] = table["simulator"].map(mine[f"rms_ratio{end}"])
        meaning = f"rms_mm over that of {other}, on the frames that count in both; below 1: nearer than {other}"
        columns.append(Column(name, "1", meaning))
    return table, columns


def _off(table: pd.DataFrame, copied: Container[str]) -> set[str]:
    """The simulators with tips that rms_mm does not see, or with wires made from the traces."""
    rows = [dict(row) for _, row in table.iterrows()]
    return {str(row["simulator"]) for row in rows if row["simulator"] in copied or tips_off(row)}


def _doubtful(table: pd.DataFrame, copied: Container[str]) -> "pd.Series[bool]":
    """Whether a simulator has failed frames, tips that rms_mm does not see, or wires made from the traces."""
    return table["frames_ok"].lt(table["frames"]) | table["simulator"].isin(_off(table, copied))


def in_common(rows: pd.DataFrame) -> str:
    """That skill is over few frames, and who has no more, where one simulator leaves less than most of another's.

    rows : of simulators.csv.
    """
    table = rows[rows["against"].isna()]
    shared, most = table["common_frames"].min(), table["frames_ok"].max()
    some, few = table[table["frames_ok"] > 0], _with_few(table)
    named = listed([f"{row['simulator']} ({row['frames_ok']} of {most})" for row in few.to_dict("records")])
    left_out = f"too few frames for a skill beside others: {named}" if named else ""
    if not most or not shared <= _MOST_SHARED * most:
        return left_out
    fewer = some[(some["frames_ok"] < most) & ~some.index.isin(few.index)].to_dict("records")
    names = listed([f"{row['simulator']} ({row['frames_ok']})" for row in fewer])
    whom = "others" if named else "simulators"
    fewer_count = f": fewer than {most} count for {names}; a score without them tells more" if names else ""
    told = (
        f"only {shared:.0f} of {most} frames count for all {whom}, and skill_strongest beside others is over "
        f"these{fewer_count}"
    )
    return "; ".join(filter(None, (left_out, told)))


def _with_few(table: pd.DataFrame) -> pd.DataFrame:
    """The simulators that have frames, but no skill beside others that have one. table : their own rows."""
    some = table[table["frames_ok"] > 0]
    unjudged = some["skill_strongest"].isna()
    return some[unjudged & (not unjudged.all())]


def _never_nearest(where: pd.DataFrame) -> list[str]:
    """Who is never the nearest, each with the reason. where : of where.csv."""
    told = where[where["lead"].isin(NEVER_NEAREST)][["simulator", "lead"]].drop_duplicates()
    return sorted(f"{row['simulator']} ({row['lead']})" for row in told.to_dict("records"))


def _where(rows: pd.DataFrame) -> _content.Grid | None:
    """A row for each bin: every simulator's error, the nearest, and by how much."""
    if rows.empty:
        return None
    bins = ["along", "low_mm", "high_mm"]
    table = rows.pivot_table(index=bins, columns="simulator", values="rms_mm").reset_index()
    # as in the file, whose bins ascend: left unsorted, a pivot has 10 mm before 5
    kinds = list(dict.fromkeys(rows["along"]))
    table = table.sort_values("along", key=lambda along: along.map(kinds.index), kind="stable", ignore_index=True)
    names = list(dict.fromkeys(rows["simulator"]))
    lead = leads(rows).rename(columns={"simulator": "nearest"})
    ends = ["ratio_to_next", "ratio_to_next_low", "ratio_to_next_high"]
    table = table.merge(lead[[*bins, "nearest", *ends, "lead"]], on=bins, how="left")
    table["nearest"] = table["nearest"].where(table["lead"] != "tie")
    own = [Column(name, "mm", f"rms distance of {name} to the traced wire in this bin") for name in names]
    nearest = Column("nearest", "-", "the simulator with the least error here", "text")
    columns = [*map(WHERE.__getitem__, bins), *own, nearest, WHERE[ends[0]], WHERE["lead"]]
    return _content.grid(table, columns, nothing=_content.NOTHING)
