"""Converts the core's lines and rasters to QGIS features and files, and writes them to the outputs."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFeatureSink,
    QgsField,
    QgsFields,
    QgsGeometry,
    QgsLineString,
    QgsPoint,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProcessingUtils,
    QgsVertexIterator,
    QgsWkbTypes,
)

from ...core.disk import Destination
from ...core.errors import RailExtractError
from ...core.fields import PLACES, UNKNOWN_IN_METRES, Field, Product
from ...core.progress import Progress
from ..compat import INTEGER, REAL, TEXT, field
from ..dialog.parameter_values import ParameterValues
from ..systems import lost_part, system
from .destinations import EXCHANGED
from .styling import style_on_load
from .whole_files import write_whole

if TYPE_CHECKING:
    import numpy as np

    from ...core.files.layers import AnyLayer, Copy, Layer
    from ...core.files.rail_rasters import RasterHeader
    from ...core.frame import LocalFrame
    from ...core.raster import RailRaster

KINDS = {int: INTEGER, float: REAL, str: TEXT}


def fields(columns: Sequence[Field]) -> QgsFields:
    """Define the fields of a layer."""
    made = QgsFields()
    for column in columns:
        made.append(field(column.name, KINDS[column.kind], column.decimals))
    return made


def features(layer: Layer, frame: LocalFrame) -> Iterator[QgsFeature]:
    """Convert the features of a layer to QGIS features, in the cloud's coordinates."""
    make = _line if layer.product.is_line else _point
    for places, xyz, *row in zip(layer.places(frame), layer.xyz, *layer.written_columns()):
        feature = QgsFeature()
        feature.setGeometry(QgsGeometry(make(places, xyz)))
        feature.setAttributes(row)
        yield feature


def _line(places: np.ndarray, xyz: np.ndarray) -> QgsLineString:
    """Return a line, with M values if its vertices have a fourth column."""
    columns = places.T.tolist()
    if xyz.shape[1] > 3:
        columns = [*columns, *([[]] if len(columns) < 3 else []), xyz[:, 3].tolist()]
    return QgsLineString(*columns)


def _point(places: np.ndarray, _: np.ndarray) -> QgsPoint:
    """Return a point, in 2D if its height is unknown."""
    return QgsPoint(*(value for value in places.tolist() if not math.isnan(value)))


def _shape_of(layer: Layer) -> QgsWkbTypes.Type:
    """Return the type of the geometries of a layer."""
    types, flat = QgsWkbTypes.Type, layer.is_flat
    if not layer.product.is_line:
        return types.Point if flat else types.PointZ
    if layer.is_measured:
        return types.LineStringM if flat else types.LineStringZM
    return types.LineString if flat else types.LineStringZ


def _copies(layer: Copy, columns: QgsFields) -> Iterator[QgsFeature]:
    """Copy features with values for the last fields of `columns`; objects become texts."""
    for original, row in zip(layer.originals.stored(), zip(*layer.written_columns())):
        feature = QgsFeature(columns)
        feature.setGeometry(original.geometry())
        own = [
            json.dumps(value, ensure_ascii=False) if isinstance(value, dict) else value
            for value in original.attributes()
        ]
        feature.setAttributes([*own, *row])
        yield feature


def add_features(sink: QgsFeatureSink, made: Iterator[QgsFeature]) -> int:
    """Write features to a sink and return their number.

    Raises RailExtractError if one cannot be written, for example because the disk is full.
    """
    count = 0
    for feature in made:
        if not sink.addFeature(feature, QgsFeatureSink.Flag.FastInsert):
            reason = " ".join(sink.lastError().split())
            raise RailExtractError(f"The output can't be written ({reason}): check the free disk space.")
        count += 1
    return count


def write_layer(values: ParameterValues, name: str, layer: AnyLayer, frame: LocalFrame) -> dict[str, str]:
    """Write a layer to the output of this name; returns its id by that name, and nothing if the user skipped it.

    Raises RailExtractError if the output cannot be written.
    """
    from ...core.files.layers import Copy

    if not values.wanted(name):
        return {}
    if isinstance(layer, Copy):
        return _write_copy(values, name, layer)
    shape, made, product = _shape_of(layer), features(layer, frame), layer.product
    destination = values.algorithm.destinations.get(name)
    if destination is not None and destination.file.suffix.lower() in EXCHANGED:
        return _exchange(values, name, product, shape, made, frame)
    # QGIS complains of the system that stands for an unknown one as soon as a layer is in the project.
    is_shown = destination is None and bool(getattr(values.parameters.get(name), "destinationProject", None))
    columns, crs = fields(product.fields), system(frame.crs_wkt) if is_shown else output_crs(frame.crs_wkt)
    return _layer(values, name, product.style, columns, shape, made, crs, frame.crs_wkt)


def layer_writers(
    values: ParameterValues, makers: Mapping[str, Callable[[], AnyLayer]], frame: LocalFrame
) -> dict[str, Callable[[], dict[str, str]]]:
    """Return the functions that make layers and write them to the outputs of their names, for `write_each`."""

    def write(name: str) -> dict[str, str]:
        return write_layer(values, name, makers[name](), frame)

    return {name: partial(write, name) for name in makers if values.wanted(name)}


