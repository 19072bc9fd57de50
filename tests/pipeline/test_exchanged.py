"""Wires that were given to the wrong insertions fit another one's real wires; they were a poor simulator's."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.compare.config import CompareConfig
from pipeline.run.another import Others, Traces
from pipeline.run.exchanged import Fit, fit_of, in_a_ring
from tests.later import later

SCORED = CompareConfig(skip_mm=2.0)
DEPTHS = [20.0, 26.0, 32.0, 38.0]


def bent(depth_mm: float, towards_deg: float) -> np.ndarray:
    """A wire (n, 3) on an arc of 60 mm radius, to one side."""
    along, away = 60.0 * np.sin(arc := np.linspace(0.0, depth_mm, 80) / 60.0), 60.0 * (1.0 - np.cos(arc))
    side = np.radians(towards_deg)
    return np.stack([away * np.cos(side), away * np.sin(side), along], axis=1)


def traces(towards_deg: float) -> Traces:
    return {n: (depth, bent(depth, towards_deg)) for n, depth in enumerate(DEPTHS)}


def fit(simulated_deg: float, others: dict[str, float], frames: int = 4) -> Fit | None:
    """Of wires to a side in an insertion to 0 degrees, beside others."""
    own = traces(0.0)
    seen = [(depth, wire, bent(depth + 0.4, simulated_deg)) for depth, wire in own.values()]
    return fit_of(seen[:frames], Others([(name, traces(angle)) for name, angle in others.items()], own), SCORED)


@pytest.mark.parametrize(
    ("simulated_deg", "fits"),
    [
        (0.0, ""),
        (5.0, ""),
        (95.0, "other"),
        (45.0, ""),  # as near to one as to the other
        (235.0, ""),  # near to none
    ],
)
def test_wires_that_fit_another_insertion_are_found(simulated_deg: float, fits: str) -> None:
    found = fit(simulated_deg, {"near": 110.0, "other": 90.0, "third": 140.0})
    assert (found.insertion if found else "") == fits


def test_two_frames_prove_nothing_and_cases_of_one_insertion_are_one() -> None:
    assert fit(90.0, {"other": 90.0}, frames=3)
    assert not fit(90.0, {"other": 90.0}, frames=2)
    own = traces(0.0)
    seen = [(depth, wire, bent(depth, 90.0)) for depth, wire in own.values()]
    several = Others([("other", traces(90.0)), ("other", traces(150.0)), ("other", traces(91.0))], own)
    assert not fit_of(seen[:1], several, SCORED), "one frame, held against three cases"
    assert fit_of(seen, several, SCORED), "one of its cases lies elsewhere"


def test_of_many_insertions_the_nearest_two_dozen_are_guesses() -> None:
    """Of all 500 cases in one phantom it would take ten minutes."""
    own = traces(0.0)
    for count in (3, 30):
        others = Others([(f"{n}", traces(float(n))) for n in range(count)], own)
        assert len(others.nearest(*own[0])) == min(count, 24)


def ring(fits: dict[str, str]) -> set[str]:
    """The cases, each an insertion of its own, that stand in a ring."""
    cases = {*fits, *fits.values()}
    return set(in_a_ring({case: Fit(other, 0.1, 0.3) for case, other in fits.items()}, {case: case for case in cases}))


def test_exchanged_wires_go_round_in_a_ring() -> None:
    assert ring({"a": "b", "b": "a", "c": "a"}) == {"a", "b"}, "nobody's wires fit c"
    assert ring({"a": "b", "b": "c", "c": "d", "d": "a"}) == {"a", "b", "c", "d"}
    assert ring({"a": "b", "b": "c"}) == set(), "the wires of c are its own"


@pytest.mark.quick(2)
@pytest.mark.parametrize("seed", [*range(4), *later(*range(4, 20))])
def test_one_wire_for_all_is_a_poor_simulator_and_no_exchange(seed: int) -> None:
    """A simulator that knows no roll fits the insertion that lies as it says: in 67 % of ten somebody was accused."""
    rng = np.random.default_rng(seed)
    angles, said = {f"i{n}": float(rng.uniform(0, 360)) for n in range(10)}, float(rng.uniform(0, 360))
    fits = {}
    for name, angle in angles.items():
        own = traces(angle)
        seen = [(depth, wire, bent(depth, said)) for depth, wire in own.values()]
        others = Others([(other, traces(way)) for other, way in angles.items() if other != name], own)
        if (found := fit_of(seen, others, SCORED)) is not None:
            fits[name] = found
    assert fits, "most lie nearer to another one"
    assert not in_a_ring(fits, {name: name for name in angles})
