"""How many frames a page speaks of, in words: a scan that the roll was fitted on is no frame that is scored."""

from reports.case_files import counted


def scans(good: int, planned: int, fitted: int, word: str) -> str:
    """``6 scans: 1 used for the roll, 5 scored``, and where not all are good ``4 scored, 1 without a result``.

    good, planned : of the frames beside the ``fitted`` ones.     word : what a good one is called.
    """
    lost = f", {planned - good} without a result" * (good < planned)
    return f"{counted(planned + fitted, 'scan')}: {fitted} used for the roll, {good} {word}{lost}"
