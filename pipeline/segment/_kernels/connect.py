"""Fuzzy connectedness: strength of a voxel = the best path from a seed, a path being as strong as its weakest link.

Udupa and Samarasekera, Graph. Models Image Process. 58 (1996) 246. Grey values are smoothed and quantised in tiles of
8^3 voxels as the search comes to them, and all state lives in those tiles: cost and memory follow the object, not the
volume. A cell is a voxel's place in the pool of tiles: tile * CELLS + place within the tile.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.arrays.tiles import CELLS, INNER, LEVELS, SEEN, SHIFT, SIDE, grown, open_tile, scratch

FULL = 255
"""Quantised strength of a seed: strengths are 0 to 255."""
OUTSIDE = ~INNER
"""Bits that an index within a tile never has; one step out of it, either way, sets some."""
GREY = LEVELS - 1
"""Bits of a cell that hold its grey level."""


@njit(cache=True, inline="always")
def _cell(slot: int, x: int, y: int, z: int) -> int:
    """The cell in the tile at position ``slot`` - 1 of a voxel with these indices, of which the last bits count."""
    return (slot - 1) * CELLS + (((x & INNER) << (2 * SHIFT)) | ((y & INNER) << SHIFT) | (z & INNER))


@njit(cache=True)
def _steps(offsets: NDArray[Any]) -> NDArray[Any]:
    """From a cell to its neighbours in the same tile."""
    out = np.empty(offsets.shape[0], np.int64)
    for m in range(offsets.shape[0]):
        out[m] = (offsets[m, 0] * SIDE + offsets[m, 1]) * SIDE + offsets[m, 2]
    return out


@njit(cache=True)
def _append_tile(
    volume: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    table: NDArray[Any],
    at: tuple[int, int, int],
    work: NDArray[Any],
    pool: NDArray[Any],
    tiles: NDArray[Any],
    used: int,
) -> int:
    """Read the tile with these three indices into the pool; returns how many tiles there are now, which is its slot."""
    tiles[used, 0], tiles[used, 1], tiles[used, 2] = at
    open_tile(volume, taps, low, scale, tiles[used], work, pool[used * CELLS : (used + 1) * CELLS])
    table[at] = used + 1
    return used + 1


@njit(cache=True, inline="always")
def _neighbour(tiles: NDArray[Any], tile: int, x: int, y: int, z: int) -> tuple[int, int, int]:
    """Indices of the tile that holds a voxel with these indices, counted from the first voxel of ``tile``."""
    return tiles[tile, 0] + (x >> SHIFT), tiles[tile, 1] + (y >> SHIFT), tiles[tile, 2] + (z >> SHIFT)


@njit(cache=True, inline="always")
def _beyond(at: tuple[int, int, int], shape: tuple[int, int, int]) -> bool:
    """Whether a tile lies outside the table."""
    return min(at) < 0 or at[0] >= shape[0] or at[1] >= shape[1] or at[2] >= shape[2]


@njit(cache=True)
def _with_room(
    pool: NDArray[Any], tiles: NDArray[Any], used: int, more: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The pool and its tiles' indices, with room for some more tiles."""
    while (used + more) * CELLS > pool.shape[0]:
        pool = grown(pool)
        larger = np.empty((2 * tiles.shape[0], 3), tiles.dtype)
        larger[:used] = tiles[:used]
        tiles = larger
    return pool, tiles


