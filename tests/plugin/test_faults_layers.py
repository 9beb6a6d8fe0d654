"""Invalid and unusual rasters and lines."""

import math

import numpy as np
import pytest
from faults import faults
from memory_layers import layer_of
from osgeo import gdal, osr
from qgis.core import QgsGeometry, QgsLineString, QgsPoint

GAUGE_M, HEAD_M, CELL_M = 1.435, 0.072, 0.0399
KINDS = {np.uint8: gdal.GDT_Byte, np.int16: gdal.GDT_Int16, np.float32: gdal.GDT_Float32}
TAGS = {"RAIL_GAUGE_MM": "1435", "RAIL_HEAD_MM": "72", "RAIL_MODEL": "base"}


def track_cells(bands=1, kind=np.uint8):
    """Two rails from west to east, each 6 m long and two cells wide, with a margin of a metre."""
    cells = np.zeros((bands, 90, 200), kind)
    for row in (25, 25 + round((GAUGE_M + HEAD_M) / CELL_M)):
        cells[:, row : row + 2, 25:175] = 1
    return cells


def raster(
    bench,
    cells=None,
    grid=(500_000, CELL_M, 0, 3_000_000, 0, -CELL_M),
    tags=TAGS,
    epsg=32643,
    texts=("10",),
    nodata=0,
    options=(),
):
    """Write cells, (bands, rows, columns), as a GeoTIFF."""
    cells = track_cells() if cells is None else cells
    kind = KINDS[cells.dtype.type]
    path = bench.folder / "rail.tif"
    size = cells.shape[2], cells.shape[1], len(cells)
    dataset = gdal.GetDriverByName("GTiff").Create(str(path), *size, kind, options=list(options))
    if grid:
        dataset.SetGeoTransform(grid)
    if epsg:
        system = osr.SpatialReference()
        system.ImportFromEPSG(epsg)
        dataset.SetProjection(system.ExportToWkt())
    dataset.SetMetadata(tags)
    for number, band in enumerate(cells, start=1):
        dataset.GetRasterBand(number).WriteArray(band)
        if nodata is not None:
            dataset.GetRasterBand(number).SetNoDataValue(nodata)
        if number <= len(texts):
            dataset.GetRasterBand(number).SetDescription(texts[number - 1])
    dataset = None
    return {"INPUT": path}


def of_raster(**given):
    return lambda bench: raster(bench, **given)


def damaged_cells(bench):
    """A GeoTIFF that opens, but with a first block that cannot be decompressed."""
    parameters = raster(bench, options=["COMPRESS=DEFLATE"])
    dataset = gdal.Open(str(parameters["INPUT"]))
    band = dataset.GetRasterBand(1)
    start, size = (int(band.GetMetadataItem(f"BLOCK_{item}_0_0", "TIFF")) for item in ("OFFSET", "SIZE"))
    band = dataset = None
    with parameters["INPUT"].open("r+b") as file:
        file.seek(start)
        file.write(bytes(size))
    return parameters


def cells_without_rail(nothing, kind):
    """The same with a value other than 0 where there is no rail, as other programs write it."""
    cells = track_cells(kind=kind)
    cells[cells == 0] = nothing
    return cells


def without_system_beside_feet(bench):
    cloud = bench.cloud(np.array([[500_000.0, 3_000_000.0, 100.0], [500_001.0, 3_000_000.0, 100.0]]), epsg=2263)
    return {**raster(bench, epsg=None), "POINTS": cloud}


def over_itself(bench):
    """Overwrites the input."""
    parameters = raster(bench)
    return {**parameters, "OUTPUT": parameters["INPUT"]}


def beside_points(shift_m=0.0, **kind):
    """A raster, and points of this kind."""

    def prepare(bench):
        points = bench.track(length_m=6.0) + [shift_m, -1.7, 0]
        return {**raster(bench), "POINTS": bench.cloud(points, **kind)}

    return prepare


LEFT = "LINESTRING Z (500000 3000001.507 100, 500006 3000001.507 100)"
RIGHT = "LINESTRING Z (500000 3000000 100, 500006 3000000 100)"


def line(*vertices):
    return QgsGeometry(QgsLineString([QgsPoint(*vertex) for vertex in vertices]))


MIDDLE = LEFT.replace("1.507", "0.7535")
FLAT_LEFT, FLAT_RIGHT = (text.replace(" Z", "").replace(" 100)", ")").replace(" 100,", ",") for text in (LEFT, RIGHT))


def lines(*texts, kind="LineStringZ", crs="EPSG:32643", fields="", values=()):
    """A line layer in memory."""

    return lambda bench: {"INPUT": layer_of(*texts, kind=kind, crs=crs, fields=fields, values=values)}


def measured(rails=(LEFT, RIGHT), crs="EPSG:32643", rails_crs="EPSG:32643", points=None):
    """Lines to measure, and a cloud of this kind if there is one."""

    def prepare(bench):
        cloud = {"POINTS": bench.cloud(bench.track(length_m=6.0), **points)} if points else {}
        return {"INPUT": layer_of(MIDDLE, crs=crs), "RAILS": layer_of(*rails, crs=rails_crs), **cloud}

    return prepare


def arc(radius, across):
    r = radius + across
    places = (f"{500_000 + r * math.sin(angle)} {3_000_000 + r * math.cos(angle)} 5" for angle in (0, 0.1, 0.2))
    return f"CIRCULARSTRING Z ({', '.join(places)})"


