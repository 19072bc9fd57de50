"""What is said of values of all kinds: verdicts, doubts, warnings. They are drawn, most of them just at a threshold."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.compare import intervals
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import METRICS, VesselAxis, measured, pair_of, scored
from pipeline.load.geometry import Header, Source
from pipeline.model import Curve, OtherWire, OverWire, Wire
from pipeline.run.stages import depths, own_curves
from pipeline.run.stages.known import Frame
from pipeline.study import devices, plausible
from pipeline.study.manifest import Case, read_manifest
from reports import _content, verdict
from tests.numbers.drawn import said
from tests.numbers.kept import Numbers, Scene, digest

NAN, INF = float("nan"), float("inf")
ORIGIN = [0.0, 0.0, 0.0]
COUNT = 300
MANIFEST = """
schema = 1
[wires.soft]
radius_mm = 0.18
bending_stiffness_N_mm2 = 0.5
[[case]]
id = "run1"
frames = ["frames/a.mha", "frames/b.mha", "frames/c.mha", "frames/d.mha"]
entry_mm = [1.0, 2.0, 3.0]
entry_direction = [0.0, 0.0, 2.0]
wire = "soft"
"""


def one_of(rng: np.random.Generator, *values: Any) -> Any:
    """One of the values."""
    return values[int(rng.integers(len(values)))]


def together(**texts: Iterable[str]) -> Numbers:
    """What is said under each name, an empty text as a word of its own: it is told at which values nothing is said."""
    found: dict[str, list[float]] = {}
    for name, own in texts.items():
        found |= said(name, " ".join(text or "-" for text in own))
    return found


def verdicts() -> Numbers:
    """Of a run's numbers."""
    rng, rows = np.random.default_rng(1), []
    for _ in range(COUNT):
        skill, low, high = (one_of(rng, -12.0, -10.0, -0.2, -0.1, -0.05, 0.0, 1e-3, 0.4, 0.9, NAN) for _ in range(3))
        row = {
            "rms_mm": one_of(rng, 0.1, 0.25, 0.5, NAN),
            "p95_mm": one_of(rng, 0.3, 1.0, 1.1, NAN),
            "tip_median_mm": one_of(rng, 0.3, 0.5, 0.6, 0.75, 1.5, 1.6, NAN),
            "tip_along_median_mm": one_of(rng, -0.8, -0.75, -0.3, 0.1, 0.3, 0.75, 0.8, NAN),
            "coverage": one_of(rng, 0.5, 0.95, 1.0, NAN),
            "null_roll_unknown_rms_mm": one_of(rng, 0.05, 0.07, 0.175, 0.2, 0.35, NAN),
            "skill": one_of(rng, skill, 0.2, NAN),
            "skill_strongest": skill,
            "skill_strongest_low": low,
            "skill_strongest_high": high,
            "skill_low": one_of(rng, low, NAN),
            "strongest_null": one_of(rng, "roll_unknown", "min_bending", "", None),
            "strongest_frames": one_of(rng, 4, 5, NAN),
            "skill_frames": 3 + len(rows) % 3,
            "frames_ok": one_of(rng, 4, 5),
            "frames": one_of(rng, 5, 6),
            "frames_fitted": one_of(rng, 0, 1, NAN),
            "interval": one_of(
                rng, "", "from 3 insertions only; skill_strongest_low", "interval withheld: 1 insertion,"
            ),
        }
        rows.append((row, one_of(rng, "", "wireval", "other")))
    return together(
        verdict=(verdict.verdict(row, whose) for row, whose in rows),
        remarks=(" ".join(verdict.remarks(row, whose)) for row, whose in rows),
        standing=(verdict.standing(row) for row, _ in rows),
        in_short=(verdict.in_short(row) for row, _ in rows),
        badge=(" ".join(verdict.badge("ok", row["frames"] == 5, row).values()) for row, _ in rows),
        fewer=(_content.fewer_frames(row) for row, _ in rows),
    )


