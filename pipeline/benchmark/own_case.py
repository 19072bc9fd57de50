"""A user's own study as a scene of the benchmark: its lumen, its wire, its depth."""

from pipeline.benchmark.scenes import BenchScene
from pipeline.run.cache import Store, default_root
from pipeline.run.log import Log
from pipeline.run.stages import Context, run_stages
from pipeline.run.stages.load import each_frame
from pipeline.simulate import guide_wire
from pipeline.simulate.resolution import lengths_mm
from pipeline.study.manifest import Case
from pipeline.study.settings import Config


class NoScene(ValueError):
    """A case that cannot be pushed through: the sentence says why."""


def scene_of(case: Case, config: Config) -> BenchScene:
    """Segment the case's lumen (or read it) and push to its deepest insertion_mm; raises NoScene."""
    if not case.insertion_mm:
        msg = f"bench: case {case.id!r}: insertion_mm: got none; allowed: a list of depths in mm; "
        raise NoScene(msg + "the benchmark does not trace: give the deepest insertion to time")
    silent = Log(lambda *_: None)
    known = run_stages(Context(case, config, Store(default_root()), silent, until="segment"))
    if known.failure is not None or known.lumen is None:
        raise NoScene(f"bench: case {case.id!r}: {known.failure}")
    longest = lengths_mm(config.solver.segment_mm, case.wire.rest_curvature_per_mm)[0]
    return BenchScene(
        case.id,
        max(case.insertion_mm),
        step_mm=config.solver.step_mm,
        entry_mm=case.entry_mm,
        direction=case.entry_direction,
        material_axis=case.material_axis,
        roll_deg=each_frame(case.stated_roll_deg, len(case.insertion_mm))[-1] + config.simulate.roll_offset_deg,
        guide_wire=guide_wire(case.wire, longest, config.simulate.bending_scale),
        wall_stiffness=case.wall.stiffness_N_mm2,
        friction=case.wall.friction,
        ready=known.lumen.distance,
    )
