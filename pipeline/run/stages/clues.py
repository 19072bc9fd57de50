"""What trivial predictors may know of a case that was traced and whose clamp is known."""

from collections.abc import Callable
from typing import Any

from pipeline.compare.nulls import Clues
from pipeline.run.helpers import R
from pipeline.run.stages.known import Context, Known, trusted


def clues_of(run: Context, known: Known) -> Clues | None:
    """What predictors may know; None where no trace is to be trusted, or nothing will be compared."""
    if not run.goes_to("compare"):
        return None
    curves = trusted(known.frames).values()
    if not curves:
        return None
    deepest = max(curves, key=lambda curve: curve.length_mm)
    return Clues(known.vessel, known.held, run.case.wire.radius_mm, deepest.points_mm)


def beside_clues(run: Context, known: Known, work: Callable[[int], R], count: int) -> list[R]:
    """``work(i)`` for every i below ``count``, and beside these the clues' paths through the vessel: they need no wire.

    The shortest one is small to send: whoever is done first looks for it. The axis this process finds by itself.
    """
    clues = known.clues
    if clues is None:
        return run.share("simulate", lambda i, _: work(i), count)

    def ways() -> None:
        with run.log.timed("compare"):
            _ = clues.way

    def part(number: int, _earlier: object) -> Any:
        if number < count:
            return work(number)
        log = run.part().log
        with log.timed("compare"):
            return clues.shortest, log

    *found, (shortest, log) = run.share("simulate", part, count + 1, ways)
    run.log.add(log)
    clues.take_shortest(shortest)
    return found
