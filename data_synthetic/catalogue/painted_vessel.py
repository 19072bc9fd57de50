"""A vessel painted into a scan that shows none, where its voxels are most alike."""

from itertools import product

import numpy as np
from scipy.ndimage import gaussian_filter

from data_synthetic.anatomy.shapes import bend
from data_synthetic.anatomy.tubes import Anatomy, Tube, sweep
from data_synthetic.geometry import Array, ScanGrid, Volume
from data_synthetic.scanner.coverage import lumen_coverage

VOXELS_ACROSS, NARROWEST_MM, WIDEST_MM = 6.0, 3.0, 8.0
"""Voxels, at the scan's coarsest spacing, across the vessel; its least and largest diameter."""
SMALLEST_SCALE = 0.6
"""Least scale of the bend, which is 54 mm long at 1: a shorter one has no room for the tip of a wire, 8 mm long."""
MARGIN_MM = 3.0
"""Between the vessel and the scan's edge; voxels up to here decide where it is painted."""
PLACES = np.linspace(0.0, 1.0, 5)
"""Shares of the room along each axis at which the vessel is tried."""
BLUR_VOXELS = 0.8
"""sd of the point spread with which it is painted."""
LEAST_CONTRAST = 12.0
"""Over the scan's noise."""


def paint_vessel(values: Volume, grid: ScanGrid) -> tuple[Volume, Tube]:
    """The scan with a vessel: tissue becomes 0 and the vessel 1; and the vessel itself.

    Raises ValueError where there is no room for one.
    """
    tissue, contrast = _greys(values)
    values = (values - np.float32(tissue)) * np.float32(1.0 / contrast)
    vessel = _placed(values, grid)
    share = gaussian_filter(lumen_coverage(Anatomy((vessel,)), grid), BLUR_VOXELS * grid.voxel_mm / grid.spacing_mm)
    return values * (1.0 - share) + share, vessel


def _greys(values: Volume) -> tuple[float, float]:
    """The grey of tissue, from the scan's middle, where there is no air; and the painted vessel's contrast to it: that
    of the brightest voxels, or LEAST_CONTRAST noises if that is more.
    """
    tissue = float(np.median(values[tuple(slice(n // 4, -(n // 4)) for n in values.shape)]))
    noise = 1.48 * float(np.median(np.abs(np.diff(values, axis=0)))) / np.sqrt(2.0)
    brightest = float(np.percentile(values, 99.0))
    return tissue, max(brightest - tissue, LEAST_CONTRAST * noise, 1e-3 * float(np.ptp(values)))


def _placed(values: Volume, grid: ScanGrid) -> Tube:
    """A bend along the scan's longest axis, where the voxels in and around it differ least from tissue."""
    diameter = float(np.clip(VOXELS_ACROSS * grid.spacing_mm.max(), NARROWEST_MM, WIDEST_MM))
    extent, shape = (np.array(grid.shape) - 1) * grid.spacing_mm, bend(50.0, 25.0).tubes[0].points_mm
    order = np.argsort(extent)  # the bend is widest along its z, then along x; y is across it
    turned = np.zeros(shape.shape)
    turned[:, order] = shape[:, [1, 0, 2]]
    room = extent - diameter - 2.0 * MARGIN_MM
    scale = min(1.0, float(np.min(room / np.maximum(np.ptp(turned, axis=0), 1e-9))))
    if scale < SMALLEST_SCALE or diameter < 2.0 * grid.spacing_mm.max():
        found = f"{' x '.join(f'{mm:.0f}' for mm in extent)} mm in voxels of up to {grid.spacing_mm.max():.2g} mm"
        allowed = f"{SMALLEST_SCALE * 54:.0f} mm or more along one axis, voxels of {WIDEST_MM / 2:g} mm or less"
        raise ValueError(f"it shows no vessel, and has no room for one: got {found}; allowed: {allowed}")
    way = scale * (turned - turned.min(axis=0)) + 0.5 * diameter + MARGIN_MM
    free = extent - way.max(axis=0) - 0.5 * diameter - MARGIN_MM
    places = [way + np.array(share) * free for share in product(PLACES, repeat=3)]
    best = min(places, key=lambda place: _unlike(values, place / grid.spacing_mm, 0.5 * diameter + MARGIN_MM, grid))
    return sweep("painted", grid.to_mm(best / grid.spacing_mm)[:: len(best) // 20], 0.5 * diameter)


def _unlike(values: Volume, index: Array, reach_mm: float, grid: ScanGrid) -> float:
    """How much voxels about a way differ from tissue, in contrasts of the vessel: the mean, none more than 1."""
    steps = reach_mm / grid.spacing_mm * [(i, j, k) for i, j, k in product((-1.0, 0.0, 1.0), repeat=3)]
    around = np.rint(index[::4, None] + steps).astype(int).reshape(-1, 3)
    inside = np.clip(around, 0, np.array(grid.shape) - 1)
    return float(np.mean(np.minimum(np.abs(values[tuple(inside.T)]), 1.0)))
