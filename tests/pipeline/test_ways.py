"""The cheapest ways through a lumen against scikit-image's, which searches the whole box."""

from __future__ import annotations

import numpy as np
import pytest
from skimage.graph import MCP_Geometric

from pipeline.compare.ways import cheapest_ways, nearest


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("seed", range(4))
def test_they_cost_what_those_of_another_library_cost(seed: int, order: str) -> None:
    rng = np.random.default_rng(seed)
    shape, spacing = tuple(rng.integers(1, 14, 3)), rng.uniform(0.2, 2.0, 3)
    # most is wall, up to the sides of the box: some of the rest is cut off
    cost = np.asarray(np.where(rng.random(shape) < 0.85, np.inf, rng.uniform(0.1, 3.0, shape)), order=order)
    cost[tuple(np.array(shape) // 2)] = 1.0
    ways = cheapest_ways(cost, spacing, np.array(shape) // 2)
    assert ways is not None
    np.testing.assert_array_equal(ways.voxels, np.argwhere(cost < np.inf))
    wanted, _ = MCP_Geometric(cost, sampling=tuple(spacing)).find_costs([tuple(np.array(shape) // 2)])
    np.testing.assert_allclose(ways.total, wanted[tuple(ways.voxels.T)], rtol=1e-12, atol=0.0)
    assert np.isinf(ways.total).any()
    for number, total in enumerate(ways.total):
        way = ways.to(number)
        assert (way is None) == np.isinf(total)
        if way is None:
            continue
        assert np.abs(np.diff(way, axis=0)).max(initial=0) <= 1
        length = np.linalg.norm(np.diff(way, axis=0) * spacing, axis=1)
        costs = cost[tuple(way.T)]
        assert np.sum(length * 0.5 * (costs[1:] + costs[:-1])) == pytest.approx(total, rel=1e-12)


def test_where_all_is_wall_there_is_none() -> None:
    assert cheapest_ways(np.full((3, 4, 5), np.inf), np.ones(3), np.zeros(3)) is None


def test_a_way_begins_at_the_voxel_that_is_nearest() -> None:
    cost = np.full((5, 5, 5), np.inf)
    cost[2, 2, :] = 1.0
    ways = cheapest_ways(cost, np.ones(3), np.array([0.0, 2.2, 0.4]))
    assert ways is not None
    way = ways.to(nearest(ways.voxels, np.array([4.0, 4.0, 9.0])))
    np.testing.assert_array_equal(way, [[2, 2, k] for k in range(5)])
