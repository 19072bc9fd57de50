"""The data that flows: load -> Volume, segment -> Lumen, trace -> Curve, simulate -> Solution, compare -> Comparison.

Frozen dataclasses of read-only arrays; a Solution is the solver's own, a Comparison stands in ``pipeline.compare``.
Points are LPS mm, shape (n, 3), float64, ordered from entry to tip.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, WithJsonSchema

from pipeline.ranges import (
    FiniteProfile,
    Friction,
    LogSigma,
    NonNegative,
    Number,
    OpacityProfile,
    PositiveProfile,
    Radius,
    Sigma,
    Torsional,
    WallStiffness,
)
from pipeline.status import FrameStatus
from pipeline.wording import WRITTEN_HERE
from solver.grid import Grid, read_only

Array = NDArray[np.float64]
Counters = Mapping[str, float]
"""Counts by name; over frames they are summed."""
Levels = Mapping[str, float]
"""Measured values by name (a noise, a blur, a share); over frames their least, median and greatest are reported."""


@dataclass(frozen=True)
class Wire:
    """A guide wire. Profiles are functions of the distance from the tip (mm): one number, or pairs."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")
    name: Annotated[str, WithJsonSchema(WRITTEN_HERE)]
    radius_mm: Radius
    bending_stiffness_N_mm2: PositiveProfile
    rest_curvature_per_mm: FiniteProfile = 0.0
    torsional_stiffness_N_mm2: Torsional = float("inf")
    weight_N_per_mm: Annotated[float, Field(ge=0, le=1), Number] = 0.0
    opacity: OpacityProfile | None = None

    @property
    def curved(self) -> bool:
        """Whether any of it is curved at rest: one that is straight may be rolled at will, and has no tip's curve."""
        return bool(np.any(np.atleast_2d(self.rest_curvature_per_mm)[:, -1]))


@dataclass(frozen=True)
class OverWire:
    """A catheter over the wire; insertion_mm : of its own tip beyond the entry, one for all frames or one per frame."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")
    bending_stiffness_N_mm2: NonNegative
    radius_mm: Radius
    insertion_mm: NonNegative | Annotated[tuple[NonNegative, ...], Field(min_length=1)]


@dataclass(frozen=True)
class Wall:
    """The vessel's elastic wall: its stiffness per mm of wire, and Coulomb friction."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")
    stiffness_N_mm2: WallStiffness = 2.0
    friction: Friction = 0.0


