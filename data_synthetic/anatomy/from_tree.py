"""Swept tubes from a jagged tree: one smooth tube along the way of the wire, one for every branch near it."""

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from data_synthetic.anatomy.centrelines import Tree
from data_synthetic.anatomy.tubes import Anatomy, Tube, sweep
from data_synthetic.geometry import Array, Index, arc_lengths, at_arc

STEP_MM = 0.5
SMOOTHING_MM = 2.0
"""sd along the centreline: BraVa's points jump by a voxel of 0.3 to 0.6 mm every 1.85 mm."""
LEAST_SMOOTHING_MM, SMOOTH_MM = 0.5, 0.05
"""sd for a centreline that it moves by less than that, which is smooth as it is: 0.02 mm in a bend of 12 mm radius,
which SMOOTHING_MM cut by 0.17. It moves BraVa's by 0.18 to 0.31."""
WIDEST_MM = 3.0
"""The wire enters where the vessel's radius first falls below this: an aorta holds no guide wire in place."""
NARROWEST_MM = 0.7
"""The way ends where the radius falls below this: four wire radii."""
LONGEST_WAY_MM = 80.0
TIGHTEST = 0.85
"""Largest product of radius and curvature of a smoothed tube; above one it would fold into itself."""


def way_through(tree: Tree) -> Anatomy:
    """The way from the widest end of a tree along its widest long path as the first tube, then the branches near it."""
    path = widest_path(tree)
    smoothing_mm = _needed_mm(tree.points_mm[path])
    tube = smooth_tube("way", tree.points_mm[path], tree.radii_mm[path], smoothing_mm)
    middle = tube.points_mm.mean(axis=0)
    reach = np.max(np.linalg.norm(tube.points_mm - middle, axis=1)) + 15.0
    others = []
    for k, chain in enumerate(_chains(tree, path)):
        near = np.linalg.norm(tree.points_mm[chain] - middle, axis=1) < reach
        if near.any() and arc_lengths(tree.points_mm[chain])[-1] >= 2.0 * STEP_MM:
            others.append(_branch(f"branch{k}", tree, chain, path, tube, smoothing_mm))
    return Anatomy((tube, *others))


def smooth_tube(name: str, points: Array, radii: Array, smoothing_mm: float = SMOOTHING_MM) -> Tube:
    """Resample and smooth a jagged centreline, ends kept, as far as needed for a tube that does not fold."""
    places, arc, jagged = _in_steps(points)
    radius = np.maximum(gaussian_filter1d(np.interp(places, arc, radii), 3.0 / STEP_MM, mode="nearest"), 0.45)
    for sigma in smoothing_mm * 1.4 ** np.arange(6):
        curve = _smooth(jagged, sigma / STEP_MM)
        tube = sweep(name, curve, radius)
        bend = np.linalg.norm(np.gradient(tube.tangents, tube.step_mm, axis=0), axis=1)
        if np.max(bend * tube.radii_mm) < TIGHTEST:
            break
    return tube


def _in_steps(points: Array) -> tuple[Array, Array, Array]:
    """Arc lengths at equal steps, those of the points, and the curve at the steps."""
    arc = arc_lengths(points)
    places = np.linspace(0.0, arc[-1], max(4, round(arc[-1] / STEP_MM) + 1))
    return places, arc, at_arc(places, arc, points)


def _needed_mm(points: Array) -> float:
    """How much a file's centreline is smoothed: a smooth one hardly, so that the vessel lies where the file has it."""
    curve = _in_steps(points)[2]
    moved = np.linalg.norm(_smooth(curve, LEAST_SMOOTHING_MM / STEP_MM) - curve, axis=1)
    return LEAST_SMOOTHING_MM if moved.max() < SMOOTH_MM else SMOOTHING_MM


def _smooth(points: Array, sigma: float) -> Array:
    """Gaussian smoothing about the chord, so that both ends stay."""
    ramp = np.linspace(0.0, 1.0, len(points))[:, None]
    chord = points[0] + ramp * (points[-1] - points[0])
    # odd reflection about zero ends keeps the ends at zero
    away = points - chord
    padded = np.concatenate([-away[:0:-1], away, -away[-2::-1]])
    smoothed = gaussian_filter1d(padded, sigma, axis=0)
    return np.asarray(chord + smoothed[len(points) - 1 : 2 * len(points) - 1])


