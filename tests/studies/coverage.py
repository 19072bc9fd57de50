"""Which scene tries which stage: the matrix that a test prints and checks for holes."""

from __future__ import annotations

from collections.abc import Mapping

STAGES = ("load", "segment", "trace", "simulate", "compare", "report")

TRIED: Mapping[str, tuple[str, ...]] = {
    "straight": ("simulate", "compare", "report"),
    "bend": ("segment", "trace", "simulate", "compare", "report"),
    "s-curve": ("simulate",),
    "helix": ("trace", "simulate"),
    "rough-wall": ("simulate",),
    "bifurcation": ("segment", "simulate", "compare"),
    "bifurcation-left": ("simulate", "compare"),
    "rolled": ("simulate",),
    "short-wire": ("trace", "simulate", "compare"),
    "stenosis": ("segment", "simulate"),
    "aneurysm-neck": ("segment", "simulate"),
    "aneurysm-loop": ("trace", "simulate"),
    "kissing-vessels": ("segment", "simulate"),
    "bone-wall": ("segment", "trace"),
    "missing-wire": ("trace", "report"),
    "two-wires": ("trace", "report"),
    "introducer": ("trace", "compare"),
    "moved-phantom": ("segment", "trace", "report"),
    "anisotropic": ("load", "segment", "trace"),
    "oblique": ("load", "segment", "trace", "compare"),
    "low-dose": ("segment", "trace"),
    "washed-out": ("segment", "trace"),
    "circle-of-willis": ("load", "segment", "trace", "simulate", "compare", "report"),
    "siphon": ("simulate", "compare"),
    "incomplete-circle": ("segment", "simulate"),
    "acoa-aneurysm": ("simulate", "compare"),
    "tortuous-vertebral": ("segment", "simulate"),
}
"""Stages that a scene was made to try; every scene runs through all of them."""


def matrix() -> str:
    """Scenes against stages as text."""
    width = max(map(len, TRIED))
    head = " " * width + "  " + "  ".join(STAGES)
    rows = [
        f"{name:{width}s}  " + "  ".join(("x" if s in tried else ".").center(len(s)) for s in STAGES)
        for name, tried in TRIED.items()
    ]
    return "\n".join([head, *rows])
