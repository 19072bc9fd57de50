"""The comparison in words: ratios within one run, never seconds of two machines."""

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
    for name, group in rows[(rows["scene"] == "bend") & (rows["joints"] == 60)].groupby("method", sort=False):
        if len(set(group["steps_per_mm"])) > 1:
            each = (
                f"{row['steps_per_mm']}: {row['bending_uJ']:.4g} µJ bending, {row['shape_error_mm']:.4f} mm off"
                for row in group.to_dict("records")
            )
            yield f"scene B, n = 60, steps per mm: {name}: {', '.join(each)}"
    yield CAVEAT


def _scene_a(rows: pd.DataFrame) -> Iterator[str]:
    """The least time of each to a tip error of 1e-4 of the length."""
    good = rows[rows["relative_tip_error"] <= TARGET_A]
    best = good.loc[good.groupby("method")["ms_per_step"].idxmin()].set_index("method")
    if OURS not in best.index:
        return
    for name, row in best.iterrows():
        ratio = row["ms_per_step"] / best.loc[OURS, "ms_per_step"]
        yield (
            f"scene A, tip within {TARGET_A:g} L: {name} n = {row['joints']}: {row['ms_per_step']:.3g} ms, "
            f"{ratio:.3g} times ours (error {row['relative_tip_error']:.2g})"
        )


def _scene_b(rows: pd.DataFrame) -> Iterator[str]:
    """Per step at equal numbers of joints: mean over the insertion, and the last step, where all wires are as long.

    Then against our quickest wire that is no further off than the rival's, where there is one.
    """
    ours = rows[rows["method"] == OURS]
    for _, row in rows[rows["method"] != OURS].merge(ours, on="joints", suffixes=("", "_ours")).iterrows():
        took, mine, off = row["ms_per_step"], row["ms_per_step_ours"], row["shape_error_mm"]
        last, share = row["ms_last_step"] / row["ms_last_step_ours"], 100 * row["callback_share"]
        text = (
            f"scene B, n = {row['joints']}: {row['method']} {took:.3g} ms per step, {took / mine:.3g} times ours "
            f"({mine:.3g} ms; last step {last:.3g} times), error {off:.4f} mm against "
            f"{row['shape_error_mm_ours']:.4f}; {share:.0f} % of its time is the Python wall"
        )
        good = ours[ours["shape_error_mm"] <= off]
        if not good.empty:
            best = good.loc[good["ms_per_step"].idxmin()]
            text += f"; {took / best['ms_per_step']:.3g} times ours of equal or lower error "
            text += f"(n = {best['joints']}, {best['shape_error_mm']:.4f} mm)"
        yield text
