"""Frames whose curves are doubted as tracing doubts them: the stages are asked, with pictures made up for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from pipeline.model import Curve, Lumen
from pipeline.run.stages.known import Frame
from pipeline.run.stages.thickness import not_too_thick
from pipeline.trace.steps import Steps
from pipeline.trace.whose_end import of_one_device, of_one_line
from solver.grid import Grid

IMAGE: Any = SimpleNamespace(voxel=0.3, modelled=False, noise_in=lambda _: 0.01)


def frames(lengths: list[float], expected: list[float]) -> list[Frame]:
    curves = [
        Curve(np.stack([np.zeros(9), np.zeros(9), np.linspace(0, n, 9)], 1), np.full(9, 0.02), 0.05) for n in lengths
    ]
    return [Frame(i, expected_mm=e, curve=c) for i, (e, c) in enumerate(zip(expected, curves, strict=True))]


def dim(lengths: list[float], from_tip: list[float], then: Callable[[Curve], Curve] = lambda c: c) -> list[Frame]:
    """Frames whose dim ends may be a catheter's, as tracing doubts them, and what is asked of their curves then."""
    out = []
    for frame, end in zip(frames(lengths, [float("nan")] * len(lengths)), from_tip, strict=True):
        assert frame.curve is not None
        steps = Steps(np.array([1.0 - end / frame.curve.length_mm]), np.array([1.0, 0.3]))
        tube: Any = SimpleNamespace(steps=steps, length_mm=frame.curve.length_mm)
        out.append(frame.traced_by(then(of_one_device(IMAGE, tube, frame.curve))))
    return out


def with_gap(curve: Curve, beyond_mm: float, gap_mm: float = 3.0) -> Curve:
    """The curve with a gap, and what is doubted of it where so much of it lies beyond that."""
    arc = np.linspace(0.0, curve.length_mm, round(10.0 * curve.length_mm) + 1)
    from_tip = curve.length_mm - arc
    dark = (from_tip > beyond_mm + 1e-6) & (from_tip < beyond_mm + gap_mm)
    return of_one_line(IMAGE, curve, (arc, np.where(dark, 0.2, 1.0)))


def thick(curve: Curve, blur_mm: float) -> Curve:
    """The curve of a line that looks so wide, judged beside a wire of 0.18 mm radius."""
    vessel = Lumen(Grid(np.zeros((4, 4, 4)), np.full(3, 0.3)), levels={"scanner_blur_mm": 0.25})
    return not_too_thick(replace(curve, levels={**curve.levels, "blur_mm": blur_mm}), vessel, 0.18)