def widest_path(tree: Tree, longest_mm: float = LONGEST_WAY_MM) -> Index:
    """Indices of the best path from the widest end of a part: length (``longest_mm`` at most) + 5 times least radius.

    The eight largest parts are tried; raises ValueError where none has a usable path.
    """
    n, (a, b) = len(tree.points_mm), tree.edges.T
    length = np.linalg.norm(tree.points_mm[a] - tree.points_mm[b], axis=1)
    graph = coo_array((length, (a, b)), shape=(n, n))
    degree = np.bincount(tree.edges.ravel(), minlength=n)
    _, part = connected_components(graph, directed=False)
    best: tuple[float, Index] = (-np.inf, np.zeros(0, dtype=np.int64))
    parts, sizes = np.unique(part[tree.meant], return_counts=True)
    for component in parts[np.argsort(-sizes)[:8]]:
        ends = np.flatnonzero((part == component) & (degree == 1))
        if len(ends) < 2:
            continue
        root = ends[np.argmax(tree.radii_mm[ends])]
        before = dijkstra(graph, directed=False, indices=root, return_predecessors=True)[1]
        for end in ends:
            walk = [int(end)]
            while walk[-1] != root:
                walk.append(int(before[walk[-1]]))
            path = _usable(tree, np.array(walk[::-1], dtype=np.int64), longest_mm)
            if len(path) > 3:
                length_mm = float(arc_lengths(tree.points_mm[path])[-1])
                score = min(length_mm, longest_mm) + 5.0 * float(tree.radii_mm[path].min())
                best = max(best, (score, path), key=lambda found: found[0])
    if len(best[1]) < 4:
        raise ValueError(
            f"anatomy: got no path with radii from {WIDEST_MM} down to {NARROWEST_MM} mm; check the file's units (mm)"
        )
    return best[1]


def _usable(tree: Tree, path: Index, longest_mm: float) -> Index:
    """The part of a path that is neither too wide nor too narrow nor too long."""
    radius = tree.radii_mm[path]
    first = int(np.argmax(np.append(radius < WIDEST_MM, True)))
    narrow = np.flatnonzero(radius[first:] < NARROWEST_MM)
    last = first + (int(narrow[0]) if len(narrow) else len(path) - first)
    kept = path[first:last]
    return kept[arc_lengths(tree.points_mm[kept]) <= longest_mm] if len(kept) else kept


def _chains(tree: Tree, path: Index) -> list[Index]:
    """Unbranched runs of the rest of the tree; a run that meets the path starts with the path's point."""
    n = len(tree.points_mm)
    on_path = np.zeros(n, dtype=bool)
    on_path[path] = True
    rest = tree.edges[~(on_path[tree.edges[:, 0]] & on_path[tree.edges[:, 1]])]
    neighbours: list[list[int]] = [[] for _ in range(n)]
    for a, b in rest.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    knots = [i for i in range(n) if neighbours[i] and (on_path[i] or len(neighbours[i]) != 2)]
    knots.sort(key=lambda i: not on_path[i])
    stop, seen, runs = set(knots), set(), []
    for knot in knots:
        for after in neighbours[knot]:
            if (knot, after) in seen:
                continue
            run = [knot, after]
            while run[-1] not in stop:
                run.append(next(j for j in neighbours[run[-1]] if j != run[-2]))
            seen |= {(run[0], run[1]), (run[-1], run[-2])}
            runs.append(np.array(run, dtype=np.int64))
    return runs


def _branch(name: str, tree: Tree, chain: Index, path: Index, way: Tube, smoothing_mm: float) -> Tube:
    """A branch; where it leaves the path it starts on the smoothed way."""
    points = tree.points_mm[chain].copy()
    radii = tree.radii_mm[chain].copy()
    if chain[0] in path:
        nearest = int(np.argmin(np.linalg.norm(way.points_mm - points[0], axis=1)))
        points[0] = way.points_mm[nearest]
        radii[0] = min(radii[0], radii[1])
    return smooth_tube(name, points, radii, smoothing_mm)
