"""What is read off a grid's values."""

import numpy as np
import pytest

from pipeline.arrays.grids import spelt, spread


@pytest.mark.parametrize("noise", [0.6, 0.9, 1.28, 1.92, 2.56, 4.0])
def test_noise_of_whole_greys_is_told_as_it_is(noise: float) -> None:
    """Noise of 1.92 greys was told as 1.48, of 0.9 as 1.48, and of 0.6 as none: all that was between two was one."""
    exact = np.random.default_rng(1).normal(0.37, noise, 20000)
    whole = np.hypot(noise, 1.0 / np.sqrt(12.0))
    assert spread(np.rint(exact)) == pytest.approx(whole, rel=0.15)
    assert spread(exact) == pytest.approx(noise, rel=0.02)


def test_nothing_is_no_noise() -> None:
    """Greys that are all the same."""
    assert spread(np.full(100, 7)) == 0.0


def test_a_place_is_spelt_without_a_minus_before_a_zero() -> None:
    assert spelt(np.array([-0.04, 12.25, -3.0])) == "0.0, 12.2, -3.0"
    assert spelt(np.array([-0.04, 0.004, 1.0]), 2) == "-0.04, 0.00, 1.00"