@dataclass(frozen=True)
class Uncertainty:
    """How well inputs are known: one standard deviation of each.

    None is a default: of ``budget.inputs`` in a run, of ``calibrate.trials`` (the lumen's) in a fit.

    lumen_mm, lumen_bias_mm : of the lumen's surface, place by place and common to
    all of it.     Relative: rest_curvature; taper (lengths over which the stiffness changes) and wall_stiffness, of
    their logarithms.     friction : of the coefficient.     traces_mm : of own curves, across the wire.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")
    lumen_mm: Sigma | None = None
    lumen_bias_mm: Sigma | None = None
    rest_curvature: Sigma | None = None
    taper: LogSigma | None = None
    wall_stiffness: LogSigma | None = None
    friction: Sigma | None = None
    traces_mm: Sigma | None = None


@dataclass(frozen=True, eq=False)
class Clamp:
    """Where the wire is held: entry_mm (3,) LPS, direction (3,) of length 1; note and warning are for the report.

    material_axis : (3,) where material axis 1 points at roll 0; None: the world axis least aligned with direction.
    down : (3,) where the wire's weight pulls; None: it has none.
    covariance : (6, 6) of entry_mm, mm, and of the change of the direction; None: not known.
    fitted, left_out : numbers of the frames it was estimated from, and of those that do not fit it.
    """

    entry_mm: Array
    direction: Array
    material_axis: Array | None = None
    down: Array | None = None
    note: str = ""
    warning: str = ""
    covariance: Array | None = None
    fitted: tuple[int, ...] = ()
    left_out: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("entry_mm", "direction", "material_axis", "down", "covariance"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, read_only(getattr(self, name), np.float64))

    @property
    def sigma_mm(self) -> float:
        """Standard deviation of the entry along an axis across the wire, mm; NaN where it is not known."""
        if self.covariance is None:
            return float("nan")
        across = np.eye(3) - np.outer(self.direction, self.direction)
        return float(np.sqrt(0.5 * np.trace(across @ self.covariance[:3, :3])))

    @property
    def sigma_deg(self) -> float:
        """Standard deviation of a tilt of the direction about an axis, degrees; NaN where it is not known."""
        if self.covariance is None:
            return float("nan")
        return float(np.degrees(np.sqrt(0.5 * np.trace(self.covariance[3:, 3:]))))


@dataclass(frozen=True, eq=False)
class OtherWire:
    """A wire that another simulator made; its forces are not known.

    joints_mm : (n, 3) from the clamp's plane to the tip, LPS mm.
    max_penetration_mm : how far its surface (its radius included) reaches out of the lumen.
    """

    joints_mm: Array
    max_penetration_mm: float

    def __post_init__(self) -> None:
        """Freeze the points."""
        object.__setattr__(self, "joints_mm", read_only(self.joints_mm, np.float64))


@dataclass(frozen=True, eq=False)
class Volume(Grid):
    """Grey values of one scan (or of a crop of it), indexed x, y, z.

    assumed : what the file lacked and was assumed.     made_of : what the values were read from, where they are
    unchanged since; it stands for them in cache keys.
    """

    assumed: tuple[str, ...] = ()
    made_of: object = None


@dataclass(frozen=True, eq=False)
class Lumen:
    """The vessel: ``distance`` is the signed distance to its wall in mm on the vessel's own box, negative inside.

    wall_level : the grey value taken as the wall; NaN where the lumen did not come from grey values.
    of_scan : by which the scan that it came from is known again, whatever file holds it; empty without one.
    """

    distance: Grid
    wall_level: float = float("nan")
    warnings: tuple[str, ...] = ()
    counters: Counters = field(default_factory=dict)
    levels: Levels = field(default_factory=dict)
    of_scan: str = ""


@dataclass(frozen=True, eq=False)
class Branches:
    """A lumen as round cones: their ends, start and end (n, 3) LPS mm, and the radii (n,) there, mm."""

    start_mm: Array
    end_mm: Array
    start_radius_mm: Array
    end_radius_mm: Array


@dataclass(frozen=True, eq=False)
class Shapes:
    """Triangles (t, 3) and lines, as indices of points_mm (n, 3) LPS; radius_mm (n,) where a file has one per point."""

    points_mm: Array
    triangles: NDArray[np.int64]
    lines: tuple[NDArray[np.int64], ...] = ()
    radius_mm: Array | None = None


def arc_length(points_mm: NDArray[Any]) -> Array:
    """Arc length (n,) in mm from the first of (n, 3) points; empty for no points."""
    if len(points_mm) == 0:
        return np.zeros(0)
    steps = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


@dataclass(frozen=True)
class Doubt:
    """Why a curve is not to be trusted: its status and note in the report.

    of : the level that frames at other depths may show to be the wire's own; empty where they settle nothing.
    """

    status: FrameStatus
    note: str
    of: str = ""


@dataclass(frozen=True, eq=False)
class Curve:
    """A traced wire. points_mm (n, 3) from entry to tip; n = 0 when ``status`` says that there is none.

    sigma_mm : (n,) standard deviation of each point across the wire, per axis, mm.
    tip_sigma_mm : standard deviation of the tip along the wire, mm.
    flagged : (n,) bool, points not to be trusted at that sigma (gap bridged, streak, strands in contact).
    in_plane : (n,) bool, points where the wire runs nearly in the plane of the scanner's rotation.
    elsewhere_mm : (m, 3) points of bright lines off the curve.
    marks_mm : (k, 3) points as bright as the wire in the lumen beyond the curve's end.
    brightness : (n,) the line's grey above its background, summed across it, grey mm2; contrast : grey of the scan in
    the lumen above that around it. Empty and NaN where no scan was traced.
    doubts : reasons not to trust it. The curve's status and note are those of the first. Doubts that another frame may
    settle come last.
    source : the file of a curve that was given.
    """

    points_mm: Array
    sigma_mm: Array
    tip_sigma_mm: float = float("nan")
    flagged: NDArray[np.bool_] | None = None
    doubts: tuple[Doubt, ...] = ()
    counters: Counters = field(default_factory=dict)
    in_plane: NDArray[np.bool_] | None = None
    levels: Levels = field(default_factory=dict)
    elsewhere_mm: Array = field(default_factory=lambda: np.zeros((0, 3)))
    marks_mm: Array = field(default_factory=lambda: np.zeros((0, 3)))
    brightness: Array = field(default_factory=lambda: np.zeros(0))
    contrast: float = float("nan")
    source: str = ""

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("points_mm", "sigma_mm", "elsewhere_mm", "marks_mm", "brightness"):
            object.__setattr__(self, name, read_only(getattr(self, name), np.float64))
        for name in ("flagged", "in_plane"):
            marks = getattr(self, name)
            marks = np.zeros(len(self.points_mm), bool) if marks is None else marks
            object.__setattr__(self, name, read_only(marks, bool))

    @property
    def status(self) -> FrameStatus:
        """Outcome of the trace."""
        return self.doubts[0].status if self.doubts else FrameStatus.OK

    @property
    def note(self) -> str:
        """What the report says of the status; empty where it is OK."""
        return self.doubts[0].note if self.doubts else ""

    @property
    def refused(self) -> bool:
        """Whether it has a doubt that no other frame settles: nothing more is asked of it."""
        return bool(self.doubts) and not self.doubts[0].of

    def doubted(self, status: FrameStatus, note: str, of: str = "") -> "Curve":
        """The same curve with one doubt more."""
        doubts = sorted((*self.doubts, Doubt(status, note, of)), key=lambda doubt: bool(doubt.of))
        return replace(self, doubts=tuple(doubts))

    def without(self, of: str) -> "Curve":
        """The same curve without its doubt of this level: what else is doubted remains.

        ValueError for an empty name: doubts without one are those that no other frame settles.
        """
        if not of:
            raise ValueError("of: got an empty name; expected the level whose doubt is settled")
        return replace(self, doubts=tuple(doubt for doubt in self.doubts if doubt.of != of))

    def reworded(self, words: Callable[[str], str]) -> "Curve":
        """The same curve with the notes of its doubts in other words."""
        return replace(self, doubts=tuple(replace(doubt, note=words(doubt.note)) for doubt in self.doubts))

    @property
    def length_mm(self) -> float:
        """Length of the curve, mm; 0 for an empty one."""
        return float(arc_length(self.points_mm)[-1]) if len(self.points_mm) else 0.0