def wires() -> Numbers:
    """Of wires and catheters that hardly can be."""
    rng, told, over = np.random.default_rng(2), [], []
    for _ in range(COUNT):
        radius = float(one_of(rng, *devices.RADII_MM, 0.05, 0.18, 0.45, 1.3))
        rod = 250.0 * np.pi * radius**4
        soft, stiff = (float(rod * one_of(rng, 1e-4, 2e-3, 0.05, 0.5, 5.0, 60.0, 390.0, 500.0, 1e5)) for _ in range(2))
        wire = Wire(
            "w",
            radius,
            one_of(rng, stiff, [(0.0, soft), (30.0, stiff)], [(0.0, 1.5 * stiff), (9.0, stiff)]),
            one_of(rng, 0.0, 0.1, 0.5 / radius, -0.51 / radius, [(0.0, 0.6 / radius), (9.0, 0.0)]),
            stiff * one_of(rng, 0.009, 0.01, 0.77, 3.0, 3.1, INF),
            float(one_of(rng, 0.0, 1e-4, 1.0) * np.pi * radius**2),
        )
        told.append(" ".join(devices._oddities(wire)))
        radius = float(one_of(rng, 0.1, 0.2, 0.9, 2.0, 2.1))
        stiffness = 250.0 * np.pi * radius**4 * one_of(rng, 0.0, 0.0019, 0.002, 0.1, 150.0, 151.0)
        over.append(" ".join(devices.odd_catheter(OverWire(float(stiffness), radius, 4.0))))
    return together(wires=told, catheters=over)


def made(base: Case, rng: np.random.Generator) -> Case:
    """A case of four frames."""
    lower = np.sort(rng.uniform(5.0, 40.0, 4)).round(1)
    pulled = [*lower[1:], float(lower[-1] - one_of(rng, 0.4, 0.5, 0.6, 5.0))]
    stated: list[Any] = [None, lower.tolist(), pulled, lower[::-1].tolist(), (one_of(rng, 0.02, 0.025, 9.0) * lower)]
    rolls = np.cumsum(rng.choice([0.0, 90.0, 180.0, -180.0, 181.0, -200.0], 4))
    change = {
        "entry_mm": tuple(rng.uniform(0.0, 20.0, 3).tolist()),
        "entry_direction": tuple(one_of(rng, *np.eye(3), *-np.eye(3), np.array([0.6, 0.8, 0.0])).tolist()),
        "insertion_mm": None if (depth := one_of(rng, *stated)) is None else tuple(float(mm) for mm in depth),
        "roll_deg": one_of(rng, 30.0, tuple(rolls.tolist())),
    }
    return base.model_copy(update=change)


def cases() -> Numbers:
    """Of directions, depths, rolls and true wires that hardly belong to a scan."""
    rng = np.random.default_rng(3)
    header = Header(Source(Path("a.mha")), (48, 40, 52), np.array([0.5, 0.6, 0.5]), np.zeros(3), np.eye(3), "int16")
    with tempfile.TemporaryDirectory() as folder:
        manifest = Path(folder) / "manifest.toml"
        manifest.write_text(MANIFEST, encoding="utf-8")
        (Path(folder) / "frames").mkdir()
        for name in "abcd":
            (Path(folder) / f"frames/{name}.mha").touch()
        (base,) = read_manifest(manifest).cases
    found = [made(base, rng) for _ in range(COUNT)]
    ways = rng.uniform(-1.0, 1.0, (COUNT, 4, 3))
    lines = np.linspace(0.0, 20.0, 9)[:, None]
    truth = [
        [
            np.add(c.entry_mm, lines * (np.asarray(c.entry_direction) + 0.3 * way) * one_of(rng, 1, 1, 1, 2))
            for way in own
        ]
        for c, own in zip(found, ways, strict=True)
    ]
    return together(
        leads_out=(" ".join(plausible.leads_out(c, header)) for c in found),
        depths=(" ".join(plausible.odd_depths(c, one_of(rng, None, header))) for c in found),
        rolls=(" ".join(plausible.wrapped_rolls(c)) for c in found),
        truth=(" ".join(plausible.odd_truth(c, curves)) for c, curves in zip(found, truth, strict=True)),
    )