FAULTS = {
    "vectorizerails": {
        "missing raster": lambda bench: {"INPUT": bench.folder / "gone.tif"},
        "GeoTIFF with damaged cells": damaged_cells,
        "rotated raster": of_raster(grid=(500_000, CELL_M, 0.001, 3_000_000, 0.001, -CELL_M)),
        "cells of 40 m, as of a raster whose unit is wrong": of_raster(grid=(500_000, 40, 0, 3_000_000, 0, -40)),
        "raster in degrees": of_raster(grid=(75, 4e-7, 0, 27, 0, -4e-7), epsg=4326),
        "wrong number of bands (RGB image)": of_raster(cells=track_cells(3), texts=()),
        "two bands for one class": of_raster(cells=track_cells(2), texts=("10", "10")),
        "missing tags": of_raster(tags={}),
        "tags that are not numbers": of_raster(tags={"RAIL_GAUGE_MM": "wide", "RAIL_HEAD_MM": "72"}),
        "tag with an invalid extent": of_raster(tags={**TAGS, "RAIL_EXTENT": "1,2"}),
        "empty raster": of_raster(cells=np.zeros((1, 90, 200), np.uint8)),
        "floating-point cells, NaN without rail": of_raster(cells=cells_without_rail(np.nan, np.float32), nodata=None),
        "16-bit cells, 32767 as the nodata value": of_raster(cells=cells_without_rail(32767, np.int16), nodata=32767),
        "raster without a coordinate system, cloud in feet": without_system_beside_feet,
        "points in another zone than the raster": beside_points(epsg=32644),
        "points of another place than the raster": beside_points(5000.0),
        "points of another class than the raster": beside_points(class_code=11),
        "raster that begins at 1e+300": of_raster(grid=(1e300, CELL_M, 0, 3_000_000, 0, -CELL_M)),
        "raster of 16 million cells that are all rail": of_raster(
            cells=np.ones((1, 4000, 4000), np.uint8), options=["COMPRESS=DEFLATE"]
        ),
    },
    "frpdfcleanup": {
        "tags that contradict the cell size": of_raster(grid=(500_000, 0.5, 0, 3_000_000, 0, -0.5)),
        "tag with an unknown model": of_raster(tags={**TAGS, "RAIL_MODEL": "gone"}),
        "output that overwrites the input": over_itself,
    },
    "measuretrackgeometry": {
        "rails in another zone than their centerlines": measured(rails_crs="EPSG:32644"),
        "centerlines in feet, rails without a coordinate system": measured(crs="EPSG:2263", rails_crs=""),
        "rails beside no centerline": measured([LEFT.replace("1.507", "91.507")]),
        "points in another zone than the rails": measured(points={"epsg": 32644}),
        "points of another class than the rails": measured(points={"class_code": 11}),
    },
    "buildtrackcenterlines": {
        "missing vector file": lambda bench: {"INPUT": bench.folder / "gone.gpkg"},
        "layer without lines": lines(),
        "polygons instead of lines": lines(
            "POLYGON ((500000 3000000, 500001 3000000, 500001 3000001, 500000 3000000))", kind="Polygon"
        ),
        "empty and missing geometries among lines": lines(LEFT, "LINESTRING Z EMPTY", "", RIGHT),
        "multi-part lines": lines(f"MULTILINESTRING Z ({LEFT[13:]}, {RIGHT[13:]})", kind="MultiLineStringZ"),
        "curved lines": lines(arc(100, 0), arc(100, 1.507), kind="CompoundCurveZ"),
        "no heights": lines(FLAT_LEFT, FLAT_RIGHT, kind="LineString"),
        "coordinate of NaN": lines(
            line((500000, 3000001.507, 100), (500003, math.nan, 100), (500006, 3000001.507, 100)), RIGHT
        ),
        "stray vertex 1000 km away": lines(line((500000, 3000001.507, 100), (1_500_000, 3000001.507, 100)), RIGHT),
        "duplicate lines": lines(LEFT, RIGHT, LEFT, RIGHT),
        "2,000 copies of a line": lines(*[LEFT] * 2000),
        "repeated vertices": lines(LEFT.replace("(", "(500000 3000001.507 100, 500000 3000001.507 100, "), RIGHT),
        "self-intersecting line": lines(
            LEFT, RIGHT, "LINESTRING Z (500020 3000000 1, 500030 3000010 1, 500030 3000000 1, 500020 3000010 1)"
        ),
        "vertical line": lines(LEFT, RIGHT, "LINESTRING Z (500020 3000000 1, 500020 3000000 9)"),
        "rails of another gauge": lines(LEFT.replace("1.507", "1.072"), RIGHT),
        "text in the field class_code": lines(
            LEFT, RIGHT, fields="&field=class_code:string", values=[("ten",), ("ten",)]
        ),
        "ids of 5,000 digits": lines(
            LEFT, RIGHT, fields="&field=track_ids:string(9999)", values=[("9" * 5000,), ("9" * 5000,)]
        ),
        "equal rail_id on two rails": lines(LEFT, RIGHT, fields="&field=rail_id:integer", values=[(1,), (1,)]),
        "lines in degrees": lines("LINESTRING Z (75 27 0, 75.1 27 0)", crs="EPSG:4326"),
        "lines without a coordinate system": lines(LEFT, RIGHT, crs=""),
    },
}


@pytest.mark.parametrize("fault", faults("Rasters and lines", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