@njit(cache=True)
def _as_long(array: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """The array itself, or zeros as long as ``other`` that begin with it."""
    if array.shape[0] == other.shape[0]:
        return array
    longer = np.zeros(other.shape[0], array.dtype)
    longer[: array.shape[0]] = array
    return longer


@njit(cache=True)
def _flat(cells: NDArray[Any], tiles: NDArray[Any], shape: tuple[int, int, int]) -> NDArray[Any]:
    """Cells as flat indices of the volume."""
    out = np.empty(cells.shape[0], np.int64)
    for n in range(cells.shape[0]):
        cell = cells[n]
        tile = cell // CELLS
        i = tiles[tile, 0] * SIDE + ((cell >> (2 * SHIFT)) & INNER)
        j = tiles[tile, 1] * SIDE + ((cell >> SHIFT) & INNER)
        out[n] = (i * shape[1] + j) * shape[2] + tiles[tile, 2] * SIDE + (cell & INNER)
    return out


@njit(cache=True)
def flood(
    volume: NDArray[Any],
    table: NDArray[Any],
    seeds: NDArray[Any],
    offsets: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    homogeneity: NDArray[Any],
    feature: NDArray[Any],
    threshold: int,
) -> tuple[NDArray[Any], int]:
    """Voxels whose strength of connectedness is at least ``threshold``: an alpha cut needs no queue.

    Any order of visiting links of at least the threshold reaches exactly that set, so first come first served does,
    which is several times faster than ordering by strength. ``table`` (int32 zeros, one per tile of the volume) gets
    the tiles' slots. Returns flat indices in the order in which they were reached, and the number of tiles read.
    """
    work = scratch(taps)
    pool, tiles, used = np.empty(64 * CELLS, np.uint16), np.empty((64, 3), np.int64), 0
    cut = np.float32(threshold - 0.5)
    links, step = offsets.shape[0], _steps(offsets)
    order = np.empty(65536, np.int32)
    count = 0
    for s in range(seeds.shape[0]):
        i, j, k = seeds[s, 0], seeds[s, 1], seeds[s, 2]
        pool, tiles = _with_room(pool, tiles, used, 1)
        slot = table[i >> SHIFT, j >> SHIFT, k >> SHIFT]
        if slot == 0:
            at = (i >> SHIFT, j >> SHIFT, k >> SHIFT)
            slot = used = _append_tile(volume, taps, low, scale, table, at, work, pool, tiles, used)
        start = _cell(slot, i, j, k)
        if pool[start] < SEEN:
            pool[start] |= SEEN
            order[count] = start
            count += 1
    done = 0
    while done < count:
        cell = np.int64(order[done])
        done += 1
        if count + links > order.shape[0]:
            order = grown(order)
        if (used + links) * CELLS > pool.shape[0]:
            pool, tiles = _with_room(pool, tiles, used, links)
        here = np.int64(pool[cell]) & GREY
        x, y, z = (cell >> (2 * SHIFT)) & INNER, (cell >> SHIFT) & INNER, cell & INNER
        for m in range(links):
            a, b, c = x + offsets[m, 0], y + offsets[m, 1], z + offsets[m, 2]
            to = cell + step[m]
            if (a | b | c) & OUTSIDE:
                at = _neighbour(tiles, int(cell) // CELLS, a, b, c)
                if _beyond(at, table.shape):
                    continue
                slot = table[at]
                if slot == 0:
                    slot = used = _append_tile(volume, taps, low, scale, table, at, work, pool, tiles, used)
                to = _cell(slot, a, b, c)
            there = np.int64(pool[to])
            if there >= SEEN or homogeneity[abs(here - there)] * feature[here + there] < cut:
                continue
            pool[to] = there | SEEN
            order[count] = to
            count += 1
    return _flat(order[:count], tiles, volume.shape), used


@njit(cache=True)
def strengths(
    volume: NDArray[Any],
    table: NDArray[Any],
    seeds: NDArray[Any],
    offsets: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    homogeneity: NDArray[Any],
    feature: NDArray[Any],
    threshold: int,
) -> tuple[NDArray[Any], NDArray[Any], int]:
    """Strength of connectedness 0..255 of every voxel that has at least ``threshold``.

    Dijkstra's algorithm for max-min paths with one bucket per quantised strength (linked lists in two growing
    arrays). A voxel is pushed only when its strength rises, so an entry is stale exactly when its bucket differs
    from the voxel's strength. Returns flat indices, their strengths (uint8), and the number of tiles read.
    """
    work = scratch(taps)
    pool, tiles, used = np.empty(64 * CELLS, np.uint16), np.empty((64, 3), np.int64), 0
    strength = np.zeros(pool.shape[0], np.uint8)
    links, step = offsets.shape[0], _steps(offsets)
    head = np.full(FULL + 1, -1, np.int32)
    queue, after, order = np.empty(4096, np.int32), np.empty(4096, np.int32), np.empty(4096, np.int32)
    count = pushed = 0
    for s in range(seeds.shape[0]):
        i, j, k = seeds[s, 0], seeds[s, 1], seeds[s, 2]
        pool, tiles = _with_room(pool, tiles, used, 1)
        strength = _as_long(strength, pool)
        slot = table[i >> SHIFT, j >> SHIFT, k >> SHIFT]
        if slot == 0:
            at = (i >> SHIFT, j >> SHIFT, k >> SHIFT)
            slot = used = _append_tile(volume, taps, low, scale, table, at, work, pool, tiles, used)
        start = _cell(slot, i, j, k)
        if strength[start] < FULL:
            strength[start] = FULL
            order[count] = queue[pushed] = start
            after[pushed] = head[FULL]
            head[FULL] = pushed
            count += 1
            pushed += 1
    bucket = FULL
    while bucket >= threshold:
        entry = head[bucket]
        if entry < 0:
            bucket -= 1
            continue
        head[bucket] = after[entry]
        cell = np.int64(queue[entry])
        if strength[cell] != bucket:
            continue
        if count + links > order.shape[0]:
            order = grown(order)
        if pushed + links > queue.shape[0]:
            queue, after = grown(queue), grown(after)
        if (used + links) * CELLS > pool.shape[0]:
            pool, tiles = _with_room(pool, tiles, used, links)
            strength = _as_long(strength, pool)
        here = np.int64(pool[cell])
        x, y, z = (cell >> (2 * SHIFT)) & INNER, (cell >> SHIFT) & INNER, cell & INNER
        for m in range(links):
            a, b, c = x + offsets[m, 0], y + offsets[m, 1], z + offsets[m, 2]
            to = cell + step[m]
            if (a | b | c) & OUTSIDE:
                at = _neighbour(tiles, int(cell) // CELLS, a, b, c)
                if _beyond(at, table.shape):
                    continue
                slot = table[at]
                if slot == 0:
                    slot = used = _append_tile(volume, taps, low, scale, table, at, work, pool, tiles, used)
                to = _cell(slot, a, b, c)
            there = np.int64(pool[to])
            if there >= SEEN or strength[to] >= bucket:
                continue
            link = min(bucket, int(homogeneity[abs(here - there)] * feature[here + there] + 0.5))
            if link < threshold or link <= strength[to]:
                continue
            if strength[to] == 0:
                order[count] = to
                count += 1
            strength[to] = link
            queue[pushed] = to
            after[pushed] = head[link]
            head[link] = pushed
            pushed += 1
    out = np.empty(count, np.uint8)
    for n in range(count):
        out[n] = strength[order[n]]
    return _flat(order[:count], tiles, volume.shape), out, used
