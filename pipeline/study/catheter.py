"""A catheter over the wire: it must be the wider one, and the wire must come out of it."""

from collections.abc import Iterator, Sequence

from pipeline.model import OverWire


def catheter_problems(catheter: OverWire, wire_radius_mm: float, depths_mm: Sequence[float]) -> Iterator[str]:
    """What is wrong with it, a sentence each. depths_mm : of the wire in each frame; empty where none are stated."""
    radius = catheter.radius_mm
    if radius <= wire_radius_mm:
        yield f"catheter radius_mm = {radius:g} is no more than the wire's {wire_radius_mm:g}; a catheter goes over it"
    tips = catheter.insertion_mm
    each = tips if isinstance(tips, tuple) else (tips,) * len(depths_mm)
    for frame, (tip, depth) in enumerate(zip(each, depths_mm, strict=False)):
        if tip > depth:
            what = f"catheter insertion_mm = {tip:g} of frame {frame} is deeper than the wire, {depth:g}"
            yield f"{what}; a wire whose tip lies inside the catheter is not modelled"
