"""What the table of a sweep does not show by itself: a point in which every frame fails is a row without numbers."""

import pandas as pd

UNCHANGED = "(plain)"
"""The parameter of the rows of sweep.csv in which nothing was changed."""


def silent_points(sweep: pd.DataFrame) -> list[str]:
    """A sentence for each point of which no frame is ok, where the plain result has one that is."""
    good: dict[tuple[str, str], int] = {}
    for row in sweep.to_dict("records"):
        name = str(row["parameter"])
        point = name, "" if name == UNCHANGED else str(row["value"])
        good[point] = good.get(point, 0) + (0 if pd.isna(row["frames_ok"]) else int(row["frames_ok"]))
    if not good.get((UNCHANGED, "")):
        return []
    return [f"sweep point {name} = {value}: no frame is ok" for (name, value), count in good.items() if not count]
