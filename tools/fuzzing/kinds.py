"""Kinds of files that are damaged: how good ones are made, and how a damaged one is read."""

from __future__ import annotations

import os
import random
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .clouds import RAIL, SHAPES, write_copc, write_las, write_laz, write_vpc
from .mutators import damaged

LINES = ("gpkg", "geojson", "shp")
"""Formats of rails."""

DESIGNS = {
    **{name: f"read_{name}" for name in ("elements", "axis", "posts", "jumps", "places")},
    **dict.fromkeys(("guide", "mask", "seeds"), "read_area"),
}
"""Layers of designs, kilometres and areas, and the functions of `designs` that read them."""


@dataclass(frozen=True)
class Kind:
    """A kind of files, which may need a module.

    `make` writes good files into a folder, and returns those to be damaged; `read` reads a damaged one, and may raise a
    `RailExtractError`, while everything else is a failure; `remake` writes a file again with other values, which is
    done in half of the cases instead of damaging its bytes.
    """

    name: str
    make: Callable[[Path], Sequence[Path]]
    read: Callable[[Path], object]
    needs: str = "numpy"
    remake: Callable[[Path, random.Random], None] | None = None

    def mutant(self, folder: Path, good: Sequence[Path], seed: int) -> Path:
        """Copy the folder of the good files of `make`, damage one of them as a seed says, and return its path."""
        rng = random.Random(f"{self.name}:{seed}")
        path = self.copied(folder, rng.choice(list(good)))
        if self.remake is not None and rng.random() < 0.5:
            self.remake(path, rng)
        else:
            path.write_bytes(damaged(path, rng))
        return path

    def copied(self, folder: Path, path: Path) -> Path:
        """Copy the folder of the good files, and return the path of the copy of one of them."""
        copy = folder / "mutant"
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("mutant"))
        return copy / path.relative_to(folder)


def _read_cloud(path: Path) -> None:
    """Read rail points; those that are read must be numbers."""
    from rail_extract.core.clouds.points import read_rail_points

    for points in read_rail_points(path, [RAIL]):
        if not (len(points.xyz) and np.isfinite(points.xyz).all()):
            raise AssertionError("points that are not numbers")


def _make_weights(folder: Path) -> list[Path]:
    from rail_extract.core.frpdf.models import MODELS

    return [Path(shutil.copy(MODELS[0].path, folder / "weights.npz"))]


def _read_weights(path: Path) -> None:
    from rail_extract.core.frpdf.architecture import fold
    from rail_extract.core.frpdf.weights import load_arrays

    fold(load_arrays(path))


SPOOL_SIDE_M = 100.0


def _make_spool(folder: Path) -> list[Path]:
    """Sort a cloud into squares on disk."""
    cloud = write_las(folder)[-1]
    (folder / "work").mkdir()
    _spooled(cloud, folder / "work")
    return sorted(path for path in (folder / "work").rglob("*") if path.is_file())


def _read_spool(path: Path) -> None:
    """Continue with the damaged folder of an earlier run: the result must be the same as with a new folder."""
    work = next(parent for parent in path.parents if parent.name == "work")
    (points,) = _spooled(work.parent.parent / "1.4_7.las", work)
    if sum(points.counts.values()) != 300:
        raise AssertionError(f"{sum(points.counts.values())} points instead of 300")


def _spooled(cloud: Path, folder: Path) -> Sequence:
    from rail_extract.core.clouds.points import ask
    from rail_extract.core.tiles.store import spool

    return spool(ask(cloud, [RAIL]), SPOOL_SIDE_M, folder)


def _make_stored(folder: Path) -> list[Path]:
    """Store the raster and the rails of a square."""
    from rail_extract.core.frame import LocalFrame
    from rail_extract.core.rails import RailLine
    from rail_extract.core.raster import rasterize
    from rail_extract.core.squares.kept import save
    from rail_extract.core.squares.seams import SquareRails
    from rail_extract.core.tiles.grid import Square

    xyz = np.random.default_rng(0).uniform(0, 20, (500, 3))
    rail = RailLine(xyz, 1, 10, points=500, resid_mm=1.0, sigma_mm=1.0, bridged_m=0.0)
    square = Square((0, 0), LocalFrame(np.zeros(3)), 100.0)
    save(folder / "raster.npz", rasterize(xyz, 0.04))
    save(folder / "rails.npz", SquareRails(square, (rail,), xyz[:3, :2]))
    return [folder / "raster.npz", folder / "rails.npz"]


def _read_stored(path: Path) -> None:
    """Load a result as the runner does: it computes what is damaged again."""
    from rail_extract.core.squares.kept import Stored, load

    load(Stored(str(path)))


