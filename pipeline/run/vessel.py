"""segment: the lumen, once per case."""

from __future__ import annotations

import numpy as np

from pipeline.load import scans
from pipeline.run.cache import key_of
from pipeline.run.opening import header_hash
from pipeline.run.record import CaseRun
from pipeline.run.stored import pack_lumen, unpack_lumen
from pipeline.segment import segment


def segment_vessel(run: CaseRun) -> None:
    """The lumen: the user's own, the stored one, or segmented from the wire-free scan."""
    if run.case.lumen is not None:
        from pipeline.segment.given import read_lumen

        with run.timed("segment"):
            run.lumen = read_lumen(run.case.lumen.path, run.config.segment)
        return
    assert run.headers is not None
    header = run.headers.first
    assert header is not None, "the manifest guarantees frames, a reference or a lumen"
    if run.headers.reference is None:
        run.assumptions.append(
            "no reference scan: the lumen was segmented from frame 0, which has a wire in it"
        )
    key = key_of(
        "segment", header_hash(run, header), run.case.lumen_seed_mm, run.config.segment, run.config.load
    )
    stored = run.store.get("segment", key)
    if stored is not None:
        run.lumen = unpack_lumen(*stored)
        run.counters["segment"]["reused"] = 1
    else:
        with run.timed("load"):
            volume = scans.load_crop(header, header.box, run.config.load)
        run.count("load", scans.load_counters(header, header.box))
        with run.timed("segment"):
            run.lumen = segment(volume, np.array(run.case.lumen_seed_mm), run.config.segment)
        run.store.put("segment", key, *pack_lumen(run.lumen))
    run.count("segment", run.lumen.counters)
    run.warnings += run.lumen.warnings
    run.progress("segment", 1, 1, f"{int(np.count_nonzero(run.lumen.mask.values))} voxels")
