"""The comparison in words: ratios within one run, never seconds of two machines."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

OURS = "wireval newton"
TARGET_A = 1e-4
CAVEAT = "Each rival was set up in a short time; an expert of a tool may do better."


def sentences(rows: pd.DataFrame) -> Iterator[str]:
    """Scene A at equal error, scene B at equal joints, sub-steps, and what the wall's callback costs."""
    if rows.empty or OURS not in set(rows["method"]):
        return
    plain = rows[rows["steps_per_mm"] == 1]
    yield from _scene_a(plain[plain["scene"] == "cantilever"])
    yield from _scene_b(plain[plain["scene"] == "bend"])
    yield from _sub_steps(rows)
    yield CAVEAT


def _scene_a(rows: pd.DataFrame) -> Iterator[str]:
    """The least time of each to a tip error of 1e-4 of the length."""
    good = rows[rows["relative_tip_error"] <= TARGET_A]
    best = good.loc[good.groupby("method")["ms_per_step"].idxmin()].set_index("method")
    if OURS not in best.index:
        return
    ours = best.loc[OURS]
    for name, row in best.iterrows():
        yield (
            f"scene A, tip within {TARGET_A:g} L: {name} n = {row['joints']}: {row['ms_per_step']:.3g} ms, "
            f"{row['ms_per_step'] / ours['ms_per_step']:.3g} times ours (error {row['relative_tip_error']:.2g})"
        )


def _scene_b(rows: pd.DataFrame) -> Iterator[str]:
    """Per step at equal numbers of joints: mean over the insertion, and the last step, where all wires are as long."""
    ours = rows[rows["method"] == OURS].set_index("joints")
    for _, row in rows[rows["method"] != OURS].iterrows():
        if row["joints"] not in ours.index:
            continue
        mine = ours.loc[row["joints"]]
        mean, last = row["ms_per_step"] / mine["ms_per_step"], row["ms_last_step"] / mine["ms_last_step"]
        yield (
            f"scene B, n = {row['joints']}: {row['method']} {row['ms_per_step']:.3g} ms per step, {mean:.3g} times "
            f"ours ({mine['ms_per_step']:.3g} ms; last step {last:.3g} times), error {row['shape_error_mm']:.4f} mm "
            f"against {mine['shape_error_mm']:.4f}; {100 * row['callback_share']:.0f} % of its time is the Python wall"
            f"{_at_equal_error(row, ours)}"
        )


def _at_equal_error(row: pd.Series, ours: pd.DataFrame) -> str:
    """Our quickest wire that is no further off than the rival's."""
    good = ours[ours["shape_error_mm"] <= row["shape_error_mm"]]
    if good.empty:
        return ""
    best = good.loc[good["ms_per_step"].idxmin()]
    ratio = row["ms_per_step"] / best["ms_per_step"]
    return (
        f"; {ratio:.3g} times ours of equal or lower error (n = {best.name}, {best['shape_error_mm']:.4f} mm)"
    )


def _sub_steps(rows: pd.DataFrame) -> Iterator[str]:
    """The same wire pushed in with other numbers of steps per mm."""
    mine = rows[(rows["scene"] == "bend") & (rows["joints"] == 60)]
    for name, group in mine.groupby("method", sort=False):
        if len(set(group["steps_per_mm"])) > 1:
            each = ", ".join(
                f"{row['steps_per_mm']}: {row['bending_uJ']:.4g} µJ bending, {row['shape_error_mm']:.4f} mm off"
                for _, row in group.iterrows()
            )
            yield f"scene B, n = 60, steps per mm: {name}: {each}"
