"""Invalid and unusual rasters and lines."""

import math

import numpy as np
import pytest
from faults import FINE, WARNED, Fault, refused
from memory_layers import layer_of
from osgeo import gdal, osr
from qgis.core import QgsGeometry, QgsLineString, QgsPoint, QgsVectorLayer

TITLE = "Rasters and lines"
NAN, INFINITE = float("nan"), float("inf")

LENGTH_M, GAUGE_M, HEAD_M, CELL_M = 6.0, 1.435, 0.072, 0.0399
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


def of_raster(change=None, **given):
    """A raster, optionally with changed bytes."""

    def prepare(bench):
        parameters = raster(bench, **given)
        if change:
            parameters["INPUT"].write_bytes(change(parameters["INPUT"].read_bytes()))
        return parameters

    return prepare


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


def as_floats_with_nan():
    cells = track_cells(kind=np.float32)
    cells[cells == 0] = np.nan
    return cells


def inverted_nodata(nothing=255, kind=np.uint8):
    """A value other than 0 where there is no rail, as other programs write it."""
    cells = track_cells(kind=kind)
    cells[cells == 0] = nothing
    return cells


def without_system_beside_feet(bench):
    cloud = bench.cloud(np.array([[500_000.0, 3_000_000.0, 100.0], [500_001.0, 3_000_000.0, 100.0]]), epsg=2263)
    return {**raster(bench, epsg=None), "POINTS": cloud}


def text_file(bench):
    (bench.folder / "rail.tif").write_text("no raster")
    return {"INPUT": bench.folder / "rail.tif"}


def over_itself(bench):
    """Overwrites the input."""
    parameters = raster(bench)
    return {**parameters, "OUTPUT": parameters["INPUT"]}


LEFT = "LINESTRING Z (500000 3000001.507 100, 500006 3000001.507 100)"
RIGHT = "LINESTRING Z (500000 3000000 100, 500006 3000000 100)"


def line(*vertices):
    return QgsGeometry(QgsLineString([QgsPoint(*vertex) for vertex in vertices]))


FLAT_LEFT, FLAT_RIGHT = (text.replace(" Z", "").replace(" 100)", ")").replace(" 100,", ",") for text in (LEFT, RIGHT))


def lines(*texts, kind="LineStringZ", crs="EPSG:32643", fields="", values=()):
    """A line layer in memory."""

    return lambda bench: {"INPUT": layer_of(*texts, kind=kind, crs=crs, fields=fields, values=values)}


def table(bench):
    return {"INPUT": QgsVectorLayer("None?field=rail_id:integer", "table", "memory")}


def no_vector_file(bench):
    (bench.folder / "lines.gpkg").write_bytes(b"SQLite format 3\0" + bytes(50))
    return {"INPUT": bench.folder / "lines.gpkg"}


def arc(radius, across):
    r = radius + across
    places = (f"{500_000 + r * math.sin(angle)} {3_000_000 + r * math.cos(angle)} 5" for angle in (0, 0.1, 0.2))
    return f"CIRCULARSTRING Z ({', '.join(places)})"


ONE_TRACK = {"CENTERLINE_COUNT": 1}
TWO_RAILS = {"RAIL_COUNT": 2}
NO_TRACKS = {"CENTERLINE_COUNT": 0}
V, B = "vectorizerails", "buildtrackcenterlines"

