"""The store of stage results: a stage whose inputs and code have not changed is not computed again."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Curve, Lumen
from pipeline.status import FrameStatus
from solver.grid import Grid

Arrays = dict[str, NDArray[Any]]
Packed = tuple[Arrays, dict[str, Any]]
"""Arrays, and a part that JSON can hold."""


def default_root() -> Path:
    """``$WIREVAL_CACHE``, else the user's cache folder."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(os.environ.get("WIREVAL_CACHE") or Path(home) / "wireval" / "stages")


@dataclass(frozen=True)
class Store:
    """Results on disk, one file a key; ``root`` None switches the store off."""

    root: Path | None

    def _path(self, stage: str, key: str) -> Path | None:
        return None if self.root is None else self.root / stage / key[:2] / f"{key}.npz"

    def get(self, stage: str, key: str) -> Lumen | Curve | None:
        """The stored result, or None; a damaged entry counts as absent and is removed."""
        path = self._path(stage, key)
        if path is None or not path.exists():
            return None
        try:
            with np.load(path, allow_pickle=False) as data:
                arrays = {name: data[name] for name in data.files if name != "json"}
                return UNPACK[stage](arrays, json.loads(str(data["json"])))
        except (OSError, ValueError, KeyError, EOFError):
            path.unlink(missing_ok=True)
            return None

    def put(self, stage: str, key: str, result: Lumen | Curve) -> None:
        """Store a result: written beside, then renamed, so that a reader never sees half of it."""
        path = self._path(stage, key)
        if path is None:
            return
        arrays, meta = pack_lumen(result) if isinstance(result, Lumen) else pack_curve(result)
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.stem}.{os.getpid()}.npz")
        with temporary.open("wb") as handle:
            np.savez(handle, json=np.array(json.dumps(meta)), **arrays)  # type: ignore[arg-type]
        temporary.replace(path)

    def entries(self) -> list[Path]:
        """Every stored result."""
        return sorted(self.root.glob("*/??/*.npz")) if self.root and self.root.exists() else []

    def prune(self) -> tuple[int, int]:
        """Remove every result; returns how many and how many bytes."""
        found = self.entries()
        size = sum(p.stat().st_size for p in found)
        for path in found:
            path.unlink(missing_ok=True)
        return len(found), size


def pack_lumen(lumen: Lumen) -> Packed:
    """Arrays and JSON part of a lumen."""
    grid = lumen.distance
    arrays = {
        "distance": grid.values,
        "mask": np.packbits(np.asarray(lumen.mask.values, bool)),
        "spacing": grid.spacing_mm,
        "origin": grid.origin_mm,
        "direction": grid.direction,
    }
    names = ("wall_level", "warnings", "counters", "levels")
    return arrays, {name: getattr(lumen, name) for name in names}


def unpack_lumen(arrays: Arrays, meta: dict[str, Any]) -> Lumen:
    """The inverse of :func:`pack_lumen`."""
    distance = Grid(arrays["distance"], arrays["spacing"], arrays["origin"], arrays["direction"])
    mask = np.unpackbits(arrays["mask"], count=distance.values.size).reshape(distance.shape)
    return Lumen(distance, distance.with_values(mask), **meta | {"warnings": tuple(meta["warnings"])})


def pack_curve(curve: Curve) -> Packed:
    """Arrays and JSON part of a traced curve."""
    arrays = {
        name: np.asarray(getattr(curve, name)) for name in ("points_mm", "sigma_mm", "flagged", "in_plane")
    }
    meta = {name: getattr(curve, name) for name in ("tip_sigma_mm", "note", "counters", "levels")}
    return arrays, meta | {"status": curve.status.name}


def unpack_curve(arrays: Arrays, meta: dict[str, Any]) -> Curve:
    """The inverse of :func:`pack_curve`."""
    fields: dict[str, Any] = {**arrays, **meta, "status": FrameStatus[meta["status"]]}
    return Curve(**fields)


UNPACK: dict[str, Callable[[Arrays, dict[str, Any]], Lumen | Curve]] = {
    "segment": unpack_lumen,
    "trace": unpack_curve,
}
