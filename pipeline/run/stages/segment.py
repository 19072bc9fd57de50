"""segment: the lumen, once per case: the user's own, the stored one, or segmented from the wire-free scan."""

from dataclasses import replace

import numpy as np

from pipeline.load import Crop
from pipeline.load.lumens import read_lumen
from pipeline.run.stages.known import Context, Known
from pipeline.segment import segment
from pipeline.segment.given import given_lumen


def segment_vessel(run: Context, known: Known) -> Known:
    """The lumen of the case."""
    case, config, log = run.case, run.config, run.log
    if case.lumen is not None:
        with log.timed("segment"):
            lumen = given_lumen(read_lumen(case.lumen, config.segment.least_voxels), config.segment)
        log.assumptions += lumen.warnings
        return replace(known, lumen=lumen)
    assert known.scans is not None
    scan = known.scans.first
    assert scan is not None, "the manifest guarantees frames, a reference or a lumen"
    if known.scans.reference is None:
        log.assumptions.append("no reference scan: the lumen was segmented from frame 0, which has a wire in it")
    crop = Crop(scan, scan.box, config.load)
    lumen = run.stored("segment", segment, crop, case.lumen_seed_mm, config.segment)
    log.warnings += lumen.warnings
    log.progress("segment", 1, 1, f"{int(np.count_nonzero(lumen.distance.values < 0))} voxels")
    return replace(known, lumen=lumen)