RASTERS = [
    refused(
        "text file instead of a raster",
        text_file,
        "INPUT can't be …/rail.tif: give a raster layer, or a raster file that can be read.",
    ),
    refused(
        "missing raster",
        lambda bench: {"INPUT": bench.folder / "gone.tif"},
        "INPUT can't be …/gone.tif: give a raster layer, or a raster file that can be read.",
    ),
    refused(
        "GeoTIFF truncated in the header",
        of_raster(lambda data: data[:60]),
        "INPUT can't be …/rail.tif: give a raster layer, or a raster file that can be read.",
    ),
    refused("GeoTIFF with damaged cells", damaged_cells, "rail.tif is damaged at row 0, column 0: create it again."),
    refused(
        "rotated raster",
        of_raster(grid=(500_000, CELL_M, 0.001, 3_000_000, 0.001, -CELL_M)),
        "rail.tif is rotated or its cells are not square: warp it to square cells, north up.",
    ),
    refused(
        "non-square cells",
        of_raster(grid=(500_000, CELL_M, 0, 3_000_000, 0, -0.05)),
        "rail.tif is rotated or its cells are not square: warp it to square cells, north up.",
    ),
    refused(
        "cells of 40 m, as of a raster whose unit is wrong",
        of_raster(grid=(500_000, 40, 0, 3_000_000, 0, -40)),
        "rail.tif has cells of 40 m, and rails are seen in cells of 0.001 to 0.5 m: rasterize the points again, or "
        "check the coordinate system.",
    ),
    refused(
        "south-up raster",
        of_raster(grid=(500_000, CELL_M, 0, 3_000_000, 0, CELL_M)),
        "rail.tif is rotated or its cells are not square: warp it to square cells, north up.",
    ),
    refused(
        "raster without georeference",
        of_raster(grid=None, epsg=None),
        "rail.tif is rotated or its cells are not square: warp it to square cells, north up.",
    ),
    refused(
        "raster in degrees",
        of_raster(grid=(75, 4e-7, 0, 27, 0, -4e-7), epsg=4326),
        "Lengths can't be computed in WGS 84: use a projected coordinate system.",
    ),
    refused(
        "wrong number of bands (RGB image)",
        of_raster(cells=track_cells(3), texts=()),
        "rail.tif has 3 bands, and not every description is a class code: give a raster with one band, or "
        "with one band per class as from Rasterize Rail Points.",
    ),
    refused(
        "band description that is not a class",
        of_raster(cells=track_cells(2), texts=("10", "300")),
        "rail.tif has 2 bands, and not every description is a class code: give a raster with one band, or "
        "with one band per class as from Rasterize Rail Points.",
    ),
    refused(
        "two bands for one class",
        of_raster(cells=track_cells(2), texts=("10", "10")),
        "rail.tif has several bands for one class (10, 10): give one band per class.",
    ),
    refused(
        "missing tags",
        of_raster(tags={}),
        "The raster does not state its gauge and railhead width (tags RAIL_GAUGE_MM and RAIL_HEAD_MM): fill in "
        "GAUGE and HEAD_WIDTH.",
    ),
    refused(
        "tags that are not numbers",
        of_raster(tags={"RAIL_GAUGE_MM": "wide", "RAIL_HEAD_MM": "72"}),
        "The tag RAIL_GAUGE_MM of the raster can't be 'wide': rasterize the points again.",
    ),
    refused(
        "tags that are NaN",
        of_raster(tags={"RAIL_GAUGE_MM": "nan", "RAIL_HEAD_MM": "72"}),
        "The tag RAIL_GAUGE_MM of the raster can't be 'nan': rasterize the points again.",
    ),
    refused(
        "tag with an invalid extent",
        of_raster(tags={**TAGS, "RAIL_EXTENT": "1,2"}),
        "The tag RAIL_EXTENT of the raster can't be '1,2': rasterize the points again.",
    ),
    refused(
        "tags that contradict the cell size",
        of_raster(grid=(500_000, 0.5, 0, 3_000_000, 0, -0.5)),
        "The raster's cells are 500.0 mm wide, but a gauge of 1435 mm with a railhead of 72.0 mm needs 39.9 "
        "mm: rasterize the points for these rails, or correct GAUGE and HEAD_WIDTH.",
        run="frpdfcleanup",
    ),
    Fault(
        "tag with an unknown model", of_raster(tags={**TAGS, "RAIL_MODEL": "gone"}), FINE, gives={}, run="frpdfcleanup"
    ),
    refused(
        "empty raster",
        of_raster(cells=np.zeros((1, 90, 200), np.uint8)),
        "rail.tif has no rail cell: give a raster with 1 where there is rail.",
    ),
    Fault(
        "raster with a single cell",
        of_raster(cells=np.ones((1, 1, 1), np.uint8)),
        WARNED,
        "Without POINTS, the rails have no heights and are only as accurate as the raster. "
        "Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        {"RAIL_COUNT": 0},
    ),
    Fault(
        "raster with rail in all cells",
        of_raster(cells=np.ones((1, 90, 200), np.uint8)),
        WARNED,
        "Without POINTS, the rails have no heights and are only as accurate as the raster.",
        {},
    ),
    Fault(
        "floating-point cells, NaN without rail",
        of_raster(cells=as_floats_with_nan(), nodata=None),
        WARNED,
        "Without POINTS, the rails have no heights and are only as accurate as the raster.",
        TWO_RAILS,
    ),
    Fault(
        "255 as the nodata value",
        of_raster(cells=inverted_nodata(), nodata=255),
        WARNED,
        "Without POINTS, the rails have no heights and are only as accurate as the raster.",
        TWO_RAILS,
    ),
    Fault(
        "16-bit cells, 32767 as the nodata value",
        of_raster(cells=inverted_nodata(32767, np.int16), nodata=32767),
        WARNED,
        "Without POINTS, the rails have no heights and are only as accurate as the raster.",
        TWO_RAILS,
    ),
    Fault(
        "no nodata value",
        of_raster(nodata=None),
        WARNED,
        "Without POINTS, the rails have no heights and are only as accurate as the raster.",
        TWO_RAILS,
    ),
    refused(
        "raster without a coordinate system, cloud in feet",
        without_system_beside_feet,
        "POINTS are in NAD83 / New York Long Island (ftUS), whose unit is not the metre: assign a coordinate system to "
        "the raster too.",
    ),
    Fault("output that overwrites the input", over_itself, run="frpdfcleanup"),
    *(
        refused(
            f"raster that begins at {x:g}",
            of_raster(grid=(x, CELL_M, 0, 3_000_000, 0, -CELL_M)),
            f"rail.tif begins at {x:g}, 3e+06, where no rails can be: rasterize the points again.",
        )
        for x in (1e300, float("nan"))
    ),
    refused(
        "raster with an infinite extent",
        of_raster(tags={**TAGS, "RAIL_EXTENT": "-inf,0,inf,1"}),
        "The tag RAIL_EXTENT of the raster can't be '-inf,0,inf,1': rasterize the points again.",
    ),
    refused(
        "raster of 16 million cells that are all rail",
        of_raster(cells=np.ones((1, 4000, 4000), np.uint8), options=["COMPRESS=DEFLATE"]),
        "rail.tif is not a rail raster, because 100% of its cells are rail: give the output of Rasterize Rail Points.",
    ),
]

