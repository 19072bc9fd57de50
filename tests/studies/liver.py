"""37 real X-ray frames of a catheter in a liver artery, and a wire simulated in the tree that was seen before.

    WIREVAL_DATA=... python -m tests.studies.liver FOLDER      (make liver)
writes FOLDER/vessel.swc, projections.json and manifest.toml, runs it and prints the table. The hand-drawn aorta (a
placeholder of one radius) is left out: the wire enters where vessels that were seen begin. The vessel is fixed before
anything is scored: from the authors' node 294 on towards the end that the last frame's tip is nearest to. A frame's
depth is where its tip lies along that vessel, as in three dimensions it is the traced length. The authors' radii are
rough (1.0 and 2.0 mm in turn) and would catch any tip: they are smoothed along the vessel. Side branches are closed.
"""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.arrays.polyline import at_arc, smooth
from pipeline.cli import main as wireval
from pipeline.compare.metrics import point_to_curve
from pipeline.compare.views import Screen, screen_of, shift_of
from pipeline.model import Array, arc_length

PLACEHOLDER_VOXELS, KNOWN_NODE, SMOOTH_MM, SCATTER_MM, INTO_MM = 10.0, 294, 8.0, 0.5, 3.0
WIRE = """schema = 1
[wires.micro]                              # a soft wire; the real one, and its roll, are not known
radius_mm = 0.18
bending_stiffness_N_mm2 = [[0.0, 0.5], [30.0, 2.5], [80.0, 8.0]]

[[case]]
id = "liver"
lumen = "vessel.swc"
projections = "projections.json"
wire = "micro"
entry_sigma_mm = 0.0
entry_direction_sigma_deg = 0.0
entry_mm = {entry}
entry_direction = {direction}
insertion_mm = {depths}
"""


def numbers(path: Path, head: str, rows: int) -> Array:
    """The matrix below a comment line of an info file."""
    lines = path.read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if head in line) + 1
    return np.array([[float(x) for x in line.split()] for line in lines[start : start + rows]])


class Tree:
    """Nodes (n, 3) in mm, radii (n,) in mm, neighbours by node, and the parent of each node seen from the root."""

    def __init__(self, folder: Path) -> None:
        lines = next(folder.glob("*vesselsStructCenterline.txt")).read_text(encoding="utf-8").splitlines()
        rows = lines[2 : 2 + 2 * int(lines[0])]
        table = np.array([[float(x) for x in row.strip(" ;").split(";")[:7]] for row in rows[::2]])
        to_mm = numbers(next(folder.glob("*info.txt")), "PixelToMM", 4)
        self.points = table[:, :3] @ to_mm[:3, :3].T + to_mm[:3, 3]
        self.placeholder = table[:, 6] == PLACEHOLDER_VOXELS
        self.radii = table[:, 6] * float(np.cbrt(abs(np.linalg.det(to_mm[:3, :3]))))
        self.beside = [[int(x) for x in re.findall(r"\d+", row)] for row in rows[1::2]]
        self.parent = {0: -1}
        for node in (order := [0]):
            for other in self.beside[node]:
                if other not in self.parent:
                    self.parent[other] = node
                    order.append(other)

    def way(self, node: int) -> list[int]:
        """Nodes from the root to a node."""
        found = [node]
        while self.parent[found[-1]] >= 0:
            found.append(self.parent[found[-1]])
        return found[::-1]

    def leaves(self) -> list[int]:
        """Ends beyond the known node."""
        ends = set(self.parent) - set(self.parent.values())
        return [end for end in sorted(ends) if KNOWN_NODE in self.way(end)]


def projection(folder: Path) -> Array:
    """The authors' matrix (3, 4) from the tree's mm to pixels, their shift of the tree with it."""
    file = folder / "fluoro" / "infoFluoroTransformations.txt"
    pixel, arm, pinhole = (numbers(file, head, 4) for head in ("PixelToMM", "WorldToCArm", "CArmProjection"))
    shift = numbers(next((folder / "fusion").glob("*.txt")), "RigidTransform3DInWorldCS", 4)
    return np.diag([1 / pixel[0, 0], 1 / pixel[1, 1], 1.0]) @ pinhole[[0, 1, 3]] @ arm @ shift


def depth_of(screen: Screen, path: Array) -> float:
    """Where along a vessel the wire's tip lies: the vessel's beginning to there is shifted as any wire would be."""
    length = depth = float(arc_length(path)[-1])
    for _ in range(20):
        part = at_arc(path, np.append(np.arange(0.0, depth, 0.5), depth))
        seen = screen.flat(path) + shift_of(screen, part, True)
        foot = float(point_to_curve(screen.curve_mm[-1:], seen)[1][0])
        depth = min(float(np.interp(foot, arc_length(seen), arc_length(path))), length)
    return depth


