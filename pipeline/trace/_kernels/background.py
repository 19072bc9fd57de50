"""The lumen without wire: two grey levels joined by a blurred wall, and a reference scan denoised against it."""

from __future__ import annotations

from typing import Any

from numba import njit
from numpy.typing import NDArray


@njit(cache=True, inline="always")
def _modelled(distance: float, table: NDArray[Any], step: float) -> float:
    """The wall's profile ``table`` (odd length, ``step`` mm apart, middle at distance 0) at a signed distance."""
    at = distance / step + table.shape[0] // 2
    last = table.shape[0] - 1
    if at <= 0.0:
        return float(table[0])
    if at >= last:
        return float(table[last])
    n = int(at)
    return float(table[n] + (at - n) * (table[n + 1] - table[n]))


@njit(cache=True)
def model(
    distance: NDArray[Any], runs: NDArray[Any], table: NDArray[Any], step: float, out: NDArray[Any]
) -> None:
    """The modelled grey on ``runs`` (rows i, j, first k, stop k) of ``out``."""
    for n in range(runs.shape[0]):
        i, j = runs[n, 0], runs[n, 1]
        for k in range(runs[n, 2], runs[n, 3]):
            out[i, j, k] = _modelled(distance[i, j, k], table, step)


@njit(cache=True)
def residual(
    scan: NDArray[Any],
    corner: NDArray[Any],
    distance: NDArray[Any],
    runs: NDArray[Any],
    table: NDArray[Any],
    step: float,
    out: NDArray[Any],
) -> None:
    """scan - model on ``runs`` of ``out`` (int16 or float32), whose voxel (0, 0, 0) is ``corner`` of the scan."""
    for n in range(runs.shape[0]):
        i, j = runs[n, 0], runs[n, 1]
        a, b, c = i + corner[0], j + corner[1], corner[2]
        for k in range(runs[n, 2], runs[n, 3]):
            out[i, j, k] = scan[a, b, k + c] - _modelled(distance[i, j, k], table, step)


@njit(cache=True)
def denoised(
    rough: NDArray[Any],
    distance: NDArray[Any],
    runs: NDArray[Any],
    table: NDArray[Any],
    step: float,
    taps: NDArray[Any],
    limit: float,
    variance: float,
    out: NDArray[Any],
) -> None:
    """model + smoothed residual on ``runs`` of ``out``; where the residual varies by more than twice ``variance``
    (structure that the model lacks, such as bone) the scan itself is kept.

    The mean is taken over voxels with distance < ``limit``, where the residual is known.
    """
    ni, nj, nk = rough.shape
    reach = taps.shape[0] // 2
    for n in range(runs.shape[0]):
        i, j = runs[n, 0], runs[n, 1]
        for k in range(runs[n, 2], runs[n, 3]):
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
            out[i, j, k] = _modelled(distance[i, j, k], table, step) + (
                mean if calm else float(rough[i, j, k])
            )
