"""``roll_deg = "fit"``: the roll from the first frame that shows the wire, which is not scored afterwards."""

from dataclasses import replace
from functools import partial

from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.search import own_roll, roll_fitted
from pipeline.calibrate.segments import resolved
from pipeline.run.stages.given import trial_of
from pipeline.run.stages.known import Context, Known
from pipeline.status import FrameStatus, StageError

LOOSE_DEG = 10.0
"""A roll with a larger standard deviation than this gets a warning."""


def with_fitted_roll(run: Context, known: Known) -> Known:
    """The frames with the roll fitted, where the manifest asks for it; the clamp is free within its prior meanwhile."""
    case, log = run.case, run.log
    if case.roll_deg != "fit":
        return known
    first = next((frame for frame in known.frames if frame.trusted_curve is not None), None)
    if first is None:
        message = f'case {case.id!r}: roll_deg = "fit", but no frame has a trace to fit it on; give a number'
        raise StageError(FrameStatus.SIMULATE_FAILED, message)
    # a sensitivity run turns the wire away from what is fitted: its offset is no part of the fit
    frames = [replace(frame, roll_deg=frame.roll_deg - first.roll_deg) for frame in known.frames]
    trial = trial_of(run, known, frames, roll_free=True, only={first.index})
    fit, segments = resolved(partial(roll_fitted, Evidence(trial), case.wall.friction), trial.wire, run.config.solver)
    found = own_roll(fit)
    log.warnings += [f'roll_deg = "fit": {segments.doubt}'] * bool(segments.doubt)
    log.assumptions.append(
        f"the roll was fitted on frame {first.index}, which is not scored: {found.roll_deg:.1f} degrees "
        f"(standard deviation {found.sd_deg:.1f})"
    )
    if found.sd_deg > LOOSE_DEG or found.rivals_deg:
        others = ", ".join(f"{roll:.0f}" for roll in found.rivals_deg)
        log.warnings.append(
            f"frame {first.index} hardly tells the roll ({found.roll_deg:.0f} degrees, standard deviation "
            f"{found.sd_deg:.0f}{'; as good: ' + others if others else ''}): state roll_deg, or begin deeper"
        )
    status = FrameStatus.ROLL_FITTED
    frames = [replace(frame, roll_deg=frame.roll_deg + found.roll_deg) for frame in known.frames]
    frames[first.index] = replace(frames[first.index], status=status.identifier, sentence=status.value)
    return replace(known, frames=tuple(frames), roll_sd_deg=found.sd_deg)
