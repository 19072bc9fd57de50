"""A quick study without scans: the catalogue's bend as a centreline with radius, PyElastica's wires as traces."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from data_synthetic import catalogue
from pipeline.cli import main

Array = NDArray[np.float64]
Known = tuple[Path, list[Array]]
PEERS = Path(__file__).parent / "peer_curves"
QUICK = ("--set", "compare.simulated_nulls=false")
FRAMES = 4
MANIFEST = """schema = 1
[wires.wire]
radius_mm = 0.18
bending_stiffness_N_mm2 = [[0.0, 0.5], [10.0, 0.5], [30.0, 1.5], [80.0, 4.0]]
rest_curvature_per_mm = [[0.0, 0.12], [8.0, 0.12], [8.0, 0.0]]
[[case]]
id = "bend"
entry_mm = [0.3017, 0.0757, -8.2013]
entry_direction = [0.034614, 0.004469, 0.999391]
material_axis = [0.999401, -0.000155, -0.034614]
wire = "wire"
insertion_mm = [8.54, 18.41, 28.76, 38.5]
lumen = "vessel.swc"
traces = "traces/*.csv"
entry_sigma_mm = 0.0
entry_direction_sigma_deg = 0.0
"""


def write_csv(folder: Path, wires: list[Array], head: str = "x_mm,y_mm,z_mm", first: int = 0) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for n, wire in enumerate(wires, first):
        np.savetxt(folder / f"wire_{n:03d}.csv", wire, "%.17g", ",", header=head, comments="")
    return folder


def peers(name: str) -> list[Array]:
    return [np.loadtxt(p, delimiter=",", skiprows=1) for p in sorted((PEERS / name).glob("*.csv"))]


def write_study(folder: Path) -> Path:
    """Its manifest."""
    tube = catalogue.describe("bend").setup(np.random.default_rng(0), FRAMES).anatomy.tubes[0]
    rows = zip(tube.points_mm[::4], tube.radii_mm[::4], strict=True)
    lines = [f"{n + 1} 3 {' '.join(f'{x:.5f}' for x in p)} {r:.5f} {n or -1}" for n, (p, r) in enumerate(rows)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "vessel.swc").write_text("\n".join(lines), encoding="utf-8")
    write_csv(folder / "traces", peers("bend"))
    (folder / "manifest.toml").write_text(MANIFEST, encoding="utf-8")
    return folder / "manifest.toml"


def simulated(out: Path, case: str = "bend") -> list[Array]:
    with h5py.File(out / "cases" / case / "frames.h5") as file:
        return [np.array(file["frames"][n]["simulated_mm"]) for n in sorted(file["frames"])]


def run_known(folder: Path) -> Known:
    """The manifest of a quick study that was run into ``out`` beside it, and the wires of that run."""
    manifest = write_study(folder)
    out = manifest.parent / "out"
    assert main(["run", str(manifest), "-o", str(out), "--until", "compare", *QUICK]) == 0
    return manifest, simulated(out)


def errors_of(out: Path, case: str = "bend") -> pd.DataFrame:
    return pd.read_csv(out / "cases" / case / "errors.csv")
