"""Scans of one case that do not lie on one grid: which is the odd one, said once."""

from collections.abc import Sequence

from pipeline.load import Header, LoadError, require_same_geometry
from pipeline.load.common import is_crop


def apart(headers: Sequence[Header]) -> list[str]:
    """A problem where scans lie on other grids than the first, or the first on another than all others: of many, one
    sentence.
    """
    if len(headers) < 2:
        return []
    first, *others = headers
    wrong = [(header, text) for header in others if (text := _against(first, header))]
    if not wrong:
        return []
    # a crop would be read but for the others: one that is none is what is wrong
    text = next((text for header, text in wrong if not is_crop(first, header)), wrong[0][1])
    if len(wrong) == 1:
        return [text]
    if len(wrong) == len(others) and not any(_against(others[0], header) for header in others[1:]):
        odd = f"{first.source} is the odd one of {len(headers)} scans, the others lie on one grid"
        return [f"{odd}; is it one of them? {text}"]
    return [f"{text} Of {len(headers)} scans {len(wrong) - 1} more differ from the first."]


def _against(one: Header, other: Header) -> str:
    try:
        require_same_geometry(one, other)
    except LoadError as error:
        return str(error)
    return ""
