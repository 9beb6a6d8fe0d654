"""Coordinate systems: comparing two descriptions, and the warning about the scale factor."""

import pytest
from heard import Heard
from rail_extract.core.clouds.crs import import_pyproj, same_plane, warn_of_scale

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
def test_descriptions_of_one_system_mean_the_same_place(first, second):
    assert same_plane(first, second, PLACE)


@pytest.mark.parametrize(("first", "second"), [("32643", "32644"), ("2263", "32118"), ("32643", "4326")])
def test_other_systems_mean_another_place(first, second):
    assert not same_plane(wkt(f"EPSG:{first}"), wkt(f"EPSG:{second}"), PLACE)


ROME, BERN, ACCRA = (12.5, 41.9), (7.4, 46.9), (-0.2, 5.6)


def warnings_at(code, *places):
    crs = import_pyproj().CRS.from_user_input(code)
    to_plane = import_pyproj().Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    return warnings_of(crs, [to_plane.transform(*place) for place in places])


def warnings_of(crs, places):
    heard = Heard()
    warn_of_scale(crs, places, "It is", heard)
    return heard.warnings


@pytest.mark.parametrize(
    ("code", "place"),
    [
        ("EPSG:32632", BERN),
        ("EPSG:32633", BERN),  # a zone too far east
        ("EPSG:2056", BERN),
        ("EPSG:2154+5720", (9.1, 41.6)),  # the south of Corsica, 0.26 %
        ("EPSG:2263", (-73.9, 40.7)),  # feet
        ('LOCAL_CS["here",UNIT["metre",1]]', (5.0, 5.0)),
    ],
)
def test_a_scale_factor_near_1_gives_no_warning(code, place):
    if code.startswith("LOCAL"):
        assert not warnings_of(import_pyproj().CRS.from_user_input(code), [place])
    else:
        assert not warnings_at(code, place)


@pytest.mark.parametrize(
    ("code", "place", "factor", "zone"),
    [
        ("EPSG:3857", ROME, "1.347", "UTM zone 33N (EPSG:32633)"),
        ("EPSG:3857", ACCRA, "1.011", "UTM zone 30N (EPSG:32630)"),
        ("EPSG:5070", (-121.0, 48.0), "1.007", "UTM zone 10N (EPSG:32610)"),  # equal area
    ],
)
def test_another_scale_factor_is_named(code, place, factor, zone):
    (said,) = warnings_at(code, place)
    assert f"whose scale factor of {factor} there" in said
    assert said.endswith(f"reproject it, for example to {zone}.")


def test_a_stray_corner_gives_no_warning():
    assert not warnings_at("EPSG:32632", BERN, (60.0, 46.9))


def test_places_outside_the_system_are_ignored():
    assert not warnings_of(import_pyproj().CRS.from_epsg(32632), [(float("nan"), 0.0), (1e300, 1e300)])
