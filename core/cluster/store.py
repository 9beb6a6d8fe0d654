"""Results of tasks in files whose names change with everything that the results depend on.

A file is complete or does not exist: after any interruption, the next run continues with the finished results.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..disk import writing
from ..frame import LocalFrame
from ..frpdf.models import MODELS
from ..rails import RailLine, Support
from ..raster import TILE, RailRaster
from ..scratch import scratch_folder
from ..squares.grid import Square
from ..squares.pieces import SquareRails
from ..squares.spool import SpooledPoints

CORE = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Stored:
    """A result in a file."""

    path: str


@lru_cache
def version() -> str:
    """Fingerprint of the code and of all weights: results of another version are not used."""
    files = [*sorted(CORE.rglob("*.py")), *(model.path for model in MODELS)]
    return fingerprint(*(file.read_bytes() for file in files))


def fingerprint(*facts: Any) -> str:
    """Return a file name that depends on numbers, texts, arrays, dataclasses and collections of these."""
    digest = hashlib.sha256()
    for part in _parts(facts):
        digest.update(part)
        digest.update(b"\0")
    return digest.hexdigest()[:32]


def _parts(fact: Any) -> Iterable[bytes]:
    """Yield what identifies a fact."""
    if isinstance(fact, np.ndarray):
        yield f"{fact.shape} {fact.dtype}".encode()
        yield fact.tobytes()
    elif isinstance(fact, bytes):
        yield fact
    elif callable(fact):
        yield fact.__qualname__.encode()
    elif isinstance(fact, Stored):
        yield Path(fact.path).name.encode()
    elif isinstance(fact, SpooledPoints):
        # The folders of the points are named after size and time of the files that the points come from.
        yield from _parts(sorted(Path(file).parts[-2:] for files in fact.files.values() for file in files))
        yield from _parts(fact.passes)
    elif is_dataclass(fact):
        for field in fields(fact):
            yield from _parts(getattr(fact, field.name))
    elif isinstance(fact, Mapping):
        yield from _parts(sorted((fingerprint(name), fingerprint(value)) for name, value in fact.items()))
    elif isinstance(fact, (list, tuple)):
        yield f"{len(fact)}".encode()
        for one in fact:
            yield from _parts(one)
    else:
        yield repr(fact).encode()


def can_store(result: Any) -> bool:
    """Return whether `save` accepts a result: a raster, the rails of a square, or a tuple of rails."""
    of_rails = isinstance(result, tuple) and all(isinstance(one, RailLine) for one in result)
    return isinstance(result, (RailRaster, SquareRails)) or of_rails


def save(path: Path, result: RailRaster | SquareRails | tuple[RailLine, ...]) -> None:
    """Write a result.

    Raises
    ------
    DiskError
    """
    if isinstance(result, RailRaster):
        _write(path, _raster_arrays(result))
    elif isinstance(result, SquareRails):
        more = {"nodes": result.nodes, "strip_rows": result.strips}
        _write(path, {**_rail_arrays(result.rails), **_square_arrays(result.square), **more})
    else:
        _write(path, _rail_arrays(result))


class DamagedError(Exception):
    """A file does not hold what `save` wrote."""


def load(stored: Stored) -> RailRaster | SquareRails | tuple[RailLine, ...]:
    """Read what `save` wrote.

    Raises
    ------
    DamagedError
    """
    try:
        with np.load(stored.path, allow_pickle=False) as arrays:
            if "bits" in arrays:
                return _raster(arrays)
            rails = _rails(arrays)
            if "nodes" not in arrays:
                return rails
            return SquareRails(_square(arrays), rails, arrays["nodes"], arrays["strip_rows"])
    except Exception as error:  # damage shows as an error of the file, of the compression or of the arrays
        raise DamagedError(f"{Path(stored.path).name} is damaged ({error})") from error


def _raster_arrays(raster: RailRaster) -> dict[str, np.ndarray]:
    index = np.array(sorted(raster.tiles), dtype=np.int32).reshape(-1, 2)
    bits = [np.packbits(raster.tiles[place]) for place in sorted(raster.tiles)]
    return {
        "index": index,
        "bits": np.array(bits, dtype=np.uint8).reshape(-1, TILE * TILE // 8),
        "grid": np.array([raster.cell_m, raster.x0, raster.y0]),
    }


def _raster(arrays: Mapping[str, np.ndarray]) -> RailRaster:
    bits = np.unpackbits(arrays["bits"], axis=1).astype(bool).reshape(-1, TILE, TILE)
    tiles = {(row, column): tile for (row, column), tile in zip(arrays["index"].tolist(), bits)}
    return RailRaster(tiles, *arrays["grid"].tolist())


def _square_arrays(square: Square) -> dict[str, np.ndarray]:
    frame = square.frame
    return {
        "key": np.array(square.key),
        "frame": np.array([*frame.origin, frame.horizontal_unit_m, frame.vertical_unit_m, square.side_m]),
        "crs": np.array(frame.crs_wkt or ""),
    }


def _square(arrays: Mapping[str, np.ndarray]) -> Square:
    column, row = arrays["key"].tolist()
    *origin, horizontal_m, vertical_m, side_m = arrays["frame"].tolist()
    frame = LocalFrame(np.array(origin), horizontal_m, vertical_m, str(arrays["crs"]) or None)
    return Square((column, row), frame, side_m)


def _rail_arrays(rails: Sequence[RailLine]) -> dict[str, np.ndarray]:
    supports = [rail.support or Support(np.empty(0), np.empty(0), np.empty(0)) for rail in rails]
    figures = [(r.rail_id, r.class_code, r.points, r.resid_mm, r.sigma_mm, r.bridged_m, r.sigmaz_mm) for r in rails]
    return {
        "figures": np.array(figures, dtype=float).reshape(-1, 7),
        **_packed("xyz", [rail.xyz for rail in rails], 3),
        **_packed("gaps", [rail.gaps for rail in rails], 2),
        **_packed("support", [np.column_stack([one.t, one.points, one.sigma_m, one.heights_m]) for one in supports], 4),
        **_packed("strips", [np.empty((0, 3)) if one.strips is None else one.strips for one in supports], 3),
    }


def _rails(arrays: Mapping[str, np.ndarray]) -> tuple[RailLine, ...]:
    names = ("xyz", "gaps", "support", "strips")
    return tuple(_rail(*one) for one in zip(arrays["figures"].tolist(), *(_unpacked(arrays, name) for name in names)))


def _rail(
    figures: Sequence[float], xyz: np.ndarray, gaps: np.ndarray, support: np.ndarray, strips: np.ndarray
) -> RailLine:
    rail_id, class_code, points, resid_mm, sigma_mm, bridged_m, sigmaz_mm = figures
    t, shown, sigma_m, sigmaz_m = support.T
    return RailLine(
        xyz,
        int(rail_id),
        int(class_code),
        int(points) if points == int(points) else points,  # the points of a whole rail are a count; a piece has a share
        resid_mm,
        sigma_mm,
        bridged_m,
        gaps,
        Support(t, shown, sigma_m, strips if len(strips) else None, sigmaz_m) if len(support) else None,
        sigmaz_mm=sigmaz_mm,
    )


def _packed(name: str, arrays: Sequence[np.ndarray], columns: int) -> dict[str, np.ndarray]:
    """Concatenate arrays, because a file holds no lists."""
    whole = np.concatenate(arrays) if arrays else np.empty((0, columns))
    return {name: whole, f"{name}_counts": np.array([len(one) for one in arrays], dtype=np.int64)}


def _unpacked(arrays: Mapping[str, np.ndarray], name: str) -> list[np.ndarray]:
    """Separate what `_packed` concatenated."""
    counts = arrays[f"{name}_counts"]
    return np.split(arrays[name], np.cumsum(counts)[:-1]) if len(counts) else []


def _write(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays in a temporary folder first, so that a full disk or a killed worker leaves no incomplete file."""
    with writing(path.parent), scratch_folder(path.parent) as scratch:
        unfinished = scratch / path.name
        with unfinished.open("xb") as file:
            np.savez_compressed(file, **arrays)
            file.flush()
            os.fsync(file.fileno())  # otherwise the file may be empty after a power cut
        unfinished.replace(path)