def _keep_all(codes: np.ndarray, places: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Look at the places of all points and keep their classes."""
    places(np.arange(len(codes)))
    return codes, np.ones(len(codes), dtype=bool)


def _copy_cloud(path: Path) -> None:
    """Read a raw cloud and write a classified copy, which must have the same points."""
    import laspy
    from rail_extract.core.clouds.rewriting import rewrite

    _read_cloud(path)
    copy = path.with_name(f"copy{path.suffix}")
    written = rewrite(path, copy, _keep_all)
    with laspy.open(copy, read_evlrs=False) as reader:
        there = sum(len(chunk) for chunk in reader.chunk_iterator(1000))
    if written != there:
        raise AssertionError(f"{written} points were written, and {there} are there")


def _make_classifier(folder: Path) -> list[Path]:
    from rail_extract.core.learned.model import SHIPPED

    return [Path(shutil.copy(SHIPPED, folder / "classifier.npz"))]


def _read_classifier(path: Path) -> None:
    from rail_extract.core.learned.model import load

    load(path)


def _make_training(folder: Path) -> list[Path]:
    """Write the folder of a training that was interrupted."""
    from . import learning

    return learning.write_training(folder)


def _read_training(path: Path) -> None:
    """Continue the training in a damaged folder."""
    from . import learning

    learning.continue_training(path)


def _make_shapes(folder: Path) -> list[Path]:
    """Write seeds, a guide and a mask as GeoJSON and as a GeoPackage."""
    import pyogrio
    import shapely

    shapes = shapely.from_geojson(list(SHAPES))
    paths = [folder / "shapes.geojson", folder / "shapes.gpkg"]
    for path in paths:
        kind = {"geometry_type": "Unknown", "crs": "EPSG:32642", "layer": "shapes"}
        pyogrio.raw.write(path, shapely.to_wkb(shapes), [], [], **kind)
    return paths


def _read_shapes(path: Path) -> None:
    """Read a vector file as the commands do, for a cloud in another coordinate system."""
    from rail_extract.core.clouds.crs import import_pyproj
    from rail_extract.core.commands.vectors import read_features
    from rail_extract.core.jobs.features import read_lines_along, read_mask, read_seeds

    wkt = import_pyproj().CRS.from_epsg(32643).to_wkt()
    for read in (read_seeds, read_lines_along, read_mask):
        read(read_features(path, "LAYER"), wkt)


def _make_names(folder: Path) -> list[Path]:
    """Write the names of two tiles."""
    tiles = write_las(folder)[:2]
    path = folder / "names.txt"
    path.write_text("".join(f"{tile}\n" for tile in tiles), encoding="utf-8")
    return [path]


def _read_names(path: Path) -> None:
    """Read the arguments of a command from a file, and find the tiles that it names."""
    from rail_extract.__main__ import parse
    from rail_extract.core.clouds.points import ask
    from rail_extract.core.errors import ParameterError

    try:
        args = parse(["classify", f"@{path}", "--output", "out.laz"])
    except SystemExit as error:
        raise ParameterError("The arguments are refused.") from error
    ask(args.INPUT, [RAIL])


def _make_moving(folder: Path) -> list[Path]:
    """Write the temporary folder of a run that was killed while it moved the files of a shapefile."""
    from rail_extract.core import disk

    killed = folder / f"{disk.PREFIX}{'0' * 12}"
    for name in (disk.NEW, disk.OLD):
        (killed / name).mkdir(parents=True)
        (killed / name / "a.shp").write_bytes(b"shp")
        (killed / name / "a.dbf").write_bytes(b"dbf")
    (killed / disk.MOVING).write_text('["a.shp", "a.dbf"]', encoding="utf-8")
    return [killed / disk.MOVING]


def _read_moving(path: Path) -> None:
    """Complete an interrupted move, as the next run does: nothing is written outside of the folder."""
    from rail_extract.core import disk

    folder = path.parents[1]
    os.utime(path.parent, (0, time.time() - disk.MIN_UNMARKED_AGE_S - 1))
    disk.Destination.at(folder / "next.txt")
    if path.exists():
        raise AssertionError("the temporary folder is still there")


def _layers(name: str, *values: str) -> Callable[..., Any]:
    """Return a function of `layers`, which is imported when it is called, because it needs QGIS."""

    def call(*given: Any) -> Any:
        from . import layers

        return getattr(layers, name)(*given, *values)

    return call


def _designs(name: str, *values: str) -> Callable[..., Any]:
    """Return a function of `designs` in the same way."""

    def call(*given: Any) -> Any:
        from . import designs

        return getattr(designs, name)(*given, *values)

    return call


CORE = (
    Kind("las", write_las, _read_cloud),
    Kind("laz", write_laz, _read_cloud),
    Kind("copc", write_copc, _read_cloud),
    Kind("copied", write_las, _copy_cloud),
    Kind("vpc", write_vpc, _read_cloud),
    Kind("weights", _make_weights, _read_weights),
    Kind("work", _make_spool, _read_spool),
    Kind("stored", _make_stored, _read_stored),
    Kind("moving", _make_moving, _read_moving),
    Kind("names", _make_names, _read_names),
    Kind("shapes", _make_shapes, _read_shapes, needs="pyogrio"),
    Kind("classifier", _make_classifier, _read_classifier, needs="torch"),
    Kind("training", _make_training, _read_training, needs="torch"),
)
"""Kinds that need no QGIS; `make check` reads some of each."""

PLUGIN = (
    *(Kind(suffix, _layers("write_lines", suffix), _layers("read_lines"), "qgis.core") for suffix in LINES),
    Kind("tif", _layers("write_raster"), _layers("read_raster"), "qgis.core"),
    Kind("landxml", _designs("write_xml"), _designs("read_xml"), "qgis.core"),
    *(
        Kind(name, _designs("write", name), _designs(read), "qgis.core", _designs("change_values"))
        for name, read in DESIGNS.items()
    ),
)

KINDS = {kind.name: kind for kind in (*CORE, *PLUGIN)}
