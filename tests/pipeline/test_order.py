"""Polylines of projections: points in no order are found, and what a wire or a hand may do is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.arrays.order import disordered

Array = NDArray[np.float64]
TREMBLE_PX = 4.0


def drawn(length_px: float = 120.0, apart_px: float = 1.0) -> Array:
    """A wire that bends by 60 degrees, and its tip down again."""
    s = np.arange(0.0, length_px, apart_px)
    angle = np.where(s < 0.6 * length_px, s, 1.2 * length_px - s) * np.pi / 3.0 / (0.6 * length_px)
    steps = np.column_stack([np.cos(angle), -np.sin(angle)]) * apart_px
    return np.asarray(100.0 + np.cumsum(steps, axis=0))


def hairpin(apart_px: float) -> Array:
    """Seen edge on: out by 80 pixels and back over itself."""
    x = np.arange(0.0, 160.0, apart_px)
    return np.column_stack([80.0 - np.abs(80.0 - x), np.zeros(len(x))])


def loop(apart_px: float) -> Array:
    """Crosses itself, and was not seen for 20 pixels of the loop."""
    a = np.arange(0.0, 2.0 * np.pi, apart_px / 20.0)
    ring = np.column_stack([20.0 * np.sin(a), 20.0 - 20.0 * np.cos(a)])
    x = np.arange(-60.0, 0.0, apart_px)
    line = np.column_stack([x, np.zeros(len(x))])
    whole = np.concatenate([line, ring, line + [60.0, 0.0]])
    return np.asarray(whole[(np.arange(len(whole)) * apart_px < 90) | (np.arange(len(whole)) * apart_px > 110)])


def along_the_ray(apart_px: float) -> Array:
    """Stands still where it runs along the ray, and comes out again on the other side."""
    line = drawn(apart_px=apart_px)
    half = len(line) // 2
    return np.concatenate([line[:half], np.repeat(line[half : half + 1], 40, axis=0), line[half:]])


@pytest.mark.parametrize(
    "spoil",
    [
        lambda p: p[np.random.default_rng(0).permutation(len(p))],
        lambda p: p[np.r_[0, 1 + np.random.default_rng(0).permutation(len(p) - 2), len(p) - 1]],
        lambda p: np.vstack([p[:30], p[70:110], p[30:70], p[110:]]),
        lambda p: np.vstack([p[:40], p[40:90][::-1], p[90:]]),
        lambda p: np.vstack([p[:40], p[40:41] + 300.0, p[41:]]),
        lambda p: np.vstack([p[:-8], p[-8:-7] + [400.0, -200.0], p[-8:]]),
        lambda p: np.unique(np.rint(p * [0.15, 1.5]), axis=0),
    ],
    ids=[
        "in no order",
        "inner points",
        "two pieces exchanged",
        "a piece turned round",
        "one off",
        "near the tip",
        "columns, of a steep wire",
    ],
)
@pytest.mark.parametrize("jitter_px", [0.0, 1.0])
def test_points_in_no_order_are_found(spoil: Callable[[Array], Array], jitter_px: float) -> None:
    """All were scored, ok, without a word."""
    points = drawn()
    points = points + np.random.default_rng(1).uniform(-jitter_px, jitter_px, points.shape)
    found = disordered(spoil(points), TREMBLE_PX)
    assert found is not None
    assert found[1] == found[0] + 1


@pytest.mark.parametrize("wire", [drawn, hairpin, loop, along_the_ray])
@pytest.mark.parametrize("apart_px", [0.5, 1.0, 3.0, 9.0])
def test_what_a_wire_and_a_hand_may_do_is_in_order(wire: Callable[..., Array], apart_px: float) -> None:
    points, rng = wire(apart_px=apart_px), np.random.default_rng(2)
    for hand in (points, np.rint(points), *(points + rng.uniform(-1.0, 1.0, points.shape) for _ in range(5))):
        assert disordered(hand, TREMBLE_PX) is None
    clicked = points[np.sort(rng.choice(len(points), len(points) // 3, replace=False))]
    assert disordered(clicked, TREMBLE_PX) is None


def test_one_far_point_is_named() -> None:
    points = drawn()
    points[50] += [0.0, 300.0]
    assert disordered(points, TREMBLE_PX) in ((49, 50), (50, 51))


@pytest.mark.parametrize("count", [2, 3, 4])
def test_few_points_have_no_order_to_lose(count: int) -> None:
    assert disordered(np.array([[0.0, 0.0], [60.0, 0.0], [0.0, 5.0], [60.0, 9.0]])[:count], TREMBLE_PX) is None
