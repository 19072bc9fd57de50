"""The data of a case: what the steps work with (``Context``) and what they have found (``Known``, ``Frame``)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from pipeline.budget import Budget
from pipeline.compare import Comparison
from pipeline.compare.nulls import Clues
from pipeline.load import Crop, Scans
from pipeline.load.views import View
from pipeline.model import Array, Clamp, Curve, Lumen, OtherWire, Volume
from pipeline.register import Registration
from pipeline.run.cache import Store
from pipeline.run.helpers import R, Work, nothing, said, shared
from pipeline.run.inputs import ANY, Inputs
from pipeline.run.log import STAGES, Log, Stage
from pipeline.run.stages.before import ASKS, Before, is_asks
from pipeline.run.store import key_of
from pipeline.simulate.resolution import AGREED_MM
from pipeline.status import FrameStatus, StageError
from pipeline.study.manifest import Case
from pipeline.study.settings import Config
from reports.case_files import GOOD
from reports.frames_file import ScanCrop, Straightened
from solver import Solution, Status

UP_TO_TRACE = "load", "trace"
"""Stages of which a frame that failed there has no trace to be trusted."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of a case.

    status : identifier (``ok``, a FrameStatus or a solver status).     stage, message : where and why it is not ok.
    expected_mm : depth that the manifest states.     depth_mm : depth that was simulated.
    catheter_mm : depth of the tip of a catheter over the wire.
    num_mm : estimated distance of the simulated wire from the one of endlessly short segments; num_push_N : the same of
    its push.
    view, in_view_mm : the X-ray projection of a frame without a scan; the wire that was seen (n, 2) and the simulated
    one (k, 2) on the plane through the isocentre.
    projections, straightened : of the scan: its maxima along the array axes, and planes across the traced wire.
    voxels : by which its scan, or without one its own curve, is known again, whatever file holds it; empty where it
    could not be read.
    """

    index: int
    status: str = FrameStatus.OK.identifier
    sentence: str = FrameStatus.OK.value
    stage: str = ""
    message: str = ""
    expected_mm: float = float("nan")
    depth_mm: float = float("nan")
    roll_deg: float = 0.0
    catheter_mm: float = 0.0
    curve: Curve | None = None
    simulated: Solution | OtherWire | None = None
    num_mm: float = float("nan")
    num_push_N: float = float("nan")
    comparison: Comparison | None = None
    view: View | None = None
    in_view_mm: tuple[Array, ...] = ()
    budget: Budget | None = None
    registration: Registration | None = None
    truth_mm: Array | None = None
    truth: dict[str, float] = field(default_factory=dict)
    nulls_rms_mm: dict[str, float] = field(default_factory=dict)
    projections: tuple[NDArray[np.uint8], ...] = ()
    straightened: Straightened | None = None
    voxels: str = ""

    @property
    def ok(self) -> bool:
        """Whether it was traced, simulated to its depth and compared, or only simulated, or used to fit the roll."""
        return self.status in GOOD

    @property
    def traced(self) -> bool:
        """Whether there is a curve to compare with, trusted or not."""
        return self.curve is not None and len(self.curve.points_mm) > 1

    @property
    def trusted_curve(self) -> Curve | None:
        """The traced curve of a frame that loading and tracing found nothing wrong with."""
        return self.curve if self.traced and self.stage not in UP_TO_TRACE else None

    @property
    def open_curve(self) -> Curve | None:
        """The traced curve of a frame that counts once, and of which other frames may settle all that is doubted."""
        curve = self.curve if self.traced and self.stage != "load" else None
        return None if curve is None or curve.refused else curve

    @property
    def solved(self) -> Solution | None:
        """The simulated wire where it is this project's own, with all that the solver knows of it."""
        return self.simulated if isinstance(self.simulated, Solution) else None

    @property
    def simulated_wire(self) -> Solution | OtherWire | None:
        """The simulated wire where any of it is beyond the entry: a point alone touches nothing."""
        return self.simulated if self.simulated is not None and len(self.simulated.joints_mm) > 1 else None

    @property
    def uncertain(self) -> bool:
        """Whether the simulated wire was about to snap, or segments of twice the length lead elsewhere."""
        return self.solved is not None and (self.solved.uncertain or self.num_mm > AGREED_MM)

    def cleared(self, curve: Curve) -> "Frame":
        """The same frame with a curve of which other doubts are left, or none."""
        good = FrameStatus.OK
        fresh = replace(self, status=good.identifier, sentence=good.value, stage="", message="")
        return fresh.traced_by(curve)

    def traced_by(self, curve: Curve) -> "Frame":
        """The same frame with its curve, failed where the curve is not to be trusted."""
        done = replace(self, curve=curve)
        return done if curve.status is FrameStatus.OK else done.failed("trace", curve.status, curve.note)

    def failed(self, stage: str, why: FrameStatus | Status | StageError, message: str = "") -> "Frame":
        """The same frame with what went wrong; the first failure is kept, later ones are its consequences."""
        if not self.ok:
            return self
        status = why.status if isinstance(why, StageError) else why
        text = str(why) if isinstance(why, StageError) else message
        return replace(self, status=status.identifier, sentence=status.value, stage=stage, message=text)


