"""Vector files: lines, points, polygons and tables with their fields, for the commands that take them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..airborne.survey import Guide, gauge_of
from ..clouds.crs import import_pyproj, parse_crs, unit_in_plan
from ..clouds.mask import Mask
from ..design_places import check_line, check_places
from ..errors import ParameterError
from ..jobs.lines import Lines, system_of, without_steps
from ..progress import Progress

LAYER = "|layername="
"""What separates a file from the layer in it, as QGIS writes it."""


@dataclass(frozen=True)
class Features:
    """Features of a layer.

    Attributes
    ----------
    option : str
        Option that named the file, or the file, for messages.
    crs_wkt : str or None
    ids : (n,) int array
    shapes : (n,) object array
        Geometries; None where there is none.
    columns : dict of str to (n,) array
        Values by the name of the field.
    """

    option: str
    crs_wkt: str | None
    ids: np.ndarray
    shapes: np.ndarray
    columns: dict[str, np.ndarray]

    def rows(self) -> list[dict[str, Any]]:
        """Return the values of each feature; None where a field is empty."""
        return [
            {name: _plain(values[number]) for name, values in self.columns.items()} for number in range(len(self.ids))
        ]

    def lines(self, progress: Progress) -> Lines:
        """Return the parts of all lines that have a length; see `Lines.of`."""
        rows = self.rows()
        parts = ((int(self.ids[n]), rows[n], _vertices(part)) for n, part in self.parts(None, "LineString"))
        return Lines.of(self.option, parts, list(self.columns), system_of(self.crs_wkt, progress), progress)

    def in_plane(self, crs_wkt: str | None) -> np.ndarray:
        """Return the geometries in another coordinate system; as they are if either is unknown."""
        if not (crs_wkt and self.crs_wkt):
            return self.shapes
        change = import_pyproj().Transformer.from_crs(parse_crs(self.crs_wkt), parse_crs(crs_wkt), always_xy=True)
        with explained(self.option):
            return shapely.transform(self.shapes, lambda xy: np.column_stack(change.transform(*xy.T)))

    def parts(self, crs_wkt: str | None, *kinds: str) -> Iterator[tuple[int, shapely.Geometry]]:
        """Yield row and geometry of the points, lines or polygons of some kinds, in another coordinate system.

        Those that the system does not cover, and those without a length, are left out.
        """
        for number, part in zip(*shapely.get_parts(self.in_plane(crs_wkt), return_index=True)[::-1]):
            known = not part.is_empty and np.isfinite(shapely.get_coordinates(part)).all()
            if part.geom_type in kinds and known and (part.geom_type == "Point" or part.length > 0):
                yield int(number), part

    def checked(self) -> Features:
        """Return these features if all their coordinates are on the map.

        Raises
        ------
        DesignNumberError
        """
        unit_m = unit_in_plan(self.crs_wkt)
        for feature, bounds in zip(self.ids, shapely.bounds(self.shapes).reshape(-1, 2, 2)):
            if not np.isnan(bounds).all():
                check_places(bounds, f"{self.option} (feature {feature})", unit_m)
        return self

    def guides(self, crs_wkt: str | None) -> Iterator[tuple[int, np.ndarray]]:
        """Yield row and vertices, (k, 2), of the lines that show places along tracks; see `parts`.

        Raises
        ------
        DesignNumberError
            A line leads to a place that is not on the map.
        """
        for number, line in self.checked().parts(crs_wkt, "LineString"):
            where = f"{self.option} (feature {self.ids[number]})"
            yield number, check_line(shapely.get_coordinates(line), where, unit_in_plan(crs_wkt or self.crs_wkt))


def read_features(file: str | Path, option: str = "", columns: Sequence[str] | None = None) -> Features:
    """Read the features of a file; pyogrio drops M values.

    Parameters
    ----------
    file : str or Path
        A vector file; `FILE|layername=NAME` names a layer, else its first one is read.
    option : str
        Option that names it, for messages; these else name the file.
    columns : sequence of str, optional
        Fields to read, as far as there are any; else all.

    Raises
    ------
    ParameterError
        It can't be read.
    """
    path, _, layer = str(file).partition(LAYER)
    if Path(path).is_fifo():
        raise ParameterError(f"{path} is a pipe, not a file: give a GeoPackage or GeoJSON file.")
    with explained(f"{option} {file}".strip()), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of the M values, which only an axis needs
        chosen = {"layer": layer or None, "columns": columns}
        meta, ids, shapes, values = pyogrio.raw.read(Path(path), return_fids=True, **chosen)
        found = shapely.from_wkb(shapes) if shapes is not None else np.full(len(ids), None)
    return Features(option or str(file), meta["crs"], ids, found, dict(zip(meta["fields"].tolist(), values)))


@contextmanager
def explained(name: str) -> Iterator[None]:
    """Turn what GDAL, PROJ and GEOS raise because of a file into a `ParameterError` that names the file."""
    try:
        yield
    except (RuntimeError, ValueError, shapely.errors.ShapelyError) as error:
        raise ParameterError(
            f"{name} can't be read as a vector file: give a GeoPackage or GeoJSON file, or a table."
        ) from error


def read_lines(file: Path, crs_wkt: str | None) -> list[np.ndarray]:
    """Read the lines of a file, (k, 2) each, in a coordinate system; as they are if either is unknown.

    Raises
    ------
    ParameterError
        The file can't be read, or has no lines.
    """
    lines = [line for _, line in read_features(file, columns=()).guides(crs_wkt)]
    if not lines:
        raise ParameterError(f"{file} has no lines: give lines along the tracks.")
    return lines


def read_guides(file: Path, crs_wkt: str | None) -> list[Guide]:
    """Read the lines of a file with the name, reference and gauge that it states of them; see `read_lines`.

    Raises
    ------
    ParameterError
        The file can't be read, or has polygons, or no lines.
    """
    features = read_features(file, columns=("name", "ref", "gauge"))
    if any("Polygon" in shape.geom_type for shape in features.shapes if shape is not None):
        raise ParameterError(f"{file} has polygons: give lines along the tracks, one for each.")
    rows = features.rows()
    guides = [
        Guide(
            int(features.ids[number]),
            line,
            gauge_of(rows[number].get("gauge")),
            *(_word(rows[number].get(name)) for name in ("name", "ref")),
        )
        for number, line in features.guides(crs_wkt)
    ]
    if not guides:
        raise ParameterError(f"{file} has no lines: give lines along the tracks.")
    return guides


def read_seeds(file: Path, crs_wkt: str | None) -> list[np.ndarray]:
    """Read the points, (1, 2) each, and the lines, (k, 2) each, of a file; see `read_lines`.

    Raises
    ------
    ParameterError
        The file can't be read, or has neither points nor lines.
    """
    features = read_features(file, columns=())
    points = [shapely.get_coordinates(seed) for _, seed in features.checked().parts(crs_wkt, "Point")]
    seeds = [*points, *(line for _, line in features.guides(crs_wkt))]
    if not seeds:
        raise ParameterError(f"{file} has neither points nor lines: give places on railheads.")
    return seeds


def read_mask(file: Path, crs_wkt: str | None) -> Mask:
    """Read the polygons of a file, of which overlaps count once; see `read_lines`.

    Raises
    ------
    ParameterError
        The file can't be read, or has no polygons.
    """
    areas = [area for _, area in read_features(file, columns=()).checked().parts(crs_wkt, "Polygon") if area.area > 0]
    if not areas:
        raise ParameterError(f"{file} has no polygons: give polygons around the tracks.")
    with explained(str(file)):
        united = shapely.get_parts(shapely.union_all(shapely.make_valid(areas)))
    return Mask.of([shapely.get_coordinates(ring) for ring in shapely.get_rings(united)])


def _vertices(line: shapely.LineString) -> np.ndarray:
    return without_steps(shapely.get_coordinates(line, include_z=True))


def _plain(value: Any) -> Any:
    """Return a value of a field; None where it is empty."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if value is None or value != value else value


def _word(value: Any) -> str:
    return "" if value is None else str(value)
