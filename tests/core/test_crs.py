"""Whether two descriptions of a coordinate system mean the same places."""

import pytest
from rail_extract.core.crs import import_pyproj, same_plane

PLACE = (500_000.0, 3_000_000.0)


def wkt(code, version="WKT2_2019"):
    return import_pyproj().CRS.from_user_input(code).to_wkt(version)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (wkt("EPSG:32643"), wkt("EPSG:32643", "WKT1_GDAL")),
        (wkt("EPSG:2263+6360"), wkt("EPSG:2263")),
        ('LOCAL_CS["here",UNIT["metre",1]]', 'LOCAL_CS["here",UNIT["metre",1]]'),
    ],
)
def test_same_places(first, second):
    assert same_plane(first, second, PLACE)


@pytest.mark.parametrize(("first", "second"), [("32643", "32644"), ("2263", "32118"), ("32643", "4326")])
def test_other_places(first, second):
    assert not same_plane(wkt(f"EPSG:{first}"), wkt(f"EPSG:{second}"), PLACE)
