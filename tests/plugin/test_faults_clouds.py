"""Clouds with unusual points or coordinate systems."""

import json

import laspy
import numpy as np
import pytest
from faults import faults
from laspy.vlrs.known import WktCoordinateSystemVlr
from rail_extract.core.clouds.crs import import_pyproj

PLACE = np.array([500_000.0, 3_000_000.0, 100.0])


def of(change):
    """A cloud made from the points of a track of 6 m."""
    return lambda bench: {"INPUT": bench.cloud(change(bench.track(length_m=6.0))), "ITERATIONS": 1}


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


of_the_moon = with_wkt(lambda wkt: wkt.replace("6378137,298.257223563", "1737400,0"))
in_units_of_zero = with_wkt(lambda wkt: wkt.replace('UNIT["metre",1', 'UNIT["metre",0'))


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


FAULTS = {
    "extractrails": {
        "100 lines of points 0.3 m apart": of(lambda points: PLACE + grating()),
        "all points at one position": of(lambda points: np.tile(points[:1], (3000, 1))),
        "all points duplicated": of(lambda points: np.repeat(points, 2, axis=0)),
        "only one rail": of(lambda points: PLACE + np.random.default_rng(2).uniform(0, (30, 0.07, 0.005), (3600, 3))),
        "tracks crossing at a right angle": of(cross),
        "rails of another gauge": of(lambda points: points + np.where(points[:, 1:2] > 3_000_000, [0, 0.1, 0], 0)),
        "stray point 1000 km away": of(lambda points: np.append(points, points[:1] + [1e6, 0, 0], axis=0)),
        "5,000 stray points over 1000 km": of(lambda points: np.concatenate([points, strays(5000)])),
        "coordinates in centimetres, which the file does not state": of(lambda points: PLACE + 100 * (points - PLACE)),
        "coordinates in millimetres, which the file does not state": of(lambda points: PLACE + 1000 * (points - PLACE)),
        "coordinates in kilometres, which the file does not state": of(lambda points: PLACE + (points - PLACE) / 1000),
        "all heights zero": of(lambda points: points * [1, 1, 0]),
    },
    "rasterizerailpoints": {
        "no coordinate system": in_system(None, 1, HERE),
        "coordinates in degrees": in_system(4326, (1e-5, 1e-5, 1), (75, 27, 100)),
        "CRS in degrees for a cloud without a coordinate system": in_system(None, 1, HERE, CRS="EPSG:4326"),
        "geocentric coordinates": in_system(4978, 1, (5e6, 3e6, 2e6)),
        "coordinate system that has no way to WGS 84": of_the_moon,
        "coordinate system with a unit of 0 m": in_units_of_zero,
        "time in place of a height": beside(TIME),
        "pressure in place of a height": beside(PRESSURE),
        "US survey feet": in_system(2263, FEET, (980_000, 200_000, 300)),
        "feet in plan, metres in height": in_system("2263+5703", (FEET, FEET, 1), (980_000, 200_000, 100)),
        "Web Mercator": in_system(3857, 1, (1_024_000, 6_446_000, 100)),
        "tiles in different zones": tiles(32643, 32644),
        "one tile without a coordinate system": tiles(32643, None),
        "one tile without a coordinate system, CRS set": tiles(32643, None, CRS="EPSG:32643"),
    },
    "buildtrackcenterlines": {
        "rails digitized in Web Mercator": drawn_in_mercator,
    },
}


@pytest.mark.parametrize("fault", faults("Points and coordinate systems", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
