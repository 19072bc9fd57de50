"""What the table of a sweep does not show by itself: a point in which every frame fails is a row without numbers."""

import pandas as pd

UNCHANGED = "(plain)"
"""The parameter of the rows of sweep.csv in which nothing was changed."""


def silent_points(sweep: pd.DataFrame) -> list[str]:
    """A sentence for each point of which no frame is ok, where the plain result has one that is."""
    good = sweep.assign(frames_ok=pd.to_numeric(sweep["frames_ok"]).fillna(0))
    points = good.groupby(["parameter", "value"], sort=False, dropna=False)["frames_ok"].sum()
    if not points.loc[points.index.get_level_values("parameter") == UNCHANGED].sum():
        return []
    return [f"sweep point {parameter} = {value}: no frame is ok" for (parameter, value), n in points.items() if not n]