def lengths() -> Numbers:
    """Of traced lengths beside each other, and beside the stated ones; of curves with few points."""
    rng, found, rough = np.random.default_rng(4), [], []
    for _ in range(COUNT):
        count = int(rng.integers(2, 13))
        stated = np.cumsum(rng.uniform(0.5, 4.0, count)) + 8.0
        off = one_of(rng, 0.0, 1.0, -1.0, 2.5) + one_of(rng, 0.05, 0.4) * rng.standard_normal(count)
        off[rng.integers(count)] += one_of(rng, 0.0, 0.9, -1.2, 3.0)
        own = stated + off if rng.random() < 0.8 else np.full(count, 12.0) + 0.3 * rng.standard_normal(count)
        known = stated if rng.random() < 0.7 else np.full(count, NAN)
        tip = one_of(rng, 0.05, 0.4, NAN)
        curves = [Curve(np.outer(np.linspace(0, n, 9), [0.0, 0.6, 0.8]), np.full(9, 0.02), tip) for n in own]
        found.append([Frame(n, expected_mm=e, curve=c) for n, (e, c) in enumerate(zip(known, curves, strict=True))])
        turns = np.linspace(0.0, rng.uniform(0.1, 2.0), int(rng.integers(2, 12)))
        bend = one_of(rng, 4.0, 10.0, 40.0)
        rough.append(bend * np.column_stack([np.cos(turns), np.sin(turns), 0.1 * turns]))
    return together(
        in_step=("".join(f"{f.status} {f.message} " for f in depths.in_step(frames, 0.3)) for frames in found),
        elsewhere=(
            " ".join(depths.stated_elsewhere(frames, depths.traced_depths(frames, ORIGIN, [0.0, 0.6, 0.8]), 0.17, None))
            for frames in found
        ),
        shrinking=(" ".join(depths.shrinking(frames, 0.3)) for frames in found),
        drawn_back=(" ".join(depths.drawn_back(frames, 0.3)) for frames in found),
        standing=(" ".join(depths.standing(frames, 0.3)) for frames in found),
        rough=(" ".join(own_curves.rough({3: curve}, 0.3, "the traces", "export more")) for curve in rough),
        tips=(own_curves.known_by_tip(curve) for curve in rough),
    )


def compared() -> Numbers:
    """Metrics of wires of all lengths beside traced ones, the shortest ones among them; intervals over insertions."""
    rng, rows, ends = np.random.default_rng(5), [], []
    metrics = {name: metric for name, metric in METRICS.items() if name != "branch_ok"}
    nothing: Any = None
    for _ in range(COUNT // 3):
        arc = np.arange(0.0, one_of(rng, 1.6, 3.0, 4.1, 11.0, 13.0, 30.0), 0.5)
        axis = np.column_stack([0.02 * arc**2, np.sin(arc / 6.0), arc])
        wire, trace = (axis[: len(axis) - one_of(rng, 0, 0, 1)] + 0.3 * rng.standard_normal(3) for _ in range(2))
        wire = wire + 0.02 * rng.standard_normal(wire.shape)
        way = VesselAxis(one_of(rng, axis, axis[: len(axis) // 2 + 1], None), nothing)
        curve = Curve(trace, np.full(len(trace), 0.1), 0.1)
        pair = pair_of(OtherWire(wire, 0.0), curve, nothing, CompareConfig(), way, one_of(rng, 0.0, 0.0, 0.7))
        rows.append([float(measured(name, metric, pair)) for name, metric in metrics.items()])
        ends.append([len(kept := scored(arc, one_of(rng, 0.0, 2.0, 10.0))), kept[0]])
    over = []
    for _ in range(COUNT // 3):
        count = int(rng.integers(1, 9))
        sums, points = np.exp(rng.normal(0.0, 1.5, (2, count))), rng.integers(1, 9, count).astype(float)
        sums[:, 0] *= one_of(rng, 1.0, 1.0, 0.0)
        series = [np.cumsum(rng.standard_normal(rng.integers(2, 9))) for _ in range(count)]
        told = intervals.of_medians([np.abs(own) for own in series])
        over.append([*intervals.of_log_ratio(*sums, points), *told, intervals.effective_frames(series)])
    columns = np.array(over)
    of_metrics = dict(zip(metrics, np.transpose(rows), strict=True))
    words = [intervals.in_words(low, high, one_of(rng, "", "wide")) for low, high in columns[:, :2]]
    return {
        **{name: [*digest(values), np.isfinite(values).mean()] for name, values in of_metrics.items()},
        "scored": np.transpose(ends).ravel(),
        "intervals": [[*digest(row), np.isfinite(row).mean()] for row in columns.T],
        **together(words=words, notes=map(intervals.note, range(1, 9))),
    }


SCENES: dict[str, Scene] = {
    "verdicts": verdicts,
    "wires": wires,
    "cases": cases,
    "lengths": lengths,
    "compared": compared,
}
