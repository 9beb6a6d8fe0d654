"""Lines into GeoPackages, with the fields of the interface, without QGIS."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyogrio
import shapely

from ..disk import take_names, writing
from ..errors import DiskError
from ..fields import UNKNOWN_IN_METRES, Field
from ..frame import LocalFrame
from ..rails import Centerline, RailLine

KINDS = {int: np.int32, float: float, str: object}


def write(layers: dict[str, tuple[Path, Sequence[RailLine | Centerline], Sequence[Field]]], frame: LocalFrame) -> None:
    """Write layers into GeoPackages; those that are there are replaced once the new ones are whole.

    Parameters
    ----------
    layers : dict
        By the layer's name its file, its lines and their fields. Several layers may share a file.
    frame : LocalFrame
        Of the lines.

    Raises
    ------
    DiskError
        A file can't be written, as on a full disk; what was there before is left as it was. Or it is open elsewhere;
        then the new one lies beside it.
    """
    layers = {name: (path.resolve(), lines, fields) for name, (path, lines, fields) in layers.items()}
    unfinished = {path: path.with_name(f".{uuid.uuid4().hex}.gpkg") for path, _, _ in layers.values()}
    try:
        for name, (path, lines, fields) in layers.items():
            with writing(path.parent):
                path.parent.mkdir(parents=True, exist_ok=True)
            _write_layer(unfinished[path], name, lines, fields, frame, path)
        for path, whole in unfinished.items():
            take_names(path, {whole: path})
    finally:
        for leftover in unfinished.values():
            for file in leftover.parent.glob(f"{leftover.name}*"):
                file.unlink()


def _write_layer(
    file: Path,
    name: str,
    lines: Sequence[RailLine | Centerline],
    fields: Sequence[Field],
    frame: LocalFrame,
    path: Path,
) -> None:
    """Write one layer; `path` is the name that the file will have."""
    try:
        pyogrio.raw.write(
            str(file),
            layer=name,
            driver="GPKG",
            geometry=_geometry(lines, frame),
            geometry_type="LineString Z",
            field_data=[_column(lines, field) for field in fields],
            fields=[field.name for field in fields],
            crs=frame.crs_wkt or UNKNOWN_IN_METRES,
            append=file.exists(),
            nan_as_null=True,
        )
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, RuntimeError) as error:
        raise DiskError(f"{path} can't be written ({error}): make room on this disk, or choose another.") from error


def _geometry(lines: Sequence[RailLine | Centerline], frame: LocalFrame) -> np.ndarray:
    """Lines in the cloud's coordinates as well-known binary, (n,)."""
    shapes = [shapely.linestrings(frame.to_crs(line.xyz)) for line in lines]
    return np.array([shapely.to_wkb(shape, output_dimension=3) for shape in shapes], dtype=object)


def _column(lines: Sequence[RailLine | Centerline], field: Field) -> np.ndarray:
    """Values of one field, (n,)."""
    return np.array([field.value(getattr(line, field.name)) for line in lines], dtype=KINDS[field.kind])
