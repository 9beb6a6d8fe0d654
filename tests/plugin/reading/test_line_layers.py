"""Line layers of users: drawn by hand, curved, multi-part, without heights, in feet, in degrees."""

import math

import numpy as np
import pytest
from memory_layers import layer_of
from qgis.core import QgsProcessingContext
from rail_extract.core.jobs.features import read_lines
from rail_extract.core.progress import SILENT
from rail_extract.rail_extract_plugin.reading.layers import LayerSource

LEFT = "LINESTRING Z (500000 3000001.507 100, 500020 3000001.507 100)"
RIGHT = "LINESTRING Z (500020 3000000 100.02, 500000 3000000 100.02)"
"""A track of 1435 mm gauge with railheads of 72 mm; the right rail has the opposite direction and is 20 mm higher."""


@pytest.fixture
def layer(qgis):
    """A function that makes layers, in QGIS."""
    return layer_of


class Source:
    """A layer in the form in which algorithms get it."""

    def __init__(self, layer):
        self._layer = layer

    def sourceCrs(self):
        return self._layer.crs()

    def wkbType(self):
        return self._layer.wkbType()

    def getFeatures(self, request, flags):
        return self._layer.getFeatures(request)

    def fields(self):
        return self._layer.fields()

    def featureCount(self):
        return self._layer.featureCount()


def rails_of(layer):
    lines = read_lines(LayerSource("INPUT", Source(layer), QgsProcessingContext()), SILENT)
    return lines.rails(SILENT), lines.frame


def test_lines_keep_their_coordinates(layer):
    rails, frame = rails_of(layer(LEFT, RIGHT))
    assert [(rail.rail_id, rail.class_code, rail.points) for rail in rails] == [(1, 0, 0), (2, 0, 0)]
    np.testing.assert_allclose(
        frame.to_crs(rails[0].xyz), [[500000, 3000001.507, 100], [500020, 3000001.507, 100]], atol=1e-9
    )
    assert np.abs(rails[0].xyz).max() < 200


def test_existing_fields_are_used(layer):
    fields = "&field=rail_id:integer&field=class_code:integer&field=bridged_m:double&field=points:string(5)"
    rails, _ = rails_of(layer(LEFT, RIGHT, fields=fields, values=[(7, 11, 1.5, "many"), (None, None, None, None)]))
    assert [(rail.rail_id, rail.class_code, rail.bridged_m, rail.points) for rail in rails] == [
        (7, 11, 1.5, 0),
        (2, 0, pytest.approx(math.nan, nan_ok=True), 0),
    ]


@pytest.mark.parametrize(
    ("text", "bridged_m", "gaps"),
    [
        ("1.00-3.00,5.00-6.50", 3.5, [[1, 3], [5, 6.5]]),
        (None, 0.0, []),  # no gaps
        ("1.00-3.00,5.0", 3.5, None),  # cut by a format with short texts
        ("1.00-3.00", 3.5, None),
        ("5.00-6.50,1.00-3.00", 3.5, None),
        ("18.00-21.50", 3.5, None),  # beyond the end of the line, which was cut later
        ("unknown", 3.5, None),
        ("nan-nan", 3.5, None),
    ],
)
def test_sections_without_points_are_read_if_they_explain_the_bridged_length(layer, text, bridged_m, gaps):
    fields = "&field=bridged_m:double&field=gaps:string"
    (rail,), _ = rails_of(layer(LEFT, fields=fields, values=[(bridged_m, text)]))
    assert rail.knows_gaps == (gaps is not None)
    np.testing.assert_array_equal(rail.gaps, np.reshape(gaps, (-1, 2)) if rail.knows_gaps else rail.gaps)


def test_every_part_is_a_rail_with_the_id_of_its_feature(layer):
    parts = "MULTILINESTRING Z ((500000 3000000 1, 500010 3000000 1), (500012 3000000 1, 500020 3000000 1))"
    rails, _ = rails_of(layer(parts, LEFT, kind="MultiLineStringZ"))
    assert [(rail.rail_id, round(rail.length_m)) for rail in rails] == [(1, 10), (1, 8), (2, 20)]


def test_curves_become_chords_that_stay_within_half_a_millimetre(layer):
    radius = 100
    arc = "CIRCULARSTRING Z (500100 3000000 5, 500070.710678118655 3000070.710678118655 6, 500000 3000100 7)"
    (rail,), frame = rails_of(layer(arc, kind="CompoundCurveZ"))
    centre = frame.to_local(np.array([500000, 3000000, 0]))
    assert np.abs(np.hypot(*(rail.xyz - centre).T[:2]) - radius).max() < 1e-6
    middles = (rail.xyz[1:] + rail.xyz[:-1]) / 2
    assert np.abs(np.hypot(*(middles - centre).T[:2]) - radius).max() < 0.0006
    assert rail.length_m == pytest.approx(math.hypot(radius * math.pi / 2, 2), abs=0.01)


def test_lines_without_heights_stay_flat(layer):
    flat = "LINESTRING (500000 3000001.507, 500020 3000001.507)"
    (rail,), _ = rails_of(layer(flat, kind="LineString"))
    assert np.isnan(rail.xyz[:, 2]).all()
    assert rail.length_m == pytest.approx(20)


def test_feet_become_metres(layer):
    (rail,), frame = rails_of(layer("LINESTRING Z (980000 200000 10, 980100 200000 10)", crs="EPSG:2263"))
    assert frame.horizontal_unit_m == pytest.approx(1200 / 3937, rel=1e-9)
    assert rail.length_m == pytest.approx(100 * 1200 / 3937)


def test_lines_of_zero_length_and_empty_parts_are_skipped(layer):
    still = "LINESTRING Z (500000 3000000 1, 500000 3000000 1)"
    repeated = "LINESTRING Z (500000 3000000 1, 500000 3000000 1, 500010 3000000 1)"
    rails, _ = rails_of(layer(still, "LINESTRING Z EMPTY", repeated))
    assert [len(rail.xyz) for rail in rails] == [2]
