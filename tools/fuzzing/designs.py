"""Designs, kilometres and areas in every format of layers, to be damaged and read through QGIS by what takes them."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from osgeo import gdal, ogr, osr
from qgis.core import QgsFeature, QgsFeatureRequest, QgsProcessingContext, QgsVectorLayer, QgsWkbTypes
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from rail_extract.core.design_numbers import MAX_KM, MAX_PLACE_M
from rail_extract.core.files.design_files import write_designs
from rail_extract.core.files.landxml_reading import read_landxml
from rail_extract.core.files.table import rows
from rail_extract.core.frame import LocalFrame
from rail_extract.core.standards import STANDARDS

from .clouds import small_cloud
from .layers import check, compact, run

gdal.UseExceptions()

DRIVERS = {".gpkg": "GPKG", ".shp": "ESRI Shapefile", ".csv": "CSV"}
"""Formats that GDAL writes; GeoJSON is written here, because GDAL refuses coordinates that are not numbers."""

EPSG = 32643

EAST, NORTH = 500_000.0, 3_000_000.0

VALUES = (
    *(0.0, -0.0, -1.0, -139.0, 1e-3, 1e-300, 0.5, 7.0, 1e5, 1e9, 1.1e9, 1e18, 1e200, -1e200, 1e308, -1e308),
    *(math.inf, -math.inf, math.nan, 2**31, -(2**31) - 1, 2.0**63, None, "", "text", "0.1+00", "1e400", " 12,5 "),
    *("7\n  0\nENDSEC\n  0\nEOF", "٣", "<&\">'", "\x00\x1b", "H", "clothoid", "9" * 400, "x" * 3000),
)
"""Values that take the place of a coordinate or an attribute."""

CLOUD = "cloud.las"

USES = {
    "seeds": ("SEEDS", {"growrailpoints": {"OUTPUT": "out.las"}}),
    "mask": ("MASK", {"classifyrailpoints": {"OUTPUT": "out.las"}}),
    "guide": (
        "GUIDE",
        {"classifyrailpoints": {"OUTPUT": "out.las"}, "airbornecenterlines": {"CENTERLINES": "centerlines.gpkg"}},
    ),
}
"""Layers of areas: the parameter that takes each, and the algorithms that have it, with their outputs."""

FURTHER = MAX_PLACE_M + 1e6
"""What no coordinate, station or length of a result exceeds."""

Number = re.compile(r"(?<![\w.])[+-]?(?:nan|inf|infinity)(?![\w.])", re.IGNORECASE)


@dataclass(frozen=True)
class Row:
    """A feature: the kind of its geometry, its vertices with x, y, z and M, and its attributes."""

    kind: str
    vertices: tuple[tuple[Any, ...], ...]
    values: dict[str, Any]


def _design() -> Alignment:
    """Return a straight, a clothoid and an arc with profile and cant."""
    plan = chained((0.0, 0.0), 0.1, [(100.0, 0.0, 0.0), (60.0, 0.0, 1 / 300), (139.0, 1 / 300, 1 / 300)])
    plan = tuple(
        replace(one, figures=replace(one.figures, km_from=1 + one.s_from / 1000, km_to=1 + one.s_to / 1000))
        for one in plan
    )
    profile = (VerticalElement(0.0, 200.0, 10.0, 0.01, 0.01), VerticalElement(200.0, 99.0, 12.0, 0.01, -0.005))
    cant = (
        CantElement(0.0, 100.0, 0.0, 0.0),
        CantElement(100.0, 60.0, 0.0, -0.1),
        CantElement(160.0, 139.0, -0.1, -0.1),
    )
    return Alignment(7, LocalFrame(np.array([EAST, NORTH, 0.0])), plan, profile, cant)


@cache
def _good(name: str) -> tuple[Row, ...]:
    """Return the features of an undamaged layer."""

    def at(*places: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        return tuple((EAST + x, NORTH + y, *(more or (100.0, 0.0))) for x, y, *more in places)

    line = at((0, 0, 100, 1000), (60, 1, 100, 1060), (60, 1, 100, 1080), (200, 0, 100, 1220))
    square = at((0, -9), (9, -9), (9, 9), (0, -9))
    made = {
        "elements": [Row("LineString", at((0, 0), (9, 0)), row) for row in rows(_design())],
        "axis": [
            Row("LineString", line, {"name": "A"}),
            Row("LineString", at((200, 0, 100, 1220), (300, 4, 100, 1320)), {"name": "A"}),
        ],
        "posts": [Row("Point", at((100 * n, 3)), {"km": 1 + n / 10}) for n in range(3)],
        "jumps": [Row("Point", at((100, 0)), {"km_back": 1.1, "km_ahead": 1.15})],
        "places": [
            Row("Point", at((50, 2)), {"note": "signal"}),
            Row("Point", at((150, -2)), {"note": "switch"}),
            Row("Point", at((350, -2)), {"note": "beyond"}),
        ],
        "guide": [Row("LineString", at((0, 0), (5, 1), (60, 2)), {"name": "A", "ref": "1", "gauge": "1435"})],
        "mask": [Row("Polygon", square, {"name": "A"}), Row("Polygon", square[::-1], {"name": "B"})],
        "seeds": [Row("LineString", at((0, 0), (5, 1), (60, 2)), {"n": 1}), Row("LineString", at((1, 1), (3, 3)), {})],
    }
    return tuple(made[name])


def write(folder: Path, name: str) -> list[Path]:
    """Write a layer in every format, and the cloud in which an area is."""
    if name in USES:
        small_cloud("1.4", 7).write(folder / CLOUD)
    for suffix in (".geojson", *DRIVERS):
        _put(folder / f"{name}{suffix}", _good(name))
    compact(folder / f"{name}.gpkg")
    return sorted(folder.glob(f"{name}.*"))


def write_xml(folder: Path) -> list[Path]:
    """Write a LandXML file."""
    path = folder / "design.xml"
    write_designs(path, [_design()], STANDARDS["EN_60E1_1435"], True, "1")
    return [path]


def change_values(path: Path, rng: random.Random) -> None:
    """Write a layer again with one to three other coordinates or attributes."""
    found = list(_good(path.stem))
    while tuple(found) == _good(path.stem):
        for _ in range(rng.choice((1, 1, 2, 3))):
            at = rng.randrange(len(found))
            found[at] = _changed(found[at], rng)
        if rng.random() < 0.1:
            found += found[: rng.randint(1, 2)]
    for old in path.parent.glob(f"{path.stem}.*"):
        if old.suffix == path.suffix or (path.suffix not in (*DRIVERS, ".geojson") and old.suffix in DRIVERS):
            old.unlink()
    with suppress(RuntimeError):  # what GDAL does not write is cut off there
        _put(_main(path), found)


def _changed(row: Row, rng: random.Random) -> Row:
    """Return a feature with another value."""
    value = rng.choice(VALUES)
    if rng.random() < 0.5:
        return replace(row, values={**row.values, rng.choice(list(row.values) or ["more"]): value})
    at, axis = rng.randrange(len(row.vertices)), rng.randrange(4)
    number = value if isinstance(value, (int, float)) else math.nan
    vertex = (*row.vertices[at][:axis], float(number), *row.vertices[at][axis + 1 :])
    return replace(row, vertices=(*row.vertices[:at], vertex, *row.vertices[at + 1 :]))


def _main(path: Path) -> Path:
    """Return the file of a layer that is opened: that of a shapefile for all of its files."""
    return path if path.suffix in (".geojson", ".gpkg", ".csv") else path.with_suffix(".shp")


def _put(path: Path, found: Sequence[Row]) -> None:
    """Write features in the format that the name states."""
    if path.suffix == ".geojson":
        path.write_text(json.dumps(_collection(found)), encoding="utf-8", errors="replace")
        return
    system = osr.SpatialReference()
    system.ImportFromEPSG(EPSG)
    options = ["GEOMETRY=AS_WKT", "CREATE_CSVT=NO"] if path.suffix == ".csv" else []
    source = ogr.GetDriverByName(DRIVERS[path.suffix]).CreateDataSource(str(path))
    kind = getattr(ogr, f"wkb{found[0].kind}ZM")
    layer = source.CreateLayer(path.stem, system, kind, options)
    for name in {name: None for row in found for name in row.values}:
        layer.CreateField(ogr.FieldDefn(name, _type_of([row.values.get(name) for row in found])))
    for row in found:
        feature = ogr.Feature(layer.GetLayerDefn())
        for name, value in row.values.items():
            if value is not None and feature.GetFieldIndex(name[:10] if path.suffix == ".shp" else name) >= 0:
                feature.SetField(name[:10] if path.suffix == ".shp" else name, value)
        feature.SetGeometry(_geometry(row))
        layer.CreateFeature(feature)


def _type_of(values: Sequence[Any]) -> int:
    if any(isinstance(value, str) for value in values):
        return ogr.OFTString
    whole = [value for value in values if isinstance(value, int)]
    return ogr.OFTInteger64 if whole and len(whole) == sum(value is not None for value in values) else ogr.OFTReal


def _geometry(row: Row) -> ogr.Geometry:
    shape = ogr.Geometry(ogr.wkbLinearRing if row.kind == "Polygon" else getattr(ogr, f"wkb{row.kind}ZM"))
    for x, y, z, m in row.vertices:
        shape.AddPointZM(x, y, z, m)
    if row.kind != "Polygon":
        return shape
    polygon = ogr.Geometry(ogr.wkbPolygonZM)
    polygon.AddGeometry(shape)
    return polygon


def _collection(found: Sequence[Row]) -> dict[str, Any]:
    features = []
    for row in found:
        places = [vertex[:3] for vertex in row.vertices]
        coordinates = {"Point": places[0], "LineString": places, "Polygon": [places]}[row.kind]
        geometry = {"type": row.kind, "coordinates": coordinates}
        features.append({"type": "Feature", "properties": row.values, "geometry": geometry})
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{EPSG}"}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}


def read_xml(path: Path) -> None:
    """Import a LandXML file: what is made of it is on the map."""
    with run("importalignment", {"INPUT": str(path), "ELEMENTS": "memory:", "AXIS": "memory:"}) as (results, context):
        for feature in _features(results["ELEMENTS"], context):
            _judge_numbers(feature)
            if not feature["s_to"] > feature["s_from"]:
                raise AssertionError(f"an element of length {feature['s_to'] - feature['s_from']}")
        for feature in _features(results["AXIS"], context):
            _judge_numbers(feature)


def read_elements(path: Path) -> None:
    """Export an element table in one of the formats, and read the file again."""
    suffix = (".xml", ".dxf", ".ifc")[path.stat().st_size % 3]
    out = path.with_name(f"out{suffix}")
    with run("exportalignment", {"INPUT": str(_main(path)), "OUTPUT": str(out)}) as (results, _):
        if suffix == ".xml" and len(read_landxml(out)) != results["ALIGNMENT_COUNT"]:
            raise AssertionError("alignments are missing in the LandXML file")
        if suffix == ".dxf":
            drawing = ogr.Open(str(out))
            count, expected = (
                drawing.GetLayer(0).GetFeatureCount(),
                results["ALIGNMENT_COUNT"] + 2 * results["ELEMENT_COUNT"],
            )
            if count != expected:
                raise AssertionError(f"{count} of {expected} entities in the DXF file")
        if found := Number.search(re.sub(r'name="[^"]*"|INF', "", out.read_text(encoding="utf-8"))):
            raise AssertionError(f"{found[0]} in {out.name}")


def read_axis(path: Path) -> None:
    """Locate places along a damaged axis: with M values where the format has them, else with a first kilometre."""
    start = {} if path.suffix in (".gpkg", ".shp") else {"START_KM": 1.0}
    _locate({"AXIS": str(_main(path)), "INPUT": _undamaged("places"), **start})


def read_posts(path: Path) -> None:
    """Locate places along an axis with damaged posts."""
    _locate({"POSTS": str(_main(path)), "AXIS": _undamaged("axis"), "INPUT": _undamaged("places")})


def read_jumps(path: Path) -> None:
    """Locate places along an axis with damaged jumps."""
    others = {"AXIS": _undamaged("axis"), "INPUT": _undamaged("places")}
    _locate({"JUMPS": str(_main(path)), **others, "START_KM": 1.0})


def read_places(path: Path) -> None:
    """Locate damaged places."""
    _locate({"INPUT": str(_main(path)), "AXIS": _undamaged("axis"), "START_KM": 1.0})


@cache
def _undamaged(name: str) -> QgsVectorLayer:
    """Return another layer, which is opened once only: opening takes longer than all that follows."""
    path = f"/vsimem/{name}.gpkg"
    _put(Path(path), _good(name))
    return QgsVectorLayer(path, name, "ogr").materialize(QgsFeatureRequest())


def _locate(parameters: dict[str, Any]) -> None:
    """Run Station Along Axis: kilometres are numbers of a railway, or empty."""
    with run("stationalongaxis", {**parameters, "OUTPUT": "memory:"}) as (results, context):
        for feature in _features(results["OUTPUT"], context):
            known = [feature[name] for name in ("km", "offset_m") if isinstance(feature[name], float)]
            if not all(abs(value) <= max(2 * MAX_KM, FURTHER) for value in known):
                raise AssertionError(f"{known} as kilometre and offset")


def read_area(path: Path) -> None:
    """Check the values of the algorithms that take seeds, a guide or a mask; they read them then."""
    (name, algorithms), context = USES[path.stem], QgsProcessingContext()
    given = {"INPUT": str(path.with_name(CLOUD)), name: str(_main(path))}
    for algorithm, outputs in algorithms.items():
        check(algorithm, {**given, **{key: str(path.with_name(out)) for key, out in outputs.items()}}, context)


def _features(layer_id: str, context: QgsProcessingContext) -> Iterator[QgsFeature]:
    return context.getMapLayer(layer_id).getFeatures()


def _judge_numbers(feature: QgsFeature) -> None:
    """Refuse numbers and vertices that are on no map."""
    numbers = [value for value in feature.attributes() if isinstance(value, float)]
    shape = feature.geometry()
    for vertex in shape.vertices():
        numbers += [vertex.x(), vertex.y()]
        numbers += [vertex.m()] if QgsWkbTypes.hasM(shape.wkbType()) and not math.isnan(vertex.m()) else []
        numbers += [vertex.z()] if not math.isnan(vertex.z()) else []
    if not all(abs(value) <= FURTHER for value in numbers):
        raise AssertionError(f"{next(value for value in numbers if not abs(value) <= FURTHER)} in the result")
