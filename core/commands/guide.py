"""Lines of a vector file, in the coordinate system of a cloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyogrio
import shapely

from ..clouds.crs import import_pyproj, parse_crs
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
    try:
        meta, _, shapes, _ = pyogrio.raw.read(path, columns=[], force_2d=True)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
        raise ParameterError(f"{path} can't be read as a file of lines: give a GeoPackage or GeoJSON file.") from error
    parts = shapely.get_parts(shapely.from_wkb(shapes)) if shapes is not None else []
    lines = [shapely.get_coordinates(part) for part in parts if part.geom_type == "LineString" and part.length > 0]
    if not lines:
        raise ParameterError(f"{path} has no lines: give lines along the tracks.")
    if not crs_wkt or not meta["crs"]:
        return lines
    pyproj = import_pyproj()
    change = pyproj.Transformer.from_crs(parse_crs(meta["crs"]), parse_crs(crs_wkt), always_xy=True)
    moved = [np.column_stack(change.transform(*line.T)) for line in lines]
    return [line for line in moved if np.isfinite(line).all()]
