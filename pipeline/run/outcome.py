"""The outcome of a job, the same wherever it runs."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from reports.atomic import WriteError

J = TypeVar("J")
R = TypeVar("R")
LOST = "the worker process was killed twice (out of memory?); run this case alone with -j 1"
GONE = "the dask scheduler went away, or the connection to it; give the same command again when it is there"


@dataclass(frozen=True)
class Outcome(Generic[J, R]):
    """A result, or an error with its traceback or the like in ``log``.

    status : ``ok``, ``crashed``, ``worker_lost``, ``scheduler_lost``, ``over_limit``, or ``unwritable`` where nothing
    can be written any more, so that going on makes no sense.
    """

    job: J
    result: R | None = None
    error: str = ""
    log: str = ""
    status: str = "ok"

    @property
    def lost(self) -> bool:
        """Whether its worker has died."""
        return self.status == "worker_lost"


def guarded(work: Callable[[J], R], job: J) -> Outcome[J, R]:
    """Run one job; an exception becomes its outcome, so that it does not end the whole batch."""
    try:
        return Outcome(job, work(job))
    except WriteError as error:
        return Outcome(job, None, str(error), traceback.format_exc(), "unwritable")
    except Exception as error:
        return Outcome(job, None, f"{type(error).__name__}: {error}", traceback.format_exc(), "crashed")
