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
    for i, j, first, stop in runs:
        for k in range(first, stop):
            total = square = weight = 0.0
            for a in range(max(0, i - reach), min(ni, i + reach + 1)):
                wa = taps[a - i + reach]
                for b in range(max(0, j - reach), min(nj, j + reach + 1)):
                    wb = wa * taps[b - j + reach]
                    for c in range(max(0, k - reach), min(nk, k + reach + 1)):
                        if distance[a, b, c] < limit:
                            w = wb * taps[c - k + reach]
                            r = float(rough[a, b, c])
                            weight += w
                            total += w * r
                            square += w * r * r
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


@entry_point
def above(grey: NDArray[Any], allowed: NDArray[Any], runs: NDArray[Any], level: float) -> NDArray[Any]:
    """Flat indices of the voxels on ``runs`` that are allowed and brighter than ``level``."""
    _, nj, nk = grey.shape
    found = np.empty(4096, np.int64)
    count = 0
    for i, j, first, stop in runs:
        for k in range(first, stop):
            if grey[i, j, k] > level and allowed[i, j, k]:
                if count >= found.shape[0]:
                    found = grown(found)
                found[count] = (i * nj + j) * nk + k
                count += 1
    return found[:count]
