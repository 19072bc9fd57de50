"""The circle of Willis: sizes as published, variants as asked for."""

from __future__ import annotations

import numpy as np
import pytest

from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.anatomy.willis import DIAMETERS_MM, WillisPlan, circle_of_willis

SEEDS = 60


def build(seed: int = 0, **plan: object) -> Anatomy:
    return circle_of_willis(np.random.default_rng(seed), WillisPlan(**plan))  # type: ignore[arg-type]


@pytest.mark.quick(1)
@pytest.mark.parametrize(("spread", "share"), [(0.5, 0.48), (1.0, 0.72)])
def test_sizes_are_drawn_from_the_published_means_and_spreads(spread: float, share: float) -> None:
    """A normal draw cut at one sd keeps 0.48 of the sd where half of it is drawn, 0.72 where all of it is."""
    trees = [build(s, spread=spread) for s in range(SEEDS)]
    for name in ("M1", "A1", "A2", "PCoA", "P1", "P2", "vertebral"):
        mean, sd = DIAMETERS_MM[name]
        drawn = np.array([2.0 * t.tube(f"right.{name}").radii_mm[-1] for t in trees])
        assert np.all(np.abs(drawn - mean) <= sd + 1e-9), name
        assert drawn.mean() == pytest.approx(mean, abs=3.5 * share * sd / np.sqrt(SEEDS)), name
        assert drawn.std() == pytest.approx(share * sd, rel=0.3), name
    drawn = np.array([2.0 * t.tube("right.ICA").radii_mm[-1] for t in trees])
    assert drawn.mean() == pytest.approx(DIAMETERS_MM["terminus"][0], rel=0.03)


def test_both_siphons_turn_and_no_two_seeds_share_one() -> None:
    tree, other = build(0), build(1)
    for side in ("right", "left"):
        carotid = tree.tube(f"{side}.ICA")
        assert turning_deg(carotid) > 180
        middles = [t.tube(f"{side}.ICA").points_mm[120] for t in (tree, other)]
        assert np.linalg.norm(middles[0] - middles[1]) > 0.1


def turning_deg(tube: Tube) -> float:
    cosines = np.sum(tube.tangents[1:] * tube.tangents[:-1], axis=1)
    return float(np.degrees(np.arccos(np.clip(cosines, -1, 1)).sum()))


def test_incomplete_circles_lack_what_they_lack() -> None:
    missing = ("right.PCoA", "left.A1", "left.P1", "ACoA")
    names = {t.name for t in build(missing=missing).tubes}
    assert {t.name for t in build().tubes} - names == set(missing)


@pytest.mark.parametrize("place", ["terminus", "acoa", "sidewall"])
def test_aneurysms_are_sacs_that_open_into_their_vessel(place: str) -> None:
    tree, plain = build(aneurysm=place, sac_mm=3.0), build(aneurysm="none")
    centre = tree.tube("sac").points_mm[0]
    assert tree.distance([centre])[0] < -2.5
    assert plain.distance([centre])[0] > -1.0
    neck = tree.tube("neck").points_mm
    assert np.all(tree.distance(neck) < -0.4), "a way in"


def test_a_tortuous_vertebral_winds() -> None:
    plain, winding = (build(tortuous_vertebrals=t).tube("right.vertebral") for t in (False, True))
    assert turning_deg(winding) > turning_deg(plain) + 60
