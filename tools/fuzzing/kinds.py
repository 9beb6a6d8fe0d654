"""Kinds of files that are damaged: how good ones are made, and how a damaged one is read."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .mutators import mutate, mutate_text


@dataclass(frozen=True)
class Kind:
    """A kind of files.

    Attributes
    ----------
    name : str
    make : callable
        Writes good files into a folder, and returns those to be damaged.
    read : callable
        Reads a damaged file. It may raise a `RailExtractError`; everything else is a failure.
    damage : callable
        Changes the bytes of a file.
    needs_qgis : bool
    """

    name: str
    make: Callable[[Path], Sequence[Path]]
    read: Callable[[Path], object]
    damage: Callable[[bytes, random.Random], bytes] = mutate
    needs_qgis: bool = False

    def mutant(self, folder: Path, good: Sequence[Path], seed: int) -> Path:
        """Copy the folder of the good files, damage one of them as a seed says, and return its path.

        Parameters
        ----------
        folder : Path
        good : sequence of Path
            From `make`.
        seed : int
        """
        rng = random.Random(f"{self.name}:{seed}")
        path = rng.choice(list(good))
        copy = folder / "mutant"
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("mutant"))
        damaged = copy / path.relative_to(folder)
        damaged.write_bytes(self.damage(path.read_bytes(), rng))
        return damaged


def _read_cloud(path: Path) -> None:
    """Read rail points; those that are read must be numbers."""
    import numpy as np
    from rail_extract.core.clouds.points import read_rail_points

    for points in read_rail_points(path, [10]):
        if not (len(points.xyz) and np.isfinite(points.xyz).all()):
            raise AssertionError("points that are not numbers")


def _make_weights(folder: Path) -> list[Path]:
    from rail_extract.core.frpdf.models import MODELS

    return [Path(shutil.copy(MODELS[0].path, folder / "weights.npz"))]


def _read_weights(path: Path) -> None:
    from rail_extract.core.frpdf.folding import fold
    from rail_extract.core.frpdf.weights import load_arrays

    fold(load_arrays(path))


SPOOL_SIDE_M = 100.0


def _make_spool(folder: Path) -> list[Path]:
    """Sort a cloud into squares on disk."""
    from .clouds import write_las

    cloud = write_las(folder)[-1]
    (folder / "work").mkdir()
    _spooled(cloud, folder / "work")
    return sorted(path for path in (folder / "work").rglob("*") if path.is_file())


def _read_spool(path: Path) -> None:
    """Continue with the damaged folder of an earlier run: the result must be that of a new folder."""
    work = next(parent for parent in path.parents if parent.name == "work")
    (points,) = _spooled(work.parent.parent / "1.4_7.las", work)
    if sum(points.counts.values()) != 300:
        raise AssertionError(f"{sum(points.counts.values())} points instead of 300")


def _spooled(cloud: Path, folder: Path) -> Sequence:
    from rail_extract.core.clouds.points import ask
    from rail_extract.core.squares.spool import spool

    return spool(ask(cloud, [10]), SPOOL_SIDE_M, folder)


def _make_stored(folder: Path) -> list[Path]:
    """Store the raster and the rails of a square."""
    import numpy as np
    from rail_extract.core.cluster.store import save
    from rail_extract.core.frame import LocalFrame
    from rail_extract.core.rails import RailLine
    from rail_extract.core.raster import rasterize
    from rail_extract.core.squares.grid import Square
    from rail_extract.core.squares.pieces import SquareRails

    xyz = np.random.default_rng(0).uniform(0, 20, (500, 3))
    rail = RailLine(xyz, 1, 10, points=500, resid_mm=1.0, sigma_mm=1.0, bridged_m=0.0)
    square = Square((0, 0), LocalFrame(np.zeros(3)), 100.0)
    save(folder / "raster.npz", rasterize(xyz, 0.04))
    save(folder / "rails.npz", SquareRails(square, (rail,), xyz[:3, :2]))
    return [folder / "raster.npz", folder / "rails.npz"]


def _read_stored(path: Path) -> None:
    """Load a result as the runner does: it computes what is damaged again."""
    from rail_extract.core.cluster.store import DamagedError, Stored, load
    from rail_extract.core.errors import RailExtractError

    try:
        load(Stored(str(path)))
    except DamagedError as error:
        raise RailExtractError(" ".join(str(error).split())) from error


def _clouds(name: str) -> Callable[[Path], Sequence[Path]]:
    def make(folder: Path) -> Sequence[Path]:
        from . import clouds

        return getattr(clouds, f"write_{name}")(folder)

    return make


def _layers(name: str, function: str) -> Callable[[Path], Sequence[Path]]:
    def call(path: Path) -> Sequence[Path]:
        from . import layers

        return getattr(layers, function)(path, name) if function == "write_lines" else getattr(layers, function)(path)

    return call


CORE = (
    *(Kind(name, _clouds(name), _read_cloud) for name in ("las", "laz", "copc")),
    Kind("vpc", _clouds("vpc"), _read_cloud, mutate_text),
    Kind("weights", _make_weights, _read_weights),
    Kind("work", _make_spool, _read_spool),
    Kind("stored", _make_stored, _read_stored),
)
"""Kinds that need no QGIS; `make check` reads some of each."""

PLUGIN = (
    *(
        Kind(suffix, _layers(suffix, "write_lines"), _layers(suffix, "read_lines"), damage, needs_qgis=True)
        for suffix, damage in (("gpkg", mutate), ("geojson", mutate_text), ("shp", mutate))
    ),
    Kind("tif", _layers("tif", "write_raster"), _layers("tif", "read_raster"), needs_qgis=True),
)

KINDS = {kind.name: kind for kind in (*CORE, *PLUGIN)}