def along(tree: Tree, way: list[int], path: Array) -> tuple[Array, Array]:
    """Where on a smoothed path the nodes of a way lie, and their radii; both (n,)."""
    place = np.maximum.accumulate(point_to_curve(tree.points[way], path)[1])
    return place, tree.radii[way]


def prepared(data: Path, folder: Path) -> Path:
    """The study's files; the manifest."""
    tree, matrix = Tree(data / "3dra"), projection(data)
    curves = [np.loadtxt(p)[::-1] for p in sorted((data / "fluoro" / "centerlines").glob("*.txt"))]
    source = -np.linalg.inv(matrix[:, :3]) @ matrix[:, 3]
    axis = matrix[2, :3] / np.linalg.norm(matrix[2, :3])
    middle = tree.points[~tree.placeholder].mean(axis=0)
    centre = source + 810.0 * axis * np.sign((middle - source) @ axis)
    screens = [screen_of(matrix, centre, curve) for curve in curves]

    def path_of(leaf: int) -> tuple[list[int], Array]:
        way = [node for node in tree.way(leaf) if not tree.placeholder[node]]
        # nodes scatter by a voxel: along a zigzag every depth would be too deep
        return way, smooth(tree.points[way], SCATTER_MM)

    def missed(leaf: int) -> float:
        path, screen = path_of(leaf)[1], screens[-1]
        part = at_arc(path, np.arange(0.0, depth_of(screen, path), 0.5))
        seen = screen.flat(part) + shift_of(screen, part, True)
        return float(np.linalg.norm(seen[-1] - screen.curve_mm[-1]))

    leaves = {leaf: missed(leaf) for leaf in tree.leaves()}
    leaf = min(leaves, key=lambda one: leaves[one])
    way, path = path_of(leaf)
    print(
        f"{len(leaves)} ends beyond node {KNOWN_NODE}; taken: {leaf} ({leaves[leaf]:.1f} mm from the last frame's tip)"
    )
    start = at_arc(path, np.array([INTO_MM, INTO_MM + 2.0]))
    depths = [round(depth_of(screen, path) - INTO_MM, 2) for screen in screens]
    folder.mkdir(parents=True, exist_ok=True)
    arc, radii = arc_length(path), np.interp(arc_length(path), *along(tree, way, path))
    calm = [float(np.quantile(radii[np.abs(arc - here) <= SMOOTH_MM], 0.25)) for here in arc]
    rows = [[n + 1, 3, *path[n].round(4), round(calm[n], 4), n if n else -1] for n in range(len(path))]
    (folder / "vessel.swc").write_text("".join(" ".join(map(str, row)) + "\n" for row in rows), encoding="utf-8")
    views: dict[str, Any] = {"isocentre_mm": centre.tolist(), "leaf_mm": tree.points[leaf].tolist()}
    views["frames"] = [{"matrix": matrix.tolist(), "points_px": curve.tolist()} for curve in curves]
    (folder / "projections.json").write_text(json.dumps(views), encoding="utf-8")
    direction = (start[1] - start[0]) / np.linalg.norm(start[1] - start[0])
    text = WIRE.format(entry=start[0].round(3).tolist(), direction=direction.round(5).tolist(), depths=depths)
    (folder / "manifest.toml").write_text(text, encoding="utf-8")
    return folder / "manifest.toml"


def main() -> int:
    folder = Path(sys.argv[1])
    manifest = prepared(Path(os.environ["WIREVAL_DATA"]) / "liver_xray_wire", folder)
    code = wireval(["run", str(manifest), "-o", str(folder / "out"), "--resume"])
    case = folder / "out" / "cases" / "liver"
    result = json.loads((case / "result.json").read_text(encoding="utf-8"))
    errors = pd.read_csv(case / "errors.csv")
    print(errors[["frame", "status", "insertion_mm", "rms_mm", "p95_mm", "distal10_rms_mm", "tip_mm"]].to_string())
    summary = result["summary"]
    good = f"{summary['frames_ok']} of {summary['frames']} frames"
    print(f"{good}; the simulated wire's last 40 mm: {summary.get('rms_mm')} mm rms")
    print(result["chosen"].get("label", "not limited by registration"))
    return code


if __name__ == "__main__":
    sys.exit(main())
