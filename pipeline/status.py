"""What can go wrong with a frame or with the user's input, in the words that the user reads."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from enum import Enum


class FrameStatus(Enum):
    """Outcome of one frame; ``identifier`` goes into errors.csv, the value is its sentence."""

    OK = "traced, simulated to its depth, converged and compared"
    SIMULATED = "simulated only: the case has no frames to compare with"
    ROLL_FITTED = "the roll of the insertion was fitted on this frame, so that it is not scored"
    LOAD_FAILED = "the scan could not be read; the message names the file and the reason"
    REPEATED = (
        "the same scan is an earlier frame, or was calibrated with; a scan counts once: take one of the two out of the "
        "case"
    )
    SEGMENT_FAILED = "no lumen could be segmented; the message has the reason"
    NO_WIRE = "no wire was found in this frame; check that the scan shows one and that entry_mm lies on it"
    TRACE_FAILED = "the wire could not be followed as one curve from the entry; the message has the reason"
    TRACE_LEFT_LUMEN = "the traced curve leaves the lumen; check the lumen, the registration and trace settings"
    TRACE_AMBIGUOUS = "the wire can be followed in more than one way here; look at the picture before using it"
    TRACE_LOW_CONTRAST = (
        "no line at the entry stands out of the noise enough to be called the wire: entry_mm is not on it, or the "
        "frame shows none or too faintly; the message has what to do"
    )
    TRACE_LEFT_SCAN = "the wire runs out of the scan: its tip, or a part before it, is not in this frame"
    TRACE_WRONG_WAY = (
        "more of the wire lies behind the entry than beyond it; check that entry_direction points the way the wire is "
        "pushed, or state insertion_mm where it is not stated"
    )
    LENGTH_MISMATCH = (
        "the traced length disagrees with insertion_mm by more than trace.length_tolerance_mm; "
        "correct the manifest or look for a gap in the trace"
    )
    UNDER_RESOLVED = (
        "a joint of the simulated wire is turned by more than 30 degrees: its segments are too long for this bend; "
        "set a shorter solver.segment_mm, or auto where a length is set"
    )
    SELF_CONTACT = (
        "the simulated wire passes through itself, or did on its way here, as its parts do not push each other in this "
        "model; do not trust its shape and force from there on"
    )
    CURVE_MISSING = "the other simulator has no wire for this frame, which counts as one that it failed in"
    CURVE_UNUSABLE = "the other simulator's wire cannot be used; the message names the file and the reason"
    NOT_TO_DEPTH = (
        "the other simulator's wire is longer or shorter than the frame is deep by more than "
        "trace.length_tolerance_mm; push it to the depth in errors.csv of a run of this manifest"
    )
    VIEW_FAILED = "the wire cannot be held against its projection; the message has the reason"
    SIMULATE_FAILED = "the simulation stopped before this depth; the message has the reason"
    INPUT_CHANGED = "a file of the case was changed while the case was computed from it; the message names it"

    @property
    def identifier(self) -> str:
        """The short name used in tables."""
        return self.name.lower()


class _Sent(Exception):
    """An exception that comes whole out of another process: pickle would call its class with the text alone."""

    def __reduce__(self) -> tuple[object, ...]:
        """Its class and text, and what it holds."""
        return _received, (type(self), str(self)), vars(self)


def _received(kind: type[_Sent], text: str) -> _Sent:
    return kind.__new__(kind, text)


class StageError(_Sent):
    """A stage cannot go on; the message has the five parts (what, where, got, allowed, do this)."""

    def __init__(self, status: FrameStatus, message: str) -> None:
        super().__init__(message)
        self.status = status


class InputError(_Sent):
    """What a user wrote cannot be used; ``problems`` lists everything that is wrong with it.

    place : where it was written, as the line that counts the problems calls it; empty for the manifest.
    then : what became of the command, in that line.
    """

    place = ""
    then = "nothing was run"

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


class UsageError(InputError):
    """A command line that cannot be carried out."""

    place = "the command line"


def nearest(key: str, allowed: Iterable[str]) -> str:
    """The allowed key that is nearest, whatever its capitals; empty where none is near.

    A key that lacks nothing but the end of an allowed one, as its unit, is nearest to that, or ``_median`` before it.
    """
    low, small = key.lower(), {name.lower(): name for name in sorted(allowed)}
    longer = sorted((name for name in small if name.startswith(f"{low}_")), key=len)
    stem, _, unit = low.rpartition("_")
    median = f"{stem}_median_{unit}"
    close = [low] * (low in small) or [median] * (median in small) or longer or get_close_matches(low, small, n=1)
    return small[close[0]] if close else ""


def did_you_mean(key: str, allowed: Iterable[str]) -> str:
    """Sentence naming the nearest allowed key, or all of them."""
    names = sorted(allowed)
    return f"did you mean {near!r}?" if (near := nearest(key, names)) else f"allowed: {', '.join(names)}"
