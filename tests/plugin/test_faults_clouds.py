"""Clouds with unusual points or coordinate systems."""

import json

import laspy
import numpy as np
import pytest
from faults import WARNED, Fault, refused
from laspy.vlrs.known import WktCoordinateSystemVlr
from rail_extract.core.clouds.crs import import_pyproj

TITLE = "Points and coordinate systems"

TRACK, NOTHING = {"RAIL_COUNT": 2, "CENTERLINE_COUNT": 1}, {"RAIL_COUNT": 0, "CENTERLINE_COUNT": 0}
PLACE = np.array([500_000.0, 3_000_000.0, 100.0])


def of(change):
    """A cloud made from the points of a track of 6 m."""
    return lambda bench: {"INPUT": bench.cloud(change(bench.track(length_m=6.0))), "ITERATIONS": 1}


def scattered(*sides_m, count=3600):
    """Random points in a box."""
    return of(lambda points: PLACE + np.random.default_rng(2).uniform(0, sides_m, (count, 3)))


def strays(count):
    """Points anywhere within 1000 km."""
    return PLACE + np.random.default_rng(3).uniform(-5e5, 5e5, (count, 3)) * [1, 1, 0]


def grating():
    """Points along lines that are closer together than rails can be."""
    rng = np.random.default_rng(5)
    return np.concatenate(
        [
            np.column_stack([rng.uniform(0, 10, 1000), 0.3 * number + rng.uniform(-0.036, 0.036, 1000), np.zeros(1000)])
            for number in range(100)
        ]
    )


def cross(points):
    """The track, and a copy turned by a right angle about its middle."""
    middle = PLACE + [3, 0, 0]
    x, y, z = (points - middle).T
    return np.concatenate([points, middle + np.column_stack([-y, x, z])])


POINTS = [
    Fault(
        "100 lines of points 0.3 m apart",
        lambda bench: {"INPUT": bench.cloud(PLACE + grating(), "cloud.laz"), "ITERATIONS": 1},
        WARNED,
        "Only … % of the points of class 10 are within 0.2 m of a rail: check the rail classes and the rail standard.…",
    ),
    Fault(
        "points exactly on a line",
        of(lambda points: PLACE + np.column_stack([np.linspace(0, 20, 2000), np.zeros((2000, 2))])),
        WARNED,
        "No two rails run parallel: there are rails but no track centerlines.",
        {"RAIL_COUNT": 1, "CENTERLINE_COUNT": 0},
    ),
    Fault(
        "one point",
        of(lambda points: points[:1]),
        WARNED,
        "Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        NOTHING,
    ),
    Fault(
        "two points",
        of(lambda points: points[:2]),
        WARNED,
        "Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        NOTHING,
    ),
    Fault(
        "all points at one position",
        of(lambda points: np.tile(points[:1], (3000, 1))),
        WARNED,
        "All points of class 10 are within 0 m of each other: if the coordinates are in kilometres, assign a "
        "coordinate system that says so. Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        NOTHING,
    ),
    Fault("all points duplicated", of(lambda points: np.repeat(points, 2, axis=0)), gives=TRACK),
    Fault(
        "only one rail",
        scattered(30, 0.07, 0.005),
        WARNED,
        "No two rails run parallel: there are rails but no track centerlines.",
        {"RAIL_COUNT": 1, "CENTERLINE_COUNT": 0},
    ),
    Fault(
        "vertical wall",
        scattered(30, 0.01, 3),
        WARNED,
        "No two rails run parallel: there are rails but no track centerlines.",
    ),
    Fault(
        "points scattered over a square",
        scattered(6, 6, 0.1),
        WARNED,
        "Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        NOTHING,
    ),
    Fault(
        "dense patch of points",
        scattered(2, 2, 0.1, count=20_000),
        WARNED,
        "Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
    ),
    Fault("tracks crossing at a right angle", of(cross), gives={"RAIL_COUNT": 4, "CENTERLINE_COUNT": 2}),
    Fault(
        "track shorter than MIN_LENGTH",
        of(lambda points: points[points[:, 0] < 500_000.5]),
        WARNED,
        "Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        NOTHING,
    ),
    Fault(
        "rails of another gauge",
        of(lambda points: points + np.where(points[:, 1:2] > 3_000_000, [0, 0.1, 0], 0)),
        WARNED,
        "Rails are 160… mm apart, with heads 7… mm wide; 1507 mm apart are expected: is it Russia R65, 1520 mm "
        "(unconfirmed width) (RU_R65_1520)? No track of 1435 mm gauge found.",
    ),
    Fault(
        "stray point 1000 km away", of(lambda points: np.append(points, points[:1] + [1e6, 0, 0], axis=0)), gives=TRACK
    ),
    Fault(
        "stray point 100 km above the track",
        of(lambda points: np.append(points, points[:1] + [0, 0, 1e5], axis=0)),
        gives=TRACK,
    ),
    Fault("5,000 stray points over 1000 km", of(lambda points: np.concatenate([points, strays(5000)])), gives=TRACK),
    refused(
        "5,000 stray points over 1000 km, and nothing else",
        of(lambda points: strays(5000)),
        "The points of class 10 are … m apart over … m, too far for rails: if the coordinates are in centimetres or "
        "millimetres, assign a coordinate system that says so.",
    ),
    *(
        refused(
            f"coordinates in {unit}, which the file does not state",
            of(lambda points, factor=factor: PLACE + (points - PLACE) * factor),
            "The points of class 10 are … m apart over … m, too far for rails: if the coordinates are in centimetres "
            f"or millimetres, assign a coordinate system that says so.{more}",
        )
        for unit, factor, more in (
            ("centimetres", 100, " For an airborne cloud, use Track Centerlines from Airborne Lidar."),
            ("millimetres", 1000, ""),
        )
    ),
    Fault(
        "coordinates in kilometres, which the file does not state",
        of(lambda points: PLACE + (points - PLACE) / 1000),
        WARNED,
        "All points of class 10 are within 0.006 m of each other: if the coordinates are in kilometres, assign a "
        "coordinate system that says so. Class 10 has no rails: check the rail classes, the standard and MIN_LENGTH.",
        NOTHING,
    ),
    Fault("all heights zero", of(lambda points: points * [1, 1, 0]), gives=TRACK),
]


