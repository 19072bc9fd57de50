"""What the steps of a case work with, and what they have found out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, cast

from pipeline.load import Crop
from pipeline.load.scans import Scans
from pipeline.model import Clamp, Curve, Lumen, Volume
from pipeline.run.frame import Frame
from pipeline.run.keys import key_of
from pipeline.run.log import Log, Stage
from pipeline.run.store import Store
from pipeline.status import StageError
from pipeline.study.config import Config
from pipeline.study.schema import Case

Result = TypeVar("Result", Lumen, Curve)


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of a case so far. entry : the clamp that was simulated; failure : why the case went no further."""

    scans: Scans | None = None
    lumen: Lumen | None = None
    entry: Clamp | None = None
    frames: tuple[Frame, ...] = ()
    failure: StageError | None = None
    failed_stage: str = ""


@dataclass(frozen=True, eq=False)
class Context:
    """A case, its settings, the store of earlier results and the log."""

    case: Case
    config: Config
    store: Store
    log: Log

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
        **named: object,
    ) -> Result:
        """``function(*inputs, **named)``, or what the store has of it: its key is made from the very inputs.

        A crop among the inputs stands for its volume, which is read only where it is needed.
        """
        key = key_of(function, inputs, named) if self.store.root else ""
        kept = self.store.get(stage, key)
        if kept is None:
            volumes = [self.load(item, of_frame) if isinstance(item, Crop) else item for item in inputs]
            with self.log.timed(stage, of_frame):
                result = function(*volumes, **named)
            self.store.put(stage, key, result)
        else:
            result = cast(Result, kept)
        self.log.count(stage, {"reused": 1} if kept else result.counters, result.levels)
        return result
