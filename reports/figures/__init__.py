"""Every figure by the name that sections.toml uses; each returns None where its data is absent."""

from collections.abc import Callable, Mapping

from reports.case_files import CaseFiles
from reports.figures._style import Drawing
from reports.figures.along_wire import contact_along_wire, error_along_wire
from reports.figures.by_depth import (
    error_by_depth,
    forces_by_depth,
    skill_by_depth,
    tip_by_depth,
    truth_by_depth,
)
from reports.figures.every_frame import every_frame
from reports.figures.overview import RunFiles, case_frame_map, cases_by_error
from reports.figures.projections import failed_projections, projections
from reports.figures.run_time import run_time
from reports.figures.simulated import simulated_wires
from reports.figures.sweep import sensitivity

CASE_FIGURES: Mapping[str, Callable[[CaseFiles], Drawing | None]] = {
    "error_by_depth": error_by_depth,
    "projections": projections,
    "every_frame": every_frame,
    "failed_projections": failed_projections,
    "simulated_wires": simulated_wires,
    "error_along_wire": error_along_wire,
    "tip_by_depth": tip_by_depth,
    "skill_by_depth": skill_by_depth,
    "truth_by_depth": truth_by_depth,
    "forces_by_depth": forces_by_depth,
    "contact_along_wire": contact_along_wire,
    "run_time": run_time,
}
RUN_FIGURES: Mapping[str, Callable[[RunFiles], Drawing | None]] = {
    "case_frame_map": case_frame_map,
    "cases_by_error": cases_by_error,
    "sensitivity": sensitivity,
}

__all__ = ["CASE_FIGURES", "RUN_FIGURES", "Drawing", "RunFiles"]