def tiles(*systems, **parameters):
    """A folder of tiles, each with half of the track's points, in these coordinate systems."""

    def prepare(bench):
        folder, points = bench.folder / "tiles", bench.track(length_m=6.0)
        folder.mkdir()
        for number, (epsg, half) in enumerate(zip(systems, (points[::2], points[1::2]))):
            bench.cloud(half, f"tile{number}.las", epsg=epsg, folder=folder)
        return {"INPUT": folder, **parameters}

    return prepare


def in_system(epsg, scale=1.0, place=(0, 0, 0), **parameters):
    """The points in another coordinate system: scaled, then shifted."""

    def prepare(bench):
        points = (bench.track(length_m=6.0) - PLACE) * scale + place
        return {"INPUT": bench.cloud(points, epsg=epsg), **parameters}

    return prepare


def with_broken_system(bench):
    path = bench.cloud(bench.track(length_m=6.0))
    path.write_bytes(path.read_bytes().replace(b"PROJCRS[", b"PROJCRX[").replace(b"PROJCS[", b"PROJCX["))
    return {"INPUT": path}


def with_wkt(change):
    """The coordinate system of the cloud, as WKT, changed."""

    def prepare(bench):
        cloud = laspy.read(bench.cloud(bench.track(length_m=6.0), epsg=None))
        wkt = change(import_pyproj().CRS.from_epsg(32643).to_wkt("WKT1_GDAL"))
        cloud.header.vlrs.append(WktCoordinateSystemVlr(wkt))
        cloud.header.global_encoding.wkt = True
        cloud.write(bench.folder / "cloud.las")
        return {"INPUT": bench.folder / "cloud.las"}

    return prepare


def in_unit(length):
    return with_wkt(lambda wkt: wkt.replace('UNIT["metre",1', f'UNIT["metre",{length}'))


def beside(system):
    """A compound of the system with another one."""
    return with_wkt(lambda wkt: f'COMPOUNDCRS["both",{import_pyproj().CRS.from_wkt(wkt).to_wkt()},{system}]')


TIME = (
    'TIMECRS["when",TDATUM["x",CALENDAR["proleptic Gregorian"],TIMEORIGIN["0000-01-01"]],CS[TemporalCount,1],'
    'AXIS["time",future],TIMEUNIT["s",1]]'
)
PRESSURE = (
    'PARAMETRICCRS["air",PDATUM["Mean Sea Level"],CS[parametric,1],AXIS["pressure (hPa)",up],PARAMETRICUNIT["hPa",100]]'
)


def drawn_in_mercator(bench):
    rails = [[[1_024_000, y, 100], [1_024_050, y, 100]] for y in (6_446_000, 6_446_001.507)]
    shape = {"type": "MultiLineString", "coordinates": rails}
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}
    feature = {"type": "Feature", "properties": {}, "geometry": shape}
    drawn = {"type": "FeatureCollection", "crs": crs, "features": [feature]}
    (bench.folder / "drawn.geojson").write_text(json.dumps(drawn))
    return {"INPUT": bench.folder / "drawn.geojson"}


