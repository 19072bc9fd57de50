"""The same scan where it would count twice: in one case, or as several insertions of a study."""

import filecmp
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import combinations, pairwise
from pathlib import Path

from pipeline.load import LoadError, Source, parts_of
from pipeline.load.guard import size_of
from pipeline.study.manifest import Case

SAMPLE_BYTES, SAMPLES = 4096, 8
"""Read of a file to tell it from others of its size: noise differs in the first of these places."""


def repeated(case: Case) -> list[str]:
    """Scans or traces of a case that are listed more than once, or are its reference, a sentence each."""
    several = Counter(map(_place, case.frames)) + Counter(map(_place, case.traces))
    problems = [
        f"{path}: listed {count} times; a frame is one scan" for (path, _), count in several.items() if count > 1
    ]
    if case.reference is not None and _place(case.reference) in several:
        problems.append(f"{case.reference.path}: reference and frame; the reference is a scan without the wire")
    return problems or list(_copies(case))


def _copies(case: Case) -> Iterator[str]:
    """Frames or traces with the very content of another one, or of the reference, a sentence each."""
    empty = () if case.reference is None else (case.reference.path,)
    for sources, before in ((case.frames, empty), (case.traces, ())):
        paths = dict.fromkeys([*before, *(source.path for source in sources if not source.dataset)])
        for first, second in _of_one_content(paths):
            if first in before:
                yield f"{second}: has the content of the reference, {first}; a frame is a scan with the wire"
            else:
                yield f"{second}: has the content of {first}; a frame counts once; take one of the two out"


def _of_one_content(paths: Iterable[Path]) -> Iterator[tuple[Path, Path]]:
    """Pairs of regular files with the same content, their voxels beside them included: the headers of NIfTI pairs are
    all alike. Of several the first with each of the others.
    """
    alike: dict[object, list[tuple[Path, ...]]] = defaultdict(list)
    for path in paths:
        with suppress(LoadError, OSError):  # a folder, or what cannot be read: the reader says so
            files = (path, *parts_of(path))
            alike[tuple(map(_sample, files))].append(files)
    found: set[Path] = set()
    for group in alike.values():
        for one, other in combinations(group, 2):
            same = (filecmp.cmp(*pair, shallow=False) for pair in zip(one, other, strict=True))
            if not {one[0], other[0]} & found and all(same):
                found.add(other[0])
                yield one[0], other[0]


def _sample(path: Path) -> tuple[int, bytes]:
    """Bytes of a file, and a few short pieces, evenly through it, which tell two scans apart without reading them."""
    size = size_of(path)
    with path.open("rb") as file:
        pieces = []
        for n in range(SAMPLES):
            file.seek(max(0, size - SAMPLE_BYTES) * n // (SAMPLES - 1))
            pieces.append(file.read(SAMPLE_BYTES))
    return size, b"".join(pieces)


def shared(cases: Sequence[Case]) -> list[str]:
    """Pairs of cases that name the same scan, a sentence for each two, with what follows for the statistics."""
    first: dict[tuple[str, str], Case] = {}
    found = {}
    for case in cases:
        projected = [] if case.projections is None else [Source(case.projections)]
        for source in (*case.frames, *case.traces, *projected):
            other = first.setdefault(_place(source), case)
            if other.id != case.id:
                found[other.id, case.id] = source.path, other.group == case.group
    return [
        f"cases {one!r} and {two!r} share {path}: "
        + ("its frame counts twice" if same_group else "they count as one insertion, as with the same group")
        for (one, two), (path, same_group) in found.items()
    ]


def continued(cases: Sequence[Case]) -> list[str]:
    """A sentence for cases that look like one insertion cut in parts: stated alike, with depths that follow each other
    or take turns.

    A second insertion with the same fixation begins at the front again, or is rolled otherwise.
    """
    alike: dict[object, list[Case]] = defaultdict(list)
    for case in cases:
        if case.insertion_mm and case.reference is not None and case.group == case.id:
            where = tuple(case.entry_mm), tuple(case.entry_direction), str(case.stated_roll_deg), case.wire.name
            alike[where, _place(case.reference)].append(case)
    said = []
    for group in alike.values():
        parts = sorted((min(case.insertion_mm or ()), max(case.insertion_mm or ()), case.id) for case in group)
        follow = all(before[1] < after[0] for before, after in pairwise(parts))
        if len(parts) > 1 and (follow or _take_turns(group)):
            named = ", ".join(f"{name} ({first:g} to {last:g} mm)" for first, last, name in parts)
            said.append(
                f"cases {named} have one reference, entry, wire and roll, and depths that "
                f"{'follow each other' if follow else 'take turns'}: they count as {len(parts)} insertions; are they "
                "parts of one? then give them one group, else each a group of its own name"
            )
    return said


def _take_turns(cases: Sequence[Case]) -> bool:
    """Whether the depths of cases, in order, are of one case after the other, round and round; one may be missing."""
    depths = sorted((depth, number) for number, case in enumerate(cases) for depth in case.insertion_mm or ())
    order, count = [number for _, number in depths], len(cases)
    apart = all(before < after for (before, _), (after, _) in pairwise(depths))
    again = sum(one == other for one, other in pairwise(order))
    # twice round and less is chance; of each 2 n neighbours none is missing
    whole = all(len(set(order[n : n + 2 * count])) == count for n in range(len(order) - 2 * count + 1))
    return apart and whole and again <= 1 and len(order) >= 3 * count - 1


def _place(source: Source) -> tuple[str, str]:
    try:
        path = source.path.resolve()
    except (OSError, RuntimeError, ValueError):  # a loop of links: that the file cannot be read is said elsewhere
        path = source.path
    return str(path), str(source.dataset)