def write_raster(
    values: ParameterValues, name: str, header: RasterHeader, rasters: Sequence[RailRaster], progress: Progress
) -> dict[str, str]:
    """Write rail rasters, one per class, to an output; returns the path by its name, and nothing if it is skipped."""
    from .geotiff import write_rasters

    if not values.wanted(name):
        return {}
    path = values.algorithm.parameterAsOutputLayer(values.parameters, name, values.context)
    destination = values.algorithm.destinations.get(name) or Destination.at(Path(path))
    with destination.replacing() as new:
        write_rasters(new, header, rasters, progress)
    _style(values, name, path, "raster")
    return {name: path}


def output_crs(wkt: str | None) -> QgsCoordinateReferenceSystem:
    """Return the coordinate system for an output: `UNKNOWN_IN_METRES` if the cloud has none."""
    return system(wkt or UNKNOWN_IN_METRES)


def _write_copy(values: ParameterValues, name: str, layer: Copy) -> dict[str, str]:
    """Write a copy of a layer of any kind, with further fields; objects, which few formats hold, become texts."""
    from ..reading.layers import MIXED

    source, kept = layer.originals.source, QgsFields()
    for one in source.fields():
        kept.append(QgsField(one.name(), TEXT) if one.typeName() == MIXED else one)
    columns = QgsProcessingUtils.combineFields(kept, fields(layer.fields))
    shape, crs, made = source.wkbType(), source.sourceCrs(), _copies(layer, columns)
    destination, wkt = values.algorithm.destinations.get(name), crs.toWkt() if crs.isValid() else None
    if destination is None or destination.file.suffix.lower() not in EXCHANGED:
        return _layer(values, name, PLACES.style, columns, shape, made, crs, wkt)
    import numpy as np

    from ...core.clouds.crs import unit_in_plan
    from ...core.frame import LocalFrame

    if QgsWkbTypes.geometryType(shape) == QgsWkbTypes.GeometryType.PolygonGeometry:
        raise RailExtractError(f"{name} can't be {destination.path.name} for polygons: choose a GeoPackage.")
    written = tuple(Field(one.name(), float if one.isNumeric() else str, "") for one in columns)
    frame = LocalFrame(np.zeros(3), unit_in_plan(wkt), crs_wkt=wkt)
    return _exchange(values, name, replace(PLACES, fields=written), shape, made, frame)


def _layer(
    values: ParameterValues,
    name: str,
    style: str,
    columns: QgsFields,
    shape: QgsWkbTypes.Type,
    made: Iterator[QgsFeature],
    crs: QgsCoordinateReferenceSystem,
    wkt: str | None,
) -> dict[str, str]:
    """Write features to a layer with a style; `wkt` is the system that is known of the cloud."""
    algorithm, parameters, context = values.algorithm, values.parameters, values.context

    def write(value: Any) -> tuple[str, int]:
        sink, layer_id = algorithm.parameterAsSink({**parameters, name: value}, name, context, columns, shape, crs)
        return (layer_id, add_features(sink, made)) if sink else ("", 0)

    layer_id = write_whole(parameters.get(name), context, algorithm.destinations.get(name), write, lost_part(wkt))
    if not layer_id:
        return {}
    _style(values, name, layer_id, style, has_system=wkt is not None)
    return {name: layer_id}


def _exchange(
    values: ParameterValues,
    name: str,
    product: Product,
    shape: QgsWkbTypes.Type,
    made: Iterator[QgsFeature],
    frame: LocalFrame,
) -> dict[str, str]:
    """Write features for other programs; QGIS loads the file if the user wants that."""
    from ...core.files.exchange import Shape, write_shapes

    destination, value = values.algorithm.destinations[name], values.parameters.get(name)
    shapes = (
        Shape(_vertices(part.vertices()), _plain(feature.attributes()))
        for feature in made
        for part in feature.geometry().constParts()
    )
    is_line = QgsWkbTypes.geometryType(shape) == QgsWkbTypes.GeometryType.LineGeometry
    with destination.replacing() as new:
        write_shapes(new, shapes, product.fields, frame, product.drawn, is_line)
    path = str(destination.path)
    if isinstance(value, QgsProcessingOutputLayerDefinition) and value.destinationProject:
        title = values.algorithm.parameterDefinition(name).description()
        details = QgsProcessingContext.LayerDetails(title, value.destinationProject, name)
        values.context.addLayerToLoadOnCompletion(path, details)
    return {name: path}


def vertices_of(feature: QgsFeature) -> np.ndarray:
    """Return the vertices of a line or a point, (n, 3) in units of its layer; heights are NaN where there are none."""
    return _vertices(feature.geometry().vertices())


def _vertices(vertices: QgsVertexIterator) -> np.ndarray:
    import numpy as np

    return np.array([(vertex.x(), vertex.y(), vertex.z()) for vertex in vertices], dtype=float)


def _plain(values: Sequence[Any]) -> list[Any]:
    """Return attributes with None where they are empty, and dates as text."""
    return [None if value == NULL else value.toString() if hasattr(value, "toString") else value for value in values]


def _style(values: ParameterValues, name: str, layer_id: str, style: str, has_system: bool = True) -> None:
    """Apply a style to an output when QGIS loads it, and name it by the cloud of the run."""
    algorithm = values.algorithm
    title = algorithm.parameterDefinition(name).description()
    style_on_load(layer_id, style, values.context, algorithm.layer_properties, title, has_system)
