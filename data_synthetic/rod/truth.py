"""The true wire of a study, on nodes so close that halving their spacing moves nothing, and how far to trust it."""

import contextlib
import hashlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from data_synthetic._compile import hash_of
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.rod.replay import TrueFrame, TrueInsertion, halving_moves, replay


def cached_replay(
    insertion: TrueInsertion, depths_mm: Sequence[float], roll_deg: Sequence[float]
) -> tuple[TrueFrame, ...]:
    """``replay``, or what it gave before for the same input and the same code. Any fault of the cache is a miss."""
    if not isinstance(insertion.wall, Anatomy):
        return tuple(replay(insertion, depths_mm, roll_deg))
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    path = Path(base) / "wireval" / "truth" / f"{_key(insertion, depths_mm, roll_deg)}.npz"
    try:
        return _read(path)
    except Exception:  # zipfile and zlib have errors of their own
        frames = tuple(replay(insertion, depths_mm, roll_deg))
    with contextlib.suppress(OSError):  # a read-only home is no reason to fail
        _write(path, frames)
    return frames


def _key(insertion: TrueInsertion, depths_mm: Sequence[float], roll_deg: Sequence[float]) -> str:
    """Hash of the code behind ``replay`` and of everything that it is called with."""
    digest = hashlib.sha256(hash_of(Path(replay.__code__.co_filename)).encode())
    given: dict[str, Any] = {**vars(insertion), "depths_mm": depths_mm, "roll_deg": roll_deg}
    for name, value in given.items():
        digest.update(name.encode())
        if isinstance(value, Anatomy):
            digest.update(b"".join(np.ascontiguousarray(table).tobytes() for table in value.tables))
        elif isinstance(value, np.ndarray):
            digest.update(value.tobytes())
        else:
            digest.update(repr(value).encode())
    return digest.hexdigest()[:32]


def _write(path: Path, frames: Sequence[TrueFrame]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".{os.getpid()}.npz")
    np.savez(partial, **{f"{i}.{k}": v for i, frame in enumerate(frames) for k, v in vars(frame).items()})
    partial.replace(path)


def _read(path: Path) -> tuple[TrueFrame, ...]:
    frames: dict[str, dict[str, Any]] = {}
    with path.open("rb") as file, np.load(file) as data:  # numpy leaves a broken one open
        for key, value in data.items():
            number, _, name = key.partition(".")
            frames.setdefault(number, {})[name] = value if value.ndim else value.item()
    return tuple(TrueFrame(**fields) for fields in frames.values())


LONGEST_ADVANCE_MM = 0.4
"""Insertion between two equilibria: a tip cannot pass a wall of 1 mm unseen, and smaller steps change nothing."""
TRUTH_STEP_MM, MOST_HALVINGS, CONVERGED_MM = 0.2, 2, 0.01
"""The true wire's first node spacing, how often it is halved at most, and the move up to which it is close enough."""
TRIED = 7
"""Frames of a study on which halving is tried."""


def at_step(insertion: TrueInsertion, step_mm: float) -> TrueInsertion:
    """The insertion computed with that node spacing."""
    return replace(insertion, step_mm=step_mm, advance_mm=max(step_mm, LONGEST_ADVANCE_MM))


def converged_truth(
    insertion: TrueInsertion, depths_mm: Sequence[float], rolls_deg: Sequence[float], step_mm: float | None = None
) -> tuple[tuple[TrueFrame, ...], dict[str, float]]:
    """The true wire at every depth, and its quality; nodes are put closer until halving them moves nothing.

    step_mm : a node spacing that is taken as it is, for tests that need no converged truth.
    """
    step, left = step_mm or TRUTH_STEP_MM, 0 if step_mm else MOST_HALVINGS
    while True:
        # the shortest wire still gets eight steps
        fine = at_step(insertion, min(step, min(depths_mm) / 8.0))
        truth = cached_replay(fine, depths_mm, rolls_deg)
        quality = truth_quality(fine, truth)
        if quality["halving_moves_mm"] <= CONVERGED_MM or not left:
            return truth, quality
        step, left = 0.5 * step, left - 1


def truth_quality(insertion: TrueInsertion, truth: tuple[TrueFrame, ...]) -> dict[str, float]:
    """Figures that tell how far the truth can be trusted; halving is tried on a few frames, the last among them."""
    tried = {round(i) for i in np.linspace(0, len(truth) - 1, min(len(truth), TRIED))}
    return {
        "node_spacing_mm": insertion.step_mm,
        "largest_residual_N": max(f.residual_N for f in truth),
        "halving_moves_mm": max(halving_moves(insertion, truth[i]) for i in tried),
        "largest_tip_jump_mm": max(f.jump_mm for f in truth),
        "largest_contact_N": max(float(np.linalg.norm(f.contact_N, axis=1).max()) for f in truth),
        "newton_iterations": float(sum(f.iterations for f in truth)),
    }
