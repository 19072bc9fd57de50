"""A lumen that ends at a dark band though its vessel goes on is said; ends that are ends, and neighbours, are not."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Volume
from pipeline.segment import segment
from tests.later import later
from tests.pipeline import phantoms

H, SHAPE, ORIGIN = 0.4, (48, 48, 80), np.array([-9.4, -9.4, 0.0])
X, Y, Z = (np.stack(np.indices(SHAPE)) * H + ORIGIN[:, None, None, None]).astype(float)
ALONG = np.arange(-1.0, 33.0, 0.05)
MIDDLE = 16.0


def curved(seed: int) -> np.ndarray:
    """An axis that passes the middle of the scan, bent by up to 0.06 per mm."""
    size, phase = np.random.default_rng(seed).uniform([1, 1, 0, 0], [2, 2, 6, 6]).reshape(2, 2)
    way = size * np.sin(ALONG[:, None] / [6.0, 7.0] + phase) - size * np.sin(MIDDLE / np.array([6.0, 7.0]) + phase)
    return np.column_stack([way, ALONG])


def tube(axis: np.ndarray, radius: float) -> np.ndarray:
    away = phantoms.distance_to(axis, SHAPE, H, ORIGIN, radius + 2.0)
    return np.where(np.isfinite(away), away - radius, 9.0)


def straight(radius: float, x: float = 0.0) -> np.ndarray:
    return np.hypot(X - x, Y) - radius


def ball(radius: float, z: float, x: float = 0.0) -> np.ndarray:
    return np.sqrt((X - x) ** 2 + Y**2 + (Z - z) ** 2) - radius


def band(axis: np.ndarray, width: float, degrees: float, left: float = 0.0) -> np.ndarray:
    """Share of the contrast left by a band across the axis in the middle of the scan."""
    k = int(np.argmin(np.abs(axis[:, 2] - MIDDLE)))
    way = axis[k + 1] - axis[k]
    aside = np.cross(way, [0.0, 1.0, 0.0])
    normal = sum(f(np.radians(degrees)) * v / np.linalg.norm(v) for f, v in ((np.cos, way), (np.sin, aside)))
    away = (X - axis[k, 0]) * normal[0] + (Y - axis[k, 1]) * normal[1] + (Z - axis[k, 2]) * normal[2]
    return np.where(np.abs(away) < width / 2, left, 1.0)


def scan(distance: np.ndarray, share: np.ndarray | float = 1.0, noise: float = 100.0, seed: int = 0) -> Volume:
    clean = 100.0 + 1000.0 * share * phantoms.partial_volume(distance, H)
    return Volume(phantoms.scan(clean, 0.8, noise, seed), [H] * 3, ORIGIN)


def said(volume: Volume, axis: np.ndarray | None = None, wire: float | None = None) -> list[str]:
    at = [0.0, 0.0, 3.0] if axis is None else axis[80]
    return [text for text in segment(volume, [at], wire_radius_mm=wire).warnings if "lumen ends" in text]


def places(texts: list[str]) -> np.ndarray:
    return np.array([text.split("scan at ")[1].split(" mm")[0].split(", ") for text in texts], float)


@pytest.mark.quick(2)
@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2))])
@pytest.mark.parametrize(
    ("radius", "width", "degrees", "noise"),
    [(1.6, 2.4, 0, 100), (1.2, 2.4, 30, 50), (2.4, 2.4, 45, 100), (2.4, 5.0, 0, 200),
     *later((1.6, 2.4, 30, 100), (1.6, 2.4, 45, 100), (1.6, 3.5, 0, 200), (1.6, 3.5, 30, 100), (1.6, 5.0, 0, 100))],
)  # fmt: skip
def test_a_dark_band_across_a_vessel_is_said_once_where_it_is(radius, width, degrees, noise, seed):
    axis = curved(seed)
    texts = said(scan(tube(axis, radius), band(axis, width, degrees), noise, seed), axis)
    assert len(texts) == 1
    off = places(texts)[0] - [0.0, 0.0, MIDDLE]
    assert np.linalg.norm(off) < width + 0.5 * radius
    assert off[2] < 0  # the near side of the band
    ahead = float(texts[0].split("goes on ")[1].split(" mm")[0])
    assert width - 1.0 < ahead < width / np.cos(np.radians(degrees)) + 1.0


def test_each_of_two_vessels_of_a_fork_that_a_band_crosses_is_said():
    one, other = (np.column_stack([s * np.maximum(ALONG - 4.0, 0.0) * 0.35, 0 * ALONG, ALONG]) for s in (1, -1))
    fork = np.minimum(tube(one, 1.4), tube(other, 1.4))
    found = places(said(scan(fork, np.where(np.abs(Z - MIDDLE) < 1.2, 0.0, 1.0))))
    assert len(found) == 2
    np.testing.assert_allclose(np.sort(found[:, 0]), [-3.9, 3.9], rtol=0.0, atol=1.0)


TAPER = 1.6 * np.clip((MIDDLE - Z) / 10.0, -0.5, 1.0)
BEYOND = np.maximum(straight(1.6), MIDDLE + 2.0 - Z)
BLUNT = np.maximum(straight(1.6), Z - MIDDLE)
ACROSS = np.hypot(X, Z - MIDDLE - 4.5) - 1.6
SILENT = {
    "a tube through the scan": straight(1.6),
    "a tube that leaves at the flank": np.abs(X - 0.45 * Z) * 0.91 + 0 * Y - 1.6 + np.maximum(np.abs(Y) - 1.6, 0),
    "a taper": straight(0.0) - TAPER,
    "a taper with a vessel ahead": np.minimum(straight(0.0) - TAPER, BEYOND),
    "a blind end": BLUNT,
    "a blind sac": np.minimum(BLUNT, ball(3.5, MIDDLE)),
    "a blind sac with a vessel across": np.minimum(np.minimum(BLUNT, ball(3.0, MIDDLE - 2.0)), ACROSS),
    "a blind end with a vessel across": np.minimum(BLUNT, ACROSS),
    "a blind end with a vessel beside": np.minimum(BLUNT, straight(1.6, 4.4)),
    "a blind end with one that begins beside": np.minimum(BLUNT, np.maximum(straight(1.6, 4.4), MIDDLE - Z)),
    "a blind end with a far thinner vessel ahead": np.minimum(
        np.maximum(straight(2.4), Z - MIDDLE), np.maximum(straight(0.8), MIDDLE + 2.0 - Z)
    ),
    "a blind end with something wide ahead": np.minimum(BLUNT, MIDDLE + 2.0 - Z),
    "one that goes on too far ahead": np.minimum(BLUNT, np.maximum(straight(1.6), MIDDLE + 8.0 - Z)),
    "two tubes side by side": np.minimum(straight(1.6), straight(1.6, 4.6)),
}


@pytest.mark.quick(2)
@pytest.mark.parametrize("seed", [0, *later(1)])
@pytest.mark.parametrize("name", SILENT)
def test_what_ends_or_goes_on_beside_is_not_said(name, seed):
    assert said(scan(SILENT[name], seed=seed)) == []


@pytest.mark.quick(2)
@pytest.mark.parametrize(("level", "expected"), [(0.45, 0), (0.8, 1), (1.0, 1), (1.6, 0)])
def test_what_lies_ahead_is_as_bright(level, expected):
    both = np.minimum(BLUNT, BEYOND)
    assert len(said(scan(both, np.where(Z > MIDDLE + 1.0, level, 1.0)))) == expected


@pytest.mark.parametrize("across", [False, True])
def test_a_wire_in_the_scan_is_no_vessel(across):
    clean = 100.0 + 1000.0 * phantoms.partial_volume(BLUNT if across else straight(1.6), H)
    wire = np.column_stack([0.3 + 0 * ALONG, 0.2 + 0 * ALONG, ALONG])[20 : None if across else 400]
    phantoms.add_wire(clean, wire, 0.2, 4000.0, H, ORIGIN)
    assert said(Volume(phantoms.scan(clean, 0.8, 100.0, 0), [H] * 3, ORIGIN), wire=0.2) == []


def test_a_band_beyond_a_wire_is_said_too():
    axis = curved(0)
    clean = 100.0 + 1000.0 * band(axis, 2.4, 0.0) * phantoms.partial_volume(tube(axis, 1.6), H)
    phantoms.add_wire(clean, axis[20:300] + [0.3, 0.3, 0.0], 0.2, 4000.0, H, ORIGIN)
    assert len(said(Volume(phantoms.scan(clean, 0.8, 100.0, 0), [H] * 3, ORIGIN), axis, wire=0.2)) == 1
