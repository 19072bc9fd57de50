"""Work along runs of voxels near the lumen: the lumen without wire is modelled, denoised and subtracted.

``runs`` : (n, 4) rows i, j, first k, stop k of a box.  ``corner`` : the scan's voxel that is (0, 0, 0) of the box.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, grown, kernel


class WallModel(NamedTuple):
    """Two grey levels joined by a blurred wall, on runs of the box ``distance`` (signed, mm).

    table : the wall's profile (odd length, ``step`` mm apart, middle at distance 0).
    """

    distance: NDArray[Any]
    runs: NDArray[Any]
    table: NDArray[Any]
    step: float


@entry_point
def runs_below(values: NDArray[Any], limit: float) -> NDArray[np.int64]:
    """The runs of voxels whose value is less than ``limit``."""
    found = np.empty((4096, 4), np.int64)
    count = 0
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            some = 0  # most rows hold none: to count them takes a quarter of the time
            for k in range(values.shape[2]):
                some += values[i, j, k] < limit
            if some == 0:
                continue
            before = False
            for k in range(values.shape[2]):
                now = values[i, j, k] < limit
                if now and not before:
                    if count >= found.shape[0]:
                        found = grown(found)
                    found[count, 0], found[count, 1], found[count, 2] = i, j, k
                    count += 1
                if now:
                    found[count - 1, 3] = k + 1
                before = now
    return found[:count]


@kernel
def _profile(table: NDArray[Any], step: float, distance: float) -> float:
    at = distance / step + table.shape[0] // 2
    last = table.shape[0] - 1
    if at <= 0.0:
        return float(table[0])
    if at >= last:
        return float(table[last])
    n = int(at)
    return float(table[n] + (at - n) * (table[n + 1] - table[n]))


@entry_point
def modelled(wall: WallModel, out: NDArray[Any]) -> None:
    """The modelled grey on the runs of ``out``."""
    distance, runs, table, step = wall
    for i, j, first, stop in runs:
        for k in range(first, stop):
            out[i, j, k] = _profile(table, step, distance[i, j, k])


@entry_point
def denoised(
    rough: NDArray[Any], wall: WallModel, taps: NDArray[Any], limit: float, variance: float, out: NDArray[Any]
) -> None:
    """model + smoothed residual (``rough``) on the runs of ``out``; where the residual varies by more than twice
    ``variance`` (structure that the model lacks, such as bone) the scan itself is kept.

    The mean is taken over voxels with distance < ``limit``, where the residual is known.
    """
    distance, runs, table, step = wall
    ni, nj, nk = rough.shape
    reach = taps.shape[0] // 2
    weights, totals, squares = np.empty(nk), np.empty(nk), np.empty(nk)
    for i, j, first, stop in runs:
        # the rows around are summed into one, which is then smoothed: 25 + 5 steps a voxel instead of 125
        low, high = max(0, first - reach), min(nk, stop + reach)
        weights[low:high], totals[low:high], squares[low:high] = 0.0, 0.0, 0.0
        for a in range(max(0, i - reach), min(ni, i + reach + 1)):
            for b in range(max(0, j - reach), min(nj, j + reach + 1)):
                tap = taps[a - i + reach] * taps[b - j + reach]
                for c in range(low, high):
                    w = tap if distance[a, b, c] < limit else 0.0
                    r = float(rough[a, b, c])
                    weights[c] += w
                    totals[c] += w * r
                    squares[c] += w * r * r
        for k in range(first, stop):
            total = square = weight = 0.0
            for c in range(max(low, k - reach), min(high, k + reach + 1)):
                w = taps[c - k + reach]
                weight += w * weights[c]
                total += w * totals[c]
                square += w * squares[c]
            mean = total / weight
            calm = square / weight - mean * mean < 2.0 * variance
            rest = mean if calm else float(rough[i, j, k])
            out[i, j, k] = _profile(table, step, distance[i, j, k]) + rest


@entry_point
def subtract(
    frame: NDArray[Any], background: NDArray[Any], corner: NDArray[Any], runs: NDArray[Any], out: NDArray[Any]
) -> None:
    """frame - background on ``runs`` of the box ``out``; ``background`` is on the box."""
    for i, j, first, stop in runs:
        a, b, c = i + corner[0], j + corner[1], corner[2]
        for k in range(first, stop):
            out[i, j, k] = frame[a, b, k + c] - background[i, j, k]
