"""Finished stretches on disk: arrays in files whose names change with all that they depend on.

A file is there whole or not at all, so that whatever dies in between, the next run goes on from what is finished.
"""

from __future__ import annotations

import hashlib
import os
import uuid
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..disk import writing
from ..rails import RailLine, Support
from ..raster import TILE, RailRaster
from ..squares.grid import Square
from ..squares.pieces import SquareRails

CORE = Path(__file__).resolve().parent.parent


def fingerprint(*facts: object) -> str:
    """Make a file name of everything that a result depends on."""
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:32]


@lru_cache
def version(weights: Path) -> str:
    """Make a name of the code and of the network's weights: stretches of another version are not taken for own ones."""
    files = [*sorted(CORE.rglob("*.py")), weights]
    return fingerprint(*(file.read_bytes() for file in files))


def save_raster(path: Path, raster: RailRaster) -> None:
    """Write a raster that lies at the origin of its stretch."""
    index = np.array(sorted(raster.tiles), dtype=np.int32).reshape(-1, 2)
    bits = [np.packbits(raster.tiles[place]) for place in map(tuple, index.tolist())]
    _save(path, index=index, bits=np.array(bits, dtype=np.uint8).reshape(-1, TILE * TILE // 8), cell_m=raster.cell_m)


def load_raster(path: Path) -> RailRaster:
    """Read what `save_raster` wrote."""
    with np.load(path, allow_pickle=False) as held:
        bits = np.unpackbits(held["bits"], axis=1).astype(bool).reshape(-1, TILE, TILE)
        tiles = {(row, column): tile for (row, column), tile in zip(held["index"].tolist(), bits)}
        return RailRaster(tiles, float(held["cell_m"]), 0.0, 0.0)


def save_rails(path: Path, found: SquareRails) -> None:
    """Write the rails of a stretch."""
    rails = found.rails
    supports = [rail.support or Support(np.empty(0), np.empty(0), np.empty(0)) for rail in rails]
    _save(
        path,
        nodes=found.nodes,
        figures=np.array([(r.class_code, r.points, r.resid_mm, r.sigma_mm, r.bridged_m) for r in rails]).reshape(-1, 5),
        **_packed("xyz", [rail.xyz for rail in rails], 3),
        **_packed("gaps", [rail.gaps for rail in rails], 2),
        **_packed("support", [np.column_stack([one.t, one.points, one.sigma_m]) for one in supports], 3),
    )


def load_rails(path: Path, square: Square) -> SquareRails:
    """Read what `save_rails` wrote of a stretch."""
    with np.load(path, allow_pickle=False) as held:
        parts = zip(held["figures"].tolist(), *(_unpacked(held, name) for name in ("xyz", "gaps", "support")))
        rails = [
            RailLine(xyz, 0, int(code), points, resid, sigma, bridged, gaps, Support(*support.T))
            for (code, points, resid, sigma, bridged), xyz, gaps, support in parts
        ]
        return SquareRails(square, tuple(_whole(rail) for rail in rails), held["nodes"])


def _whole(rail: RailLine) -> RailLine:
    """Give a rail from a file the types it had: whole numbers are counts, and no stations mean no support."""
    points = int(rail.points) if rail.points == int(rail.points) else rail.points
    return replace(rail, points=points, support=rail.support if len(rail.support.t) else None)


def _packed(name: str, arrays: Sequence[np.ndarray], columns: int) -> dict[str, np.ndarray]:
    """Lay arrays end to end, for files hold no lists."""
    whole = np.concatenate(arrays) if arrays else np.empty((0, columns))
    return {name: whole, f"{name}_counts": np.array([len(one) for one in arrays], dtype=np.int64)}


def _unpacked(held: np.lib.npyio.NpzFile, name: str) -> list[np.ndarray]:
    """Part again what `_packed` laid together."""
    counts = held[f"{name}_counts"]
    return np.split(held[name], np.cumsum(counts)[:-1]) if len(counts) else []


def _save(path: Path, **arrays: np.ndarray) -> None:
    """Write arrays under another name first: a full disk or a killed worker leaves no half of a file."""
    unfinished = path.with_name(f"{uuid.uuid4().hex}.unfinished")
    with writing(path.parent):
        try:
            with unfinished.open("wb") as file:
                np.savez_compressed(file, **arrays)
                file.flush()
                os.fsync(file.fileno())  # else a file may have its name and be empty after a power cut
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)
