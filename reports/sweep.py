"""What the table of a sweep does not show by itself: points in which frames fail, and whose rows lack them."""

import pandas as pd

from reports.case_files import counted
from reports.schema import ALL

UNCHANGED = "(plain)"
"""The parameter of the rows of sweep.csv in which nothing was changed."""


def silent_points(sweep: pd.DataFrame) -> list[str]:
    """A sentence for each point of which fewer frames are ok than in the plain result of the same cases."""
    good: dict[tuple[str, str], dict[str, int]] = {}
    for row in sweep[sweep["case"] != ALL].to_dict("records"):
        name = str(row["parameter"])
        point = good.setdefault((name, "" if name == UNCHANGED else str(row["value"])), {})
        point[str(row["case"])] = 0 if pd.isna(row["frames_ok"]) else int(row["frames_ok"])
    plain = good.pop((UNCHANGED, ""), {})
    # a case that was not swept, or whose result was lost, has no row at the point
    counts = {point: (sum(of.values()), sum(plain.get(case, 0) for case in of)) for point, of in good.items()}
    return [
        f"sweep point {name} = {value}: {_fewer(count, of)}"
        for (name, value), (count, of) in counts.items()
        if count < of
    ]


def _fewer(count: int, plain: int) -> str:
    """What it means for a point's row that fewer frames are ok than in the plain result."""
    if not count:
        return "no frame is ok"
    return (
        f"{counted(count, 'frame')} {'is' if count == 1 else 'are'} ok, {plain} in the plain result: its rms_mm, "
        "tip_median_mm, truth_rms_mm and skill are over those alone, its rms_ratio and skill_strongest over the frames "
        "that are ok in both; errors.csv of each of its cases says why the others failed"
    )
