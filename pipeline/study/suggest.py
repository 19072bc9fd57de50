"""Unknown key -> did you mean: one sentence for manifests, configs and command lines."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def did_you_mean(key: str, allowed: Iterable[str]) -> str:
    """Sentence naming the nearest allowed key, or all of them."""
    names = sorted(allowed)
    close = get_close_matches(key, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"allowed: {', '.join(names)}"
