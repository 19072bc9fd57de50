"""Cells of a VTK file that are one curve: many programs write a line as one cell a segment, or in pieces."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from pipeline.load.geometry import refused
from pipeline.model import Array


def one_chain(path: Path, points: Array, cells: Sequence[NDArray[np.int64]]) -> Array:
    """Points (n, 3) of the one curve that lines make up, in their order, in the direction of the first cell.

    points : (m, 3).     cells : the points of each line, by number. Cells are joined where they share a point, or two
    that lie in one place. Raises LoadError where they leave more than one curve, a branch or a ring.
    """
    if len(cells) == 1:
        return points[cells[0]]
    places, of_point = np.unique(points, axis=0, return_inverse=True)
    lines = [line for cell in cells if len(line := of_point.ravel()[cell]) > 1]
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *(np.stack([c[:-1], c[1:]], axis=1) for c in lines)])
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    used, neighbours = np.unique(pairs, return_counts=True)
    ends = used[neighbours == 1]
    if len(ends) != 2 or neighbours.max() > 2:
        got = f"{len(cells)} lines with {len(ends)} free ends in all"
        raise refused(path, got, "one curve, in one line or in pieces that meet end to end", "export the wire alone")
    steps = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(places), len(places))).tocsr()
    order = breadth_first_order(steps, ends[0], directed=False, return_predecessors=False)
    if len(order) != len(used):
        raise refused(path, f"{len(cells)} lines, a ring beside a curve", "one curve", "export the wire alone")
    place = np.zeros(len(places), np.int64)
    place[order] = np.arange(len(order))
    forwards = place[lines[0][0]] < place[lines[0][1]]
    return np.asarray(places[order if forwards else order[::-1]])