FEET = 3937 / 1200
HERE = tuple(PLACE)

SYSTEMS = [
    Fault(
        "no coordinate system",
        in_system(None, 1, HERE),
        WARNED,
        "The cloud has no coordinate system: its coordinates are taken as metres. If it has one, choose it as CRS.",
    ),
    Fault(
        "unreadable coordinate system",
        with_broken_system,
        WARNED,
        "The cloud has no coordinate system: its coordinates are taken as metres. If it has one, choose it as CRS.",
    ),
    refused(
        "coordinates in degrees",
        in_system(4326, (1e-5, 1e-5, 1), (75, 27, 100)),
        "cloud.las is in degrees (WGS 84), where lengths can't be measured: reproject it, for example to UTM "
        "zone 43N (EPSG:32643).",
    ),
    refused(
        "coordinates in degrees out of range",
        in_system(4326, 1, (500_000, 3_000_000, 100)),
        "cloud.las is in degrees (WGS 84), where lengths can't be measured: reproject it, for example to the "
        "UTM zone of the place.",
    ),
    refused(
        "CRS in degrees for a cloud without a coordinate system",
        in_system(None, 1, HERE, CRS="EPSG:4326"),
        "CRS EPSG:4326 is in degrees, where lengths can't be measured: choose a projected one.",
    ),
    refused(
        "geocentric coordinates",
        in_system(4978, 1, (5e6, 3e6, 2e6)),
        "cloud.las: Lengths can't be computed in WGS 84: use a projected coordinate system.",
    ),
    Fault(
        "coordinate system that has no way to WGS 84",
        with_wkt(lambda wkt: wkt.replace("6378137,298.257223563", "1737400,0")),  # the ellipsoid is that of the Moon
    ),
    *(
        refused(
            f"coordinate system with a unit of {length} m",
            in_unit(length),
            f"cloud.las: WGS 84 / UTM zone 43N states a unit of {float(length):g} m, which is impossible: assign the "
            "right coordinate system.",
        )
        for length in ("0", "-1", "1e300")
    ),
    *(
        refused(
            f"{name} in place of a height",
            beside(system),
            f"cloud.las: Lengths can't be computed in {title}, which measures in {unit}: use a projected coordinate "
            "system.",
        )
        for name, system, title, unit in (("time", TIME, "when", "s"), ("pressure", PRESSURE, "air", "hPa"))
    ),
    refused(
        "time in place of coordinates",
        with_wkt(lambda wkt: TIME),
        "cloud.las: Lengths can't be computed in when, which measures in s: use a projected coordinate system.",
    ),
    Fault("US survey feet", in_system(2263, FEET, (980_000, 200_000, 300))),
    Fault("feet in plan, metres in height", in_system("2263+5703", (FEET, FEET, 1), (980_000, 200_000, 100))),
    Fault(
        "Web Mercator",
        in_system(3857, 1, (1_024_000, 6_446_000, 100)),
        WARNED,
        "cloud.las is in WGS 84 / Pseudo-Mercator, whose scale factor of 1.557 there makes lengths and gauges wrong: "
        "reproject it, for example to UTM zone 32N (EPSG:32632).",
    ),
    Fault(
        "rails digitized in Web Mercator",
        drawn_in_mercator,
        WARNED,
        "The lines are in WGS 84 / Pseudo-Mercator, whose scale factor of 1.557 there makes lengths and gauges "
        "wrong: reproject them, for example to UTM zone 32N (EPSG:32632).",
        run="buildtrackcenterlines",
    ),
    refused(
        "tiles in different zones",
        tiles(32643, 32644),
        "tile0.las is in WGS 84 / UTM zone 43N but tile1.las is in WGS 84 / UTM zone 44N: reproject all tiles to one "
        "coordinate system first.",
    ),
    refused(
        "one tile without a coordinate system",
        tiles(32643, None),
        "tile0.las is in WGS 84 / UTM zone 43N but tile1.las is in no coordinate system: reproject all tiles to one "
        "coordinate system first.",
    ),
    Fault("one tile without a coordinate system, CRS set", tiles(32643, None, CRS="EPSG:32643")),
]

FAULTS = [*POINTS, *SYSTEMS]


@pytest.mark.parametrize("fault", POINTS, ids=lambda fault: fault.name)
def test_points(meet, fault):
    meet(fault, "extractrails")


@pytest.mark.parametrize("fault", SYSTEMS, ids=lambda fault: fault.name)
def test_system(meet, fault):
    meet(fault, "rasterizerailpoints")