def trusted(frames: Sequence[Frame]) -> dict[int, Curve]:
    """By the number of their frame, the traced curves that loading and tracing found nothing wrong with."""
    return {frame.index: curve for frame in frames if (curve := frame.trusted_curve) is not None}


Result = TypeVar("Result", Lumen, Curve)
NO_SCANS = Scans(None, ())


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of a case so far.

    lumen_doubt : what the scan says against a given lumen that is far off; empty where it is not.
    off_the_scans : whether own traces lie off the wires that the scans show: nothing is then told from the traces.
    clamp, segment_mm : what was simulated with.     roll_sd_deg : standard deviation of a fitted roll, None of a
    stated one.     clues : see ``clues_of``.
    sources, entries : rows of budget.csv and entries.csv.
    ends_rank : of the real insertion in the budget's ensemble (see ``budget.joint``).
    failure : why the case went no further.     at_entry : the scan around the entry, where no lumen was found.
    """

    scans: Scans = NO_SCANS
    lumen: Lumen | None = None
    lumen_doubt: str = ""
    off_the_scans: bool = False
    clamp: Clamp | None = None
    roll_sd_deg: float | None = None
    clues: Clues | None = None
    segment_mm: float = float("nan")
    frames: tuple[Frame, ...] = ()
    sources: tuple[dict[str, Any], ...] = ()
    entries: tuple[dict[str, Any], ...] = ()
    ends_rank: float = float("nan")
    failure: StageError | None = None
    failed_stage: str = ""
    at_entry: ScanCrop | None = None

    @property
    def vessel(self) -> Lumen:
        """The lumen, in a stage that runs only where one was found."""
        assert self.lumen is not None
        return self.lumen

    @property
    def held(self) -> Clamp:
        """The clamp, in a stage that runs only where it is known."""
        assert self.clamp is not None
        return self.clamp

    def failed(self, stage: str, why: StageError) -> "Known":
        """The same case with what ended it, which is every frame's failure."""
        return replace(self, frames=tuple(f.failed(stage, why) for f in self.frames), failure=why, failed_stage=stage)


@dataclass(frozen=True, eq=False)
class Context:
    """A case, its settings, the store of earlier results and the log.

    cores : that the case may use.     until : the last stage that it goes through.
    hashed : waits until the files are hashed, so that forked processes inherit the hashes.
    inputs : the case's files as they were when it began; nothing is stored that was made of others.
    lumen_known : called as soon as the lumen is what it will be, before the case is simulated.
    kernels : loads the solver's compiled code, which takes half a second; once, however often it is called.
    """

    case: Case
    config: Config
    store: Store
    log: Log
    cores: int = 1
    until: Stage = "report"
    hashed: Callable[[], object] = nothing
    inputs: Inputs = ANY
    lumen_known: Callable[[Lumen], object] = nothing
    kernels: Callable[[], object] = nothing

    def goes_to(self, stage: Stage) -> bool:
        """Whether the case goes through a stage."""
        return STAGES.index(stage) <= STAGES.index(self.until)

    def part(self) -> "Context":
        """The same for a part of the case that may be done in another process."""
        return replace(self, log=self.log.part(), cores=1)

    def share(
        self,
        stage: Stage,
        work: Work[R],
        count: int,
        first: Callable[[], object] = nothing,
        inherited: Sequence[object] = (),
    ) -> list[R]:
        """``helpers.shared`` on the cores of the case; where helpers failed, the reason is also logged."""

        def told(text: str) -> None:
            said(f"{self.case.id}: {text}")
            self.log.progress(stage, 0, 0, text)

        if min(count, self.cores) > 1:
            self.hashed()
        return shared(work, count, self.cores, first, inherited, told)

    def load(self, crop: Crop, frame: int | None = None) -> Volume:
        """Read a box of a scan."""
        with self.log.timed("load", frame):
            volume = crop.load()
        self.log.count("load", crop.counters)
        return volume

    def stored(
        self,
        stage: Stage,
        function: Callable[..., Result],
        *inputs: object,
        of_frame: int | None = None,
        previous: Before | None = None,
        **named: object,
    ) -> Result:
        """``function(*inputs, **named)``, or its stored result; the cache key is made from these very inputs.

        A crop among the inputs stands for its volume, which is read only where nothing is stored. previous : an input
        that belongs to the key only where the function has asked for it.
        """
        key = key_of(function, inputs, named) if self.store.root else ""
        kept = self.store.get(stage, key)
        if previous is not None and is_asks(kept):
            key = key_of(function, inputs, named, previous.curve)
            kept = self.store.get(stage, key)
        if kept is None:
            volumes = [self.load(item, of_frame) if isinstance(item, Crop) else item for item in inputs]
            asked = previous is None or previous.asked
            with self.log.timed(stage, of_frame):
                result = function(*volumes, **named, **({} if previous is None else {"previous": previous}))
            if self.store.root and self.inputs.changed() is None:
                if previous is not None and previous.asked and not asked:
                    self.store.put(stage, key, ASKS)
                    key = key_of(function, inputs, named, previous.curve)
                self.store.put(stage, key, result)
        else:
            result = cast(Result, kept)
            self.log.reused[stage] += 1
            for crop in (item for item in inputs if isinstance(item, Crop)):
                self.log.count("load", crop.counters)
        # counted for stored results, too: a resumed run reports the same work as one that was not interrupted
        self.log.count(stage, result.counters, result.levels)
        return result
