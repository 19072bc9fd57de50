"""How far the truth can be trusted, scene by scene: ``python -m tests.studies.truth [NAME ...]`` (make truth).

Every scene's insertion is replayed twice from the entry, its own history each time, on nodes ``--step`` mm apart and on
nodes half as far apart. Prints how far any point of any frame lies from its double at equal arc length.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray

from data_synthetic import catalogue
from data_synthetic.catalogue.scene import Setup
from data_synthetic.rod.replay import TrueFrame, replay
from data_synthetic.rod.truth import at_step

Array = NDArray[np.float64]
ALLOWED_MM = 0.01
FRAMES, SEED, STEP_MM = 6, 100, 0.2
PLACES = 800
BACKGROUND_VOXEL_MM = 0.5  # of the real scan, whose own spacing is a placeholder


def apart(a: TrueFrame, b: TrueFrame) -> float:
    """Largest distance at equal arc length, mm."""
    places = np.linspace(0.0, a.depth_mm, PLACES)
    return float(np.max(np.linalg.norm(at_arc(a, places) - at_arc(b, places), axis=1)))


def at_arc(frame: TrueFrame, places: Array) -> Array:
    """Points at shares of the wire's own length: it stretches by a millionth."""
    edges = np.linalg.norm(np.diff(frame.points_mm, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(edges)])
    return np.column_stack([np.interp(places * arc[-1] / frame.depth_mm, arc, frame.points_mm[:, a]) for a in range(3)])


def scene_setup(name: str, seed: int, frames: int) -> Setup:
    """A scene's set-up, or that of a wire in a real scan where the name is a file."""
    rng = np.random.default_rng([seed, 1])
    if Path(name).suffix:
        return catalogue.background_scene(name, BACKGROUND_VOXEL_MM).setup(rng, 2 * frames)
    scene = catalogue.describe(name)
    return scene.setup(rng, min(frames, scene.frames))


def halved(name: str, setup: Setup, step_mm: float) -> tuple[str, float, bool]:
    """The scene's line, the largest distance, and whether it has friction."""
    step = min(step_mm, min(setup.depths_mm) / 8.0)
    clock = process_time()
    coarse, fine = (
        list(replay(at_step(setup.insertion(), h), setup.depths_mm, setup.rolls_deg)) for h in (step, 0.5 * step)
    )
    moves = [apart(a, b) for a, b in zip(coarse, fine, strict=True)]
    worst = int(np.argmax(moves))
    line = (
        f"{name:20s}{step:8.2f}{len(moves):8d}{moves[worst]:12.4f}{coarse[worst].depth_mm:12.1f}"
        f"{max(f.jump_mm for f in fine):12.2f}{max(f.residual_N for f in coarse + fine):12.1e}"
        f"{setup.friction:10.2f}{process_time() - clock:9.1f}"
    )
    return line, moves[worst], setup.friction > 0


def main(words: list[str]) -> None:
    """Print the table; exit 1 where a frictionless scene moves by more than is allowed."""
    parser = argparse.ArgumentParser(prog="python -m tests.studies.truth", description=__doc__)
    parser.add_argument("names", nargs="*", help="scenes (all of them without), or volume files for a real background")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--step", type=float, default=STEP_MM)
    parser.add_argument("--frames", type=int, default=FRAMES)
    args = parser.parse_args(words)
    heads = ("step mm", "frames", "moves mm", "at depth", "tip jump", "residual N", "friction", "cpu s")
    widths = (8, 8, 12, 12, 12, 12, 10, 9)
    sys.stdout.write(f"{'':20s}" + "".join(f"{h:>{w}s}" for h, w in zip(heads, widths, strict=True)) + "\n")
    bad = []
    for name in args.names or catalogue.names():
        line, moves, rubs = halved(Path(name).name, scene_setup(name, args.seed, args.frames), args.step)
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
        if moves > ALLOWED_MM and not rubs:
            bad.append(name)
    sys.stdout.write(f"moved by more than {ALLOWED_MM} mm: {', '.join(bad) or 'none'}\n")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main(sys.argv[1:])
