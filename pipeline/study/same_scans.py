"""The same scan where it would count twice: in one case, or as several insertions of a study."""

from collections import Counter
from collections.abc import Sequence

from pipeline.load import Source
from pipeline.study.manifest import Case


def repeated(case: Case) -> list[str]:
    """Scans or traces of a case that are listed more than once, or are its reference, a sentence each."""
    several = Counter(map(_place, case.frames)) + Counter(map(_place, case.traces))
    problems = [
        f"{path}: listed {count} times; a frame is one scan" for (path, _), count in several.items() if count > 1
    ]
    if case.reference is not None and _place(case.reference) in several:
        problems.append(f"{case.reference.path}: reference and frame; the reference is a scan without the wire")
    return problems


def shared(cases: Sequence[Case]) -> list[str]:
    """Cases of different groups that name the same scan, a sentence for each two; they count as one insertion."""
    first: dict[tuple[str, str], Case] = {}
    found = {}
    for case in cases:
        for source in (*case.frames, *case.traces):
            other = first.setdefault(_place(source), case)
            if other.group != case.group:
                found[other.id, case.id] = source.path
    return [
        f"cases {one!r} and {two!r} share {path}: they count as one insertion, as with the same group"
        for (one, two), path in found.items()
    ]


def _place(source: Source) -> tuple[str, str]:
    try:
        path = source.path.resolve()
    except (OSError, RuntimeError, ValueError):  # a loop of links: that the file cannot be read is said elsewhere
        path = source.path
    return str(path), str(source.dataset)
