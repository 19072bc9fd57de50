"""Wires that were given to the wrong insertion: they fit another one's real wire, and were a poor simulator's."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.run.another import Others, Traces, _fits_another

DEPTHS = [20.0, 26.0, 32.0, 38.0]


def bent(depth_mm: float, towards_deg: float) -> np.ndarray:
    """A wire (n, 3) on an arc of 60 mm radius, to one side."""
    along, away = 60.0 * np.sin(arc := np.linspace(0.0, depth_mm, 80) / 60.0), 60.0 * (1.0 - np.cos(arc))
    side = np.radians(towards_deg)
    return np.stack([away * np.cos(side), away * np.sin(side), along], axis=1)


def traces(towards_deg: float) -> Traces:
    return {n: (depth, bent(depth, towards_deg)) for n, depth in enumerate(DEPTHS)}


@pytest.mark.parametrize(
    ("simulated_deg", "fits"),
    [
        (0.0, ""),
        (5.0, ""),
        (95.0, "'other'"),
        (45.0, ""),  # as near to one as to the other
        (200.0, ""),  # near to none
    ],
)
def test_wires_that_fit_another_insertion_are_told(simulated_deg: float, fits: str) -> None:
    own = traces(0.0)
    others = Others([("other", traces(90.0)), ("third", traces(140.0))], own)
    seen = [(depth, wire, bent(depth + 0.4, simulated_deg)) for depth, wire in own.values()]
    said = _fits_another(seen, others, 2.0)
    assert said.startswith(fits)
    assert bool(said) is bool(fits)


def test_one_frame_or_two_prove_nothing() -> None:
    own = traces(0.0)
    others = Others([("other", traces(90.0))], own)
    seen = [(depth, wire, bent(depth, 90.0)) for depth, wire in own.values()]
    assert _fits_another(seen[:3], others, 2.0)
    assert not _fits_another(seen[:2], others, 2.0)
    far = [*seen[:1], *[(depth, wire, wire) for depth, wire, _ in seen[1:]]]
    assert not _fits_another(far, others, 2.0)
