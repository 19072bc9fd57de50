"""Every setting of a run: one frozen dataclass per stage, declared there; one TOML table each."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipeline.compare.config import CompareConfig
from pipeline.load.config import LoadConfig
from pipeline.segment.config import SegmentConfig
from pipeline.simulate.config import SimulateConfig, SolverConfig
from pipeline.trace.config import TraceConfig


@dataclass(frozen=True)
class Config:
    """All settings of a run."""

    load: LoadConfig = field(default_factory=LoadConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    trace: TraceConfig = field(default_factory=TraceConfig)
    solver: SolverConfig = field(default_factory=SolverConfig)
    simulate: SimulateConfig = field(default_factory=SimulateConfig)
    compare: CompareConfig = field(default_factory=CompareConfig)
