"""The scans of one case: their headers, read and held against each other before any voxel is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from pipeline.load import Header, Source, read_header, require_same_geometry
from pipeline.load.config import LoadConfig


@dataclass(frozen=True, eq=False)
class Scans:
    """Headers of a case's scans; all share one geometry."""

    reference: Header | None
    frames: tuple[Header, ...]

    @property
    def all(self) -> tuple[Header, ...]:
        """The reference, if there is one, and the frames."""
        return (*((self.reference,) if self.reference else ()), *self.frames)

    @property
    def first(self) -> Header | None:
        """The scan that the lumen comes from: the wire-free one, else the frame with the least wire in it."""
        return next(iter(self.all), None)

    @property
    def assumed(self) -> tuple[str, ...]:
        """What the files lacked, each said once."""
        return tuple(dict.fromkeys(text for header in self.all for text in header.assumed))


def each_volume(header: Header) -> Iterator[Header]:
    """A sequence in one file as one header per volume."""
    if header.item_count == 1:
        yield header
        return
    for item in range(header.item_count):
        yield replace(header, source=replace(header.source, item=item), item_count=1)


def read_headers(
    reference: Source | None,
    frames: Sequence[Source],
    config: LoadConfig,
    spacing_mm: ArrayLike | None = None,
) -> Scans:
    """Headers of a case's scans; raises LoadError where one is unusable or its geometry differs from the first's."""
    empty = read_header(reference, config, spacing_mm) if reference else None
    headers = [read_header(source, config, spacing_mm) for source in frames]
    scans = Scans(empty, tuple(volume for header in headers for volume in each_volume(header)))
    for header in scans.frames:
        require_same_geometry(scans.all[0], header)
    return scans
