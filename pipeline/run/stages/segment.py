"""segment: the lumen, once per case: the user's own, the stored one, or segmented from the wire-free scan."""

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.arrays.cores import on_cores, side_by_side
from pipeline.arrays.grids import corners_mm, indices_of
from pipeline.load import Crop
from pipeline.load.lumens import LOOK_AT, meant_within_mm, read_lumen
from pipeline.model import Array, Lumen, Volume
from pipeline.run.projections import slabs
from pipeline.run.stages.known import Context, Known
from pipeline.run.warm import warm_up
from pipeline.segment import segment
from pipeline.segment.astray import astray
from pipeline.segment.given import given_lumen
from pipeline.segment.hollows import hollows
from pipeline.segment.levels import failed
from pipeline.segment.opened import outside_mm
from pipeline.segment.pieces import in_pieces
from pipeline.segment.shown import LumenDoubt, beside_the_wall
from pipeline.status import StageError
from reports.frames_file import ScanCrop


def segment_vessel(run: Context, known: Known) -> Known:
    """The lumen of the case."""
    case, config, log = run.case, run.config, run.log
    if case.lumen is not None:
        with log.timed("segment"):
            lumen = given_lumen(read_lumen(case.lumen, config.segment.least_voxels), config.segment)
        _require_entry(run, lumen)
        log.assumptions += lumen.warnings
        log.warnings += in_pieces(lumen.distance, case.entry_mm) + hollows(lumen.distance)
        doubt = _held_against(run, known, lumen)
        log.warnings += [doubt.told] * bool(doubt.told)
        return replace(known, lumen=lumen, lumen_doubt=doubt.told * doubt.far)
    scan = known.scans.first
    assert scan is not None, "the manifest guarantees frames, a reference or a lumen"
    with_wire = known.scans.reference is None
    if with_wire:
        log.assumptions.append("no reference scan: the lumen was segmented from frame 0, which has a wire in it")
    crop = Crop(scan, scan.box, config.load)
    radius_mm = case.wire.radius_mm if with_wire else None
    with on_cores(run.cores):
        segmented = _loading(run, reference=not with_wire) if run.cores > 1 else segment
        lumen = run.stored("segment", segmented, crop, case.lumen_seed_mm, config.segment, radius_mm)
    log.warnings += lumen.warnings
    log.progress("segment", 1, 1, f"{int(np.count_nonzero(lumen.distance.values < 0))} voxels")
    return replace(known, lumen=lumen)


def _loading(run: Context, reference: bool) -> Callable[..., Lumen]:
    """``segment``, which loads its machine code and that of later stages beside it: it follows the vessel on one core.

    Helpers, which are forked later, then need not load it, each for itself: they do where the lumen is given or stored.
    reference : whether there is one.
    """

    def load(scan: Volume) -> None:
        try:
            warm_up(scan.values.dtype, reference=reference, traced=run.goes_to("trace"))
            if run.goes_to("simulate"):
                run.kernels()
        except Exception as error:  # it only saves time: a stage that needs the code meets the same error, if it does
            run.log.progress("segment", 0, 0, f"machine code is loaded later: {error!r}")

    @functools.wraps(segment)  # the store knows it by its name and sources
    def both(scan: Volume, *given: Any) -> Lumen:
        found: Lumen = side_by_side(lambda: segment(scan, *given), lambda: load(scan))[0]
        return found

    return both


def _require_entry(run: Context, lumen: Lumen) -> None:
    """StageError where the user's own lumen is not where the wire enters: wires would be missed, not the lumen."""
    grid = lumen.distance
    if not (grid.values < 0.0).any():
        do = "check whether each of its triangles is there twice, or whether it is much thinner than 0.3 mm"
        raise failed("the given lumen encloses nothing", "a lumen that the wire enters", do)
    out = float(outside_mm(grid, np.array([run.case.entry_mm]))[0])
    if out > meant_within_mm(float(np.max(grid.spacing_mm)), run.case.entry_sigma_mm):
        low, high = (corner.round(1).tolist() for corner in _box_of(lumen))
        raise failed(
            f"entry_mm {list(run.case.entry_mm)} lies {out:.1f} mm or more outside the given lumen, which spans {low} "
            f"to {high} mm in LPS",
            "a lumen that the wire enters",
            LOOK_AT,
        )


def _box_of(lumen: Lumen) -> tuple[Array, Array]:
    """The corners (3,) of the box, along the axes of LPS, of the voxels inside."""
    inside = lumen.distance.to_mm(indices_of(lumen.distance.values < 0))
    return inside.min(axis=0), inside.max(axis=0)


def _held_against(run: Context, known: Known, lumen: Lumen) -> LumenDoubt:
    """What the case's first scan, if it has one, says of the user's own lumen."""
    scan = known.scans.first
    if scan is None:
        return LumenDoubt()

    def around(points_mm: Array) -> Volume:
        return run.load(Crop(scan, scan.box_of(points_mm), run.config.load))

    try:
        shown = around(corners_mm(lumen.distance))
    except StageError:  # said where it is read to be traced
        return LumenDoubt()

    def wider(points_mm: Array) -> Volume:
        try:
            return around(points_mm)
        except StageError:  # what lies beyond the lumen's box need not be readable
            return shown

    with run.log.timed("segment"):
        told = astray(lumen, shown, np.array(run.case.entry_mm), np.array(run.case.entry_direction), wider)
        return LumenDoubt(told, far=True) if told else beside_the_wall(lumen, shown)


def scan_at_entry(run: Context, known: Known) -> ScanCrop | None:
    """The scan around the entry, as pictures for a case without a lumen; None where it cannot be read."""
    scan = known.scans.first
    if scan is None:
        return None
    try:
        volume = Crop(scan, scan.box, run.config.load).load()
    except StageError:  # this is what failed
        return None
    pictures = dict(enumerate(slabs(volume, np.array(run.case.entry_mm))))
    shape = (scan.shape[0], scan.shape[1], scan.shape[2])
    return ScanCrop(volume.spacing_mm, volume.origin_mm, volume.direction, shape, entry_slabs=pictures)
