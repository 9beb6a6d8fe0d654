"""Lines and polygons of vector files, in the coordinate system of a cloud."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyogrio
import shapely

from ..airborne.survey import Guide, gauge_of
from ..clouds.crs import import_pyproj, parse_crs
from ..clouds.mask import Mask
from ..errors import ParameterError


def read_lines(path: Path, crs_wkt: str | None) -> list[np.ndarray]:
    """Read the lines of the first layer of a file, (k, 2) each.

    Parameters
    ----------
    path : Path
        In any format that GDAL reads.
    crs_wkt : str or None
        Coordinate system to transform them to. Without one, or if the file states none, they stay as they are.

    Raises
    ------
    ParameterError
        The file can't be read, or has no lines.
    """
    lines = [part for part in _parts(path, crs_wkt) if part.geom_type == "LineString" and part.length > 0]
    if not lines:
        raise ParameterError(f"{path} has no lines: give lines along the tracks.")
    return [shapely.get_coordinates(line) for line in lines]


def read_guides(path: Path, crs_wkt: str | None) -> list[Guide]:
    """Read the lines of the first layer of a file with the name, reference and gauge that it states of them.

    Parameters
    ----------
    path, crs_wkt
        See `read_lines`.

    Raises
    ------
    ParameterError
        The file can't be read, or has polygons, or no lines.
    """
    with _explained(path):
        known = set(pyogrio.read_info(path)["fields"].tolist())
        columns = [name for name in ("name", "ref", "gauge") if name in known]
        meta, ids, shapes, data = pyogrio.raw.read(path, columns=columns, force_2d=True, return_fids=True)
        stated = dict(zip(meta["fields"].tolist(), data))
        found = shapely.from_wkb(shapes) if shapes is not None else []
    if any("Polygon" in shape.geom_type for shape in found if shape is not None):
        raise ParameterError(f"{path} has polygons: give lines along the tracks, one for each.")
    guides = [
        Guide(
            int(ids[number]),
            shapely.get_coordinates(part),
            gauge_of(stated["gauge"][number]) if "gauge" in stated else None,
            *(_word(stated[name][number]) if name in stated else "" for name in ("name", "ref")),
        )
        for number, shape in enumerate(found)
        for part in _transformed(shapely.get_parts(shape), meta["crs"], crs_wkt)
        if part.geom_type == "LineString" and part.length > 0
    ]
    if not guides:
        raise ParameterError(f"{path} has no lines: give lines along the tracks.")
    return guides


def _word(value: object) -> str:
    return "" if value is None or value != value else str(value)


def read_seeds(path: Path, crs_wkt: str | None) -> list[np.ndarray]:
    """Read the points, (1, 2) each, and the lines, (k, 2) each, of the first layer of a file.

    Parameters
    ----------
    path, crs_wkt
        See `read_lines`.

    Raises
    ------
    ParameterError
        The file can't be read, or has neither points nor lines.
    """
    parts = _parts(path, crs_wkt)
    seeds = [part for part in parts if part.geom_type == "Point" or (part.geom_type == "LineString" and part.length)]
    if not seeds:
        raise ParameterError(f"{path} has neither points nor lines: give places on railheads.")
    return [shapely.get_coordinates(seed) for seed in seeds]


def read_mask(path: Path, crs_wkt: str | None) -> Mask:
    """Read the polygons of the first layer of a file; overlaps count once.

    Parameters
    ----------
    path, crs_wkt
        See `read_lines`.

    Raises
    ------
    ParameterError
        The file can't be read, or has no polygons.
    """
    areas = [part for part in _parts(path, crs_wkt) if part.geom_type == "Polygon" and part.area > 0]
    if not areas:
        raise ParameterError(f"{path} has no polygons: give polygons around the tracks.")
    with _explained(path):
        united = shapely.get_parts(shapely.union_all(shapely.make_valid(areas)))
    return Mask.of([shapely.get_coordinates(ring) for ring in shapely.get_rings(united)])


def _parts(path: Path, crs_wkt: str | None) -> list[shapely.Geometry]:
    """Read the single geometries of a file, in another coordinate system; those that it does not cover are left out."""
    if path.is_fifo():
        raise ParameterError(f"{path} is a pipe, not a file: give a GeoPackage or GeoJSON file.")
    with _explained(path):
        meta, _, shapes, _ = pyogrio.raw.read(path, columns=[], force_2d=True)
        parts = shapely.get_parts(shapely.from_wkb(shapes)) if shapes is not None else np.empty(0, object)
        return _transformed(parts, meta["crs"], crs_wkt)


def _transformed(parts: np.ndarray, crs: str | None, crs_wkt: str | None) -> list[shapely.Geometry]:
    """Return geometries in another coordinate system; those that it does not cover are left out."""
    if crs_wkt and crs and len(parts):
        pyproj = import_pyproj()
        change = pyproj.Transformer.from_crs(parse_crs(crs), parse_crs(crs_wkt), always_xy=True)
        parts = shapely.transform(parts, lambda xy: np.column_stack(change.transform(*xy.T)))
    return [part for part in parts if np.isfinite(shapely.get_coordinates(part)).all()]


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Turn what GDAL, PROJ and GEOS raise because of a file into a `ParameterError` that names the file."""
    try:
        yield
    except (RuntimeError, ValueError, shapely.errors.ShapelyError) as error:
        raise ParameterError(f"{path} can't be read as a vector file: give a GeoPackage or GeoJSON file.") from error
