"""A user's own study as a scene of the benchmark: its lumen, its wire, its depth."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from pipeline.benchmark.scenes import BenchScene
from pipeline.run.cache import Store, default_root
from pipeline.run.progress import CaseProgress
from pipeline.run.stages import CaseRun, run_stages
from pipeline.simulate.replay import guide_wire, rolls
from pipeline.study.config import Config
from pipeline.study.manifest import Case


class NoScene(ValueError):
    """A case that cannot be pushed through: the sentence says why."""


def scene_of(case: Case, config: Config) -> BenchScene:
    """Segment the case's lumen (or read it) and push to its deepest insertion_mm; raises NoScene."""
    if not case.insertion_mm:
        msg = f"bench: case {case.id!r}: insertion_mm: got none; allowed: a list of depths in mm; "
        raise NoScene(msg + "the benchmark does not trace: give the deepest insertion to time")
    with TemporaryDirectory() as folder:
        progress = CaseProgress(case.id, Path(folder) / "log.txt", quiet=True)
        run = CaseRun(case, config, Store(default_root()), progress, "segment")
        run_stages(run)
    if run.failure is not None or run.lumen is None:
        msg = f"bench: case {case.id!r}: {run.failure}"
        raise NoScene(msg)
    return BenchScene(
        case.id,
        max(case.insertion_mm),
        step_mm=config.solver.step_mm,
        entry_mm=case.entry_mm,
        direction=case.entry_direction,
        material_axis=case.material_axis,
        roll_deg=rolls(case, len(case.insertion_mm), config.simulate)[-1],
        guide_wire=guide_wire(case.wire, config.solver, config.simulate),
        wall_stiffness=case.wall.stiffness_N_mm2,
        friction=case.wall.friction,
        ready=run.lumen.distance,
    )