LINES = [
    refused(
        "damaged vector file",
        no_vector_file,
        "INPUT can't be …/lines.gpkg: give a vector layer, or a vector file that can be read.",
    ),
    refused(
        "missing vector file",
        lambda bench: {"INPUT": bench.folder / "gone.gpkg"},
        "INPUT can't be …/gone.gpkg: give a vector layer, or a vector file that can be read.",
    ),
    refused("layer without lines", lines(), "INPUT has no lines: give a line layer."),
    refused("table without geometry", table, "INPUT has the geometry type NoGeometry: give a line layer."),
    refused(
        "points instead of lines",
        lines("POINT (500000 3000000)", kind="Point"),
        "INPUT has the geometry type Point: give a line layer.",
    ),
    refused(
        "polygons instead of lines",
        lines("POLYGON ((500000 3000000, 500001 3000000, 500001 3000001, 500000 3000000))", kind="Polygon"),
        "INPUT has the geometry type Polygon: give a line layer.",
    ),
    Fault("empty and missing geometries among lines", lines(LEFT, "LINESTRING Z EMPTY", "", RIGHT), gives=ONE_TRACK),
    refused("only empty geometries", lines("LINESTRING Z EMPTY", ""), "INPUT has no lines: give a line layer."),
    refused(
        "line of zero length",
        lines("LINESTRING Z (500000 3000000 1, 500000 3000000 1)"),
        "INPUT has no lines: give a line layer.",
    ),
    Fault(
        "multi-part lines",
        lines(f"MULTILINESTRING Z ({LEFT[13:]}, {RIGHT[13:]})", kind="MultiLineStringZ"),
        gives=ONE_TRACK,
    ),
    Fault("curved lines", lines(arc(100, 0), arc(100, 1.507), kind="CompoundCurveZ"), gives=ONE_TRACK),
    Fault(
        "no heights",
        lines(FLAT_LEFT, FLAT_RIGHT, kind="LineString"),
        WARNED,
        "2 of 2 lines have no heights, so their results have none.",
        ONE_TRACK,
    ),
    Fault(
        "one height of NaN",
        lines(line((500000, 3000001.507, 100), (500006, 3000001.507, NAN)), RIGHT),
        WARNED,
        "1 of 2 lines have no heights, so their results have none.",
        ONE_TRACK,
    ),
    refused(
        "coordinate of NaN",
        lines(line((500000, 3000001.507, 100), (500003, NAN, 100), (500006, 3000001.507, 100)), RIGHT),
        "INPUT has a line (feature 1) with a coordinate that is not a number, or larger than 1e+10: "
        "repair or delete it.",
    ),
    refused(
        "infinite coordinate",
        lines(line((500000, 3000001.507, 100), (INFINITE, 3000001.507, 100)), RIGHT),
        "INPUT has a line (feature 1) with a coordinate that is not a number, or larger than 1e+10: "
        "repair or delete it.",
    ),
    refused(
        "coordinates of 1e154",
        lines(line((0, 1e154, 100), (0, 1e154, 1e90), (9, 1e154, 100)), RIGHT),
        "INPUT has a line (feature 1) with a coordinate that is not a number, or larger than 1e+10: "
        "repair or delete it.",
    ),
    refused(
        "height of 1e90",
        lines(line((500000, 3000001.507, 100), (500006, 3000001.507, 1e90)), RIGHT),
        "INPUT has a line (feature 1) with a coordinate that is not a number, or larger than 1e+10: "
        "repair or delete it.",
    ),
    refused(
        "stray vertex 1000 km away",
        lines(line((500000, 3000001.507, 100), (1_500_000, 3000001.507, 100)), RIGHT),
        "INPUT has a line (feature 1) with a stray vertex: repair or delete it.",
    ),
    refused(
        "vertex 20 km away, from which the line comes back",
        lines(line((500000, 3000001.507, 100), (520_000, 3000001.507, 100), (500006, 3000001.507, 100)), RIGHT),
        "INPUT has a line (feature 1) with a stray vertex: repair or delete it.",
    ),
    Fault(
        "duplicate lines",
        lines(LEFT, RIGHT, LEFT, RIGHT),
        WARNED,
        "2 of 4 lines are duplicates: their results appear twice.",
        {"CENTERLINE_COUNT": 2},
    ),
    Fault(
        "2,000 copies of a line",
        lines(*[LEFT] * 2000),
        WARNED,
        "1999 of 2000 lines are duplicates: their results appear twice. More than 25 lines are within 1 m of each "
        "other on … m of their length, which is not paired: remove copies of lines. No two rails run parallel: there "
        "are rails but no track centerlines.",
        {"CENTERLINE_COUNT": 0},
    ),
    Fault(
        "repeated vertices",
        lines(LEFT.replace("(", "(500000 3000001.507 100, 500000 3000001.507 100, "), RIGHT),
        gives=ONE_TRACK,
    ),
    Fault(
        "self-intersecting line",
        lines(LEFT, RIGHT, "LINESTRING Z (500020 3000000 1, 500030 3000010 1, 500030 3000000 1, 500020 3000010 1)"),
        gives=ONE_TRACK,
    ),
    Fault(
        "closed line",
        lines(LEFT, RIGHT, "LINESTRING Z (500020 3000000 1, 500030 3000010 1, 500030 3000000 1, 500020 3000000 1)"),
        gives=ONE_TRACK,
    ),
    Fault("vertical line", lines(LEFT, RIGHT, "LINESTRING Z (500020 3000000 1, 500020 3000000 9)"), gives=ONE_TRACK),
    Fault(
        "only one rail",
        lines(LEFT),
        WARNED,
        "No two rails run parallel: there are rails but no track centerlines.",
        NO_TRACKS,
    ),
    refused(
        "rails of another gauge",
        lines(LEFT.replace("1.507", "1.072"), RIGHT),
        "No track of 1435 mm gauge found: rails are 1072 mm apart, is the gauge 1000 mm?",
    ),
    Fault(
        "rails crossing at a right angle",
        lines(LEFT, "LINESTRING Z (500003 2999997 100, 500003 3000004 100)"),
        WARNED,
        "No two rails run parallel: there are rails but no track centerlines.",
        NO_TRACKS,
    ),
    Fault(
        "text in the field class_code",
        lines(LEFT, RIGHT, fields="&field=class_code:string", values=[("ten",), ("ten",)]),
        gives=ONE_TRACK,
    ),
    Fault(
        "class code of 1e300",
        lines(LEFT, RIGHT, fields="&field=class_code:double", values=[(1e300,), (1e300,)]),
        gives=ONE_TRACK,
    ),
    Fault(
        "ids of 5,000 digits",
        lines(LEFT, RIGHT, fields="&field=track_ids:string(9999)", values=[("9" * 5000,), ("9" * 5000,)]),
        gives=ONE_TRACK,
    ),
    Fault(
        "equal rail_id on two rails",
        lines(LEFT, RIGHT, fields="&field=rail_id:integer", values=[(1,), (1,)]),
        gives=ONE_TRACK,
    ),
    Fault(
        "lines without a coordinate system",
        lines(LEFT, RIGHT, crs=""),
        WARNED,
        "The lines have no coordinate system: their coordinates are taken as metres.",
        ONE_TRACK,
    ),
    refused(
        "lines in degrees",
        lines("LINESTRING Z (75 27 0, 75.1 27 0)", crs="EPSG:4326"),
        "The lines are in degrees (WGS 84), where lengths can't be measured: reproject them, for example to "
        "the UTM zone of the place.",
    ),
]

FAULTS = [*RASTERS, *LINES]


@pytest.mark.parametrize("fault", RASTERS, ids=lambda fault: fault.name)
def test_raster(meet, fault):
    meet(fault, "vectorizerails")


@pytest.mark.parametrize("fault", LINES, ids=lambda fault: fault.name)
def test_lines(meet, fault):
    meet(fault, "buildtrackcenterlines")
