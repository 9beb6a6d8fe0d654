"""Vector files as a command line or Python gives them, read with pyogrio and shapely."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..clouds.crs import import_pyproj, parse_crs
from ..errors import ParameterError
from ..files.geopackage import geometries_in
from ..jobs.declaration import LINE, POINT, POLYGON
from ..jobs.features import Feature, FeatureSource
from ..jobs.lines import Row

LAYER = "|layername="
"""What separates a file from the layer in it, as QGIS writes it."""

KINDS = {"Point": POINT, "LineString": LINE, "Polygon": POLYGON}


@dataclass(frozen=True)
class Features(FeatureSource):
    """A layer of a file, as a whole in memory: geometries, (n,), None where there is none, and (n,) values by field."""

    name: str
    crs_wkt: str | None
    ids: np.ndarray
    shapes: np.ndarray
    columns: dict[str, np.ndarray]

    @property
    def fields(self) -> list[str]:  # type: ignore[override]
        """Names of the fields."""
        return list(self.columns)

    @property
    def count(self) -> int:  # type: ignore[override]
        """Number of features."""
        return len(self.ids)

    @property
    def kinds(self) -> Collection[str]:  # type: ignore[override]
        """Kinds of the geometries; any, where there is no feature."""
        found = {part.geom_type for part in shapely.get_parts(self.shapes)}
        return {kind for name, kind in KINDS.items() if name in found or not self.count}

    def rows(self) -> Iterator[tuple[int, Row]]:
        """Yield number and values of each feature."""
        for number, feature in enumerate(self.ids):
            yield int(feature), {name: _plain(values[number]) for name, values in self.columns.items()}

    def features(self, crs_wkt: str | None) -> Iterator[Feature]:
        """Yield the features in a coordinate system."""
        change = self._change_to(crs_wkt)
        for (number, row), shape in zip(self.rows(), self.shapes):
            with explained(self.name):
                parts = [(KINDS[part.geom_type], _vertices(part, change)) for part in _parts_of(shape)]
                own = shapely.get_coordinates(shape)
            is_lost = bool(np.isfinite(own).all()) and not all(np.isfinite(xyzm[:, :2]).all() for _, xyzm in parts)
            bounds = np.array([own.min(axis=0), own.max(axis=0)]) if len(own) else own
            yield Feature(number, row, bounds, parts, is_lost, partial(self._middle, shape, change))

    def _middle(self, shape: shapely.Geometry, change: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return where a feature counts, (2,)."""
        with explained(self.name):
            moved = shapely.transform(shape, change)
            if "Line" in moved.geom_type:
                moved = shapely.line_interpolate_point(shapely.line_merge(moved), 0.5, normalized=True)
            elif "Polygon" in moved.geom_type:
                moved = shapely.point_on_surface(moved)
            return np.array(shapely.get_coordinates(shapely.centroid(moved))[0])

    def rings(self, crs_wkt: str | None) -> list[np.ndarray]:
        """Return the rings of the polygons and of their holes; overlaps count once."""
        with explained(self.name):
            moved = shapely.transform(self.shapes, self._change_to(crs_wkt))
            areas = [part for part in shapely.get_parts(moved) if part.geom_type == "Polygon"]
            united = shapely.get_parts(shapely.union_all(shapely.make_valid([area for area in areas if area.area > 0])))
            return [shapely.get_coordinates(ring) for ring in shapely.get_rings(united)]

    def _change_to(self, crs_wkt: str | None) -> Callable[[np.ndarray], np.ndarray]:
        """Return what moves coordinates, (n, 2), to another system; nothing if it or the layer's is unknown."""
        if not (crs_wkt and self.crs_wkt):
            return lambda xy: xy
        change = import_pyproj().Transformer.from_crs(parse_crs(self.crs_wkt), parse_crs(crs_wkt), always_xy=True)
        return lambda xy: np.column_stack(change.transform(*xy.T))


def _parts_of(shape: shapely.Geometry | None) -> list[shapely.Geometry]:
    """Return the points, lines and polygons of a geometry that are not empty."""
    return [part for part in shapely.get_parts(shape) if part.geom_type in KINDS and not part.is_empty]


def _vertices(part: shapely.Geometry, change: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return x, y, z and M of a part, (n, 4), moved; of a polygon, those of its outer ring."""
    line = part.exterior if part.geom_type == "Polygon" else part
    xyzm = shapely.get_coordinates(line, include_z=True, include_m=True)
    return np.column_stack([change(xyzm[:, :2]), xyzm[:, 2:]])


def read_features(file: str | Path, name: str, measured: bool = False) -> Features:
    """Read a layer of a file; `FILE|layername=NAME` names a layer, else its first one is read.

    `name` is the parameter that names the file, for messages. If `measured`, M values are needed, which pyogrio drops;
    those of GeoPackages are read.
    """
    path, _, layer = str(file).partition(LAYER)
    if Path(path).is_fifo():
        raise ParameterError(f"{path} is a pipe, not a file: give a GeoPackage or GeoJSON file.")
    with explained(f"{name} {file}"), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of the M values
        meta, ids, shapes, values = pyogrio.raw.read(Path(path), layer=layer or None, return_fids=True)
        if measured and Path(path).suffix.lower() == ".gpkg":
            stored = geometries_in(Path(path), layer or str(pyogrio.list_layers(path)[0, 0]))
            shapes = np.array([stored.get(int(number)) for number in ids], dtype=object)
        found = shapely.from_wkb(shapes) if shapes is not None else np.full(len(ids), None)
    return Features(name, meta["crs"], ids, found, dict(zip(meta["fields"].tolist(), values)))


@contextmanager
def explained(name: str) -> Iterator[None]:
    """Turn what GDAL, PROJ and GEOS raise because of a file into a `ParameterError` that names the file."""
    try:
        yield
    except (RuntimeError, ValueError, shapely.errors.ShapelyError) as error:
        raise ParameterError(
            f"{name} can't be read as a vector file: give a GeoPackage or GeoJSON file, or a table."
        ) from error


def _plain(value: Any) -> Any:
    """Return a value of a field; None where it is empty."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if value is None or value != value else value
