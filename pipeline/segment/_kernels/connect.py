"""Fuzzy connectedness: strength of a voxel = the best path from a seed, a path being as strong as its weakest link.

Udupa and Samarasekera, Graph. Models Image Process. 58 (1996) 246. Grey values are smoothed and quantised in tiles of
8^3 voxels as the search comes to them. A cell is a voxel's place in memory, tile after tile: tile * CELLS + place in
the tile. There is a cell for every voxel, and a layer of tiles around the volume; but cells take memory only where
they are written to (:mod:`pipeline.arrays.lattice`), so cost and memory follow the object, not the volume.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, grown, kernel, unravelled
from pipeline.segment._kernels.tiles import CELLS, GREY_STEPS, INNER, SHIFT, SIDE, scratch, smooth_tile

FULL = 255
"""Quantised strength of a seed: strengths are 0 to 255."""
SEEN = 1 << 15
"""Mark of a cell that is reached, or lies outside the volume and never will be."""
GREY = GREY_STEPS - 1
"""Bits of a cell that hold its grey level."""
READ, BEYOND = 1, 2
"""Marks of a tile that was read, and of one that lies outside the volume; 0: not asked for yet."""


class Affinity(NamedTuple):
    """Tables of the pairwise affinity sqrt(H O), 0..255, over quantised grey: level = (grey - low) * scale.

    H = exp(-(f - g)^2 / 2 s_H^2) and O = exp(-(m - (f + g)/2)^2 / 2 s_O^2), 1 above the object's mean m.
    The geometric mean lets each feature veto: a weighted sum keeps a floor in any even background, and leaks.
    homogeneity, feature : float32, over the difference and the sum of two levels.  taps : the smoothing beforehand.
    """

    homogeneity: NDArray[Any]
    feature: NDArray[Any]
    low: float
    scale: float
    taps: NDArray[Any]


class Search(NamedTuple):
    """What a search goes over, and what it knows of it.

    volume : C-contiguous grey.  cells : uint16, level and SEEN of a voxel, 0 at first.  tiles : uint8, READ or BEYOND,
    0 at first.  layout : tiles along each axis; tile (1, 1, 1) holds voxel (0, 0, 0).  offsets : (n, 3) of a voxel's
    neighbours.
    """

    volume: NDArray[Any]
    affinity: Affinity
    cells: NDArray[Any]
    tiles: NDArray[Any]
    layout: tuple[int, int, int]
    offsets: NDArray[Any]


@kernel
def _read_tile(s: Search, tile: int, work: NDArray[Any]) -> None:
    """Fill a tile's cells with smoothed grey, quantised to 0..GREY_STEPS-1; those outside the volume become SEEN."""
    a, b, c = unravelled(tile, s.layout)
    i0, j0, k0 = (a - 1) * SIDE, (b - 1) * SIDE, (c - 1) * SIDE
    ni, nj, nk = s.volume.shape
    cells = s.cells[tile * CELLS : (tile + 1) * CELLS]
    if min(i0, j0, k0) < 0 or i0 >= ni or j0 >= nj or k0 >= nk:
        s.tiles[tile] = BEYOND
        cells[:] = SEEN
        return
    s.tiles[tile] = READ
    smooth_tile(s.volume, s.affinity.taps, (i0, j0, k0), work[0], work[1])
    low, scale, w = s.affinity.low, s.affinity.scale, SIDE + 2 * (s.affinity.taps.shape[0] // 2)
    n = 0
    for i in range(SIDE):
        for j in range(SIDE):
            row = work[1, (i * w + j) * w : (i * w + j) * w + SIDE]
            to = cells[n : n + SIDE]
            for k in range(SIDE):
                to[k] = np.int32(min(max((row[k] - low) * scale + 0.5, 0.0), GREY_STEPS - 1.0))
            if i0 + i >= ni or j0 + j >= nj:
                to[:] = SEEN
            elif k0 + SIDE > nk:
                to[nk - k0 :] = SEEN
            n += SIDE


@kernel
def _away(cell: int, x: int, y: int, z: int, tiles: tuple[int, int, int]) -> tuple[int, int]:
    """The cell ``x, y, z`` voxels away from ``cell``, and the tile it is in; tiles : their number along each axis."""
    x, y, z = x + ((cell >> (2 * SHIFT)) & INNER), y + ((cell >> SHIFT) & INNER), z + (cell & INNER)
    tile = cell // CELLS + ((x >> SHIFT) * tiles[1] + (y >> SHIFT)) * tiles[2] + (z >> SHIFT)
    return tile * CELLS + (((x & INNER) << (2 * SHIFT)) | ((y & INNER) << SHIFT) | (z & INNER)), tile


@kernel
def _flat(s: Search, cells: NDArray[Any]) -> NDArray[Any]:
    """Cells as flat indices of the volume."""
    out = np.empty(cells.shape[0], np.int64)
    _, nj, nk = s.volume.shape
    tile = a = b = c = 0
    for n in range(cells.shape[0]):
        cell = cells[n]
        if cell // CELLS != tile:
            tile = cell // CELLS
            a, b, c = unravelled(tile, s.layout)
        i = (a - 1) * SIDE + ((cell >> (2 * SHIFT)) & INNER)
        j = (b - 1) * SIDE + ((cell >> SHIFT) & INNER)
        out[n] = (i * nj + j) * nk + (c - 1) * SIDE + (cell & INNER)
    return out


@kernel
def _affinity(cells: NDArray[Any], homogeneity: NDArray[Any], feature: NDArray[Any], here: Any, to: int) -> float:
    """Affinity, 0 to 255, between a voxel of grey level ``here`` and that of the cell ``to``; -1 if the cell is SEEN.

    Takes arrays instead of a Search: both searches spend their time here, and would take five times as long.
    """
    there = np.int64(cells[to])
    if there >= SEEN:
        return -1.0
    return float(homogeneity[abs(here - there)] * feature[here + there])


@kernel
def _seed(s: Search, seeds: NDArray[Any], n: int, work: NDArray[Any]) -> int:
    """The cell of a seed, its tile read."""
    cell, tile = _away(0, seeds[n, 0] + SIDE, seeds[n, 1] + SIDE, seeds[n, 2] + SIDE, s.layout)
    if s.tiles[tile] == 0:
        _read_tile(s, tile, work)
    return int(cell)


@entry_point
def flood(s: Search, seeds: NDArray[Any], threshold: int) -> NDArray[Any]:
    """Voxels whose strength of connectedness is at least ``threshold`` (an alpha cut), without a priority queue.

    Links of at least the threshold reach exactly that set in whatever order they are visited: first come, first served
    is several times faster than ordering by strength. Returns flat indices in the order in which they were reached.
    """
    work, cut = scratch(s.affinity.taps), np.float32(threshold - 0.5)
    cells, tiles, offsets, (homogeneity, feature) = s.cells, s.tiles, s.offsets, s.affinity[:2]
    order = np.empty(65536, np.int64)
    count = done = 0
    for n in range(seeds.shape[0]):
        start = _seed(s, seeds, n, work)
        if cells[start] < SEEN:
            cells[start] |= SEEN
            order[count] = start
            count += 1
    while done < count:
        cell = order[done]
        done += 1
        if count + offsets.shape[0] > order.shape[0]:
            order = grown(order)
        here = np.int64(cells[cell]) & GREY
        for m in range(offsets.shape[0]):
            to, tile = _away(cell, offsets[m, 0], offsets[m, 1], offsets[m, 2], s.layout)
            if tiles[tile] == 0:
                _read_tile(s, tile, work)
            if _affinity(cells, homogeneity, feature, here, to) >= cut:
                cells[to] |= SEEN
                order[count] = to
                count += 1
    return np.asarray(_flat(s, order[:count]))


class _Buckets(NamedTuple):
    """Cells still to visit, one linked list per strength: each list's first entry; each entry's cell and next entry."""

    head: NDArray[Any]
    cell: NDArray[Any]
    after: NDArray[Any]


@kernel
def _push(b: _Buckets, strength: int, cell: int, entry: int) -> None:
    b.cell[entry], b.after[entry], b.head[strength] = cell, b.head[strength], entry


@kernel
def _pop(b: _Buckets, strength: NDArray[Any], bucket: int, threshold: int) -> tuple[int, int]:
    """Take out the strongest cell still to visit; returns it, -1 if none has at least ``threshold``, and its bucket.

    A cell is pushed only when its strength rises: an entry is stale if its bucket is not the cell's present strength.
    """
    while bucket >= threshold:
        entry = b.head[bucket]
        if entry < 0:
            bucket -= 1
            continue
        b.head[bucket] = b.after[entry]
        if strength[b.cell[entry]] == bucket:
            return b.cell[entry], bucket
    return -1, bucket


@kernel
def _once(s: Search, entries: NDArray[Any], strength: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Each of the cells once, though listed several times: flat voxel and strength; sets ``strength`` back to 0."""
    found, count = np.empty(entries.shape[0], np.uint8), 0
    for cell in entries:
        if strength[cell] > 0:
            entries[count], found[count], strength[cell] = cell, strength[cell], 0
            count += 1
    return _flat(s, entries[:count]), found[:count]


@entry_point
def strengths(
    s: Search, seeds: NDArray[Any], threshold: int, strength: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Strength of connectedness 0..255 of every voxel that has at least ``threshold``: flat indices, strengths (uint8).

    Dijkstra's algorithm for max-min paths with one bucket per quantised strength. strength : uint8 zeros, one a cell,
    working memory.
    """
    work = scratch(s.affinity.taps)
    cells, tiles, offsets, (homogeneity, feature) = s.cells, s.tiles, s.offsets, s.affinity[:2]
    b = _Buckets(np.full(FULL + 1, -1, np.int64), np.empty(4096, np.int64), np.empty(4096, np.int64))
    pushed = 0
    for n in range(seeds.shape[0]):
        start = _seed(s, seeds, n, work)
        if strength[start] < FULL:
            strength[start] = FULL
            _push(b, FULL, start, pushed)
            pushed += 1
    cell, bucket = _pop(b, strength, FULL, threshold)
    while cell >= 0:
        if pushed + offsets.shape[0] > b.cell.shape[0]:
            b = _Buckets(b.head, grown(b.cell), grown(b.after))
        here = np.int64(cells[cell])
        for m in range(offsets.shape[0]):
            to, tile = _away(cell, offsets[m, 0], offsets[m, 1], offsets[m, 2], s.layout)
            if tiles[tile] == 0:
                _read_tile(s, tile, work)
            if strength[to] >= bucket:
                continue
            link = min(bucket, int(_affinity(cells, homogeneity, feature, here, to) + 0.5))
            if link >= threshold and link > strength[to]:
                strength[to] = link
                _push(b, link, to, pushed)
                pushed += 1
        cell, bucket = _pop(b, strength, bucket, threshold)
    voxels, found = _once(s, b.cell[:pushed], strength)
    return voxels, found
