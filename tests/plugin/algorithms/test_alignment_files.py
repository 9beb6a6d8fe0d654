"""Export Alignment and Import Alignment in QGIS: element tables, files, axes."""

from dataclasses import replace

import numpy as np
import pytest
from memory_layers import layer_of
from qgis.core import QgsFeature, QgsProcessingUtils, QgsVectorLayer, QgsWkbTypes
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from rail_extract.core.fields import ELEMENT_FIELDS
from rail_extract.core.files.table import rows
from rail_extract.core.frame import LocalFrame
from rail_extract.rail_extract_plugin.writing.layers import fields

SHAPES = [
    (100.0, 0, 0),
    (60.0, 0, 1 / 500),
    (80.0, 1 / 500, 1 / 500),
    (70.0, 1 / 500, -1 / 400),
    (50.0, -0.0025, -0.0025),
]
FRAME = LocalFrame(np.array([578_200.0, 5_804_300.0, 0.0]))


def design(track_id=4):
    vertical = [VerticalElement(0, 200, 50, 0.01, 0.01), VerticalElement(200, 160, 52, 0.01, -0.02)]
    cant = [CantElement(0, 100, 0, 0), CantElement(100, 60, 0, -0.1), CantElement(160, 200, -0.1, -0.1)]
    return Alignment(track_id, FRAME, chained((10.0, 20.0 * track_id), 0.4, SHAPES), tuple(vertical), tuple(cant))


def table(*alignments, change=None):
    """An element table without geometries, as a spreadsheet has it."""
    layer = QgsVectorLayer("NoGeometry", "elements", "memory")
    layer.dataProvider().addAttributes(fields(ELEMENT_FIELDS).toList())
    layer.updateFields()
    for row in (row for alignment in alignments for row in rows(alignment)):
        row = {column.name: column.value(row[column.name]) for column in ELEMENT_FIELDS}
        feature = QgsFeature(layer.fields())
        feature.setAttributes(list((change(row) if change else row).values()))
        layer.dataProvider().addFeature(feature)
    return layer


@pytest.fixture
def exported(run_step, tmp_path):
    def export(name, source=None, feedback=None, **parameters):
        path = tmp_path / name
        given = {"INPUT": source or table(design()), "CRS": "EPSG:25832", "OUTPUT": path}
        outcome = run_step("exportalignment", {**given, **parameters}, feedback)
        return outcome, path

    return export


@pytest.fixture
def imported(run_step, context):
    def read(path, **parameters):
        outcome = run_step("importalignment", {"INPUT": path, "ELEMENTS": "memory:", "AXIS": "memory:", **parameters})
        assert outcome.ok, outcome.error
        found = (QgsProcessingUtils.mapLayerFromString(outcome.results[name], context) for name in ("ELEMENTS", "AXIS"))
        return outcome.results, *found

    return read


@pytest.mark.parametrize(
    ("name", "lost"), [("a.xml", "standard errors"), ("a.ifc", "standard errors"), ("a.dxf", "the coordinate system")]
)
def test_the_log_says_what_a_file_does_not_hold(exported, new_feedback, name, lost):
    feedback = new_feedback()
    whole, bare = design(4), replace(design(5), cant=())
    outcome, _ = exported(name, table(whole, bare), feedback=feedback)
    assert outcome.ok, outcome.error
    (said,) = [one for one in feedback.infos if "does not hold" in one]
    assert lost in said and said.endswith("No cant of track 5.")
    assert "No profile" not in said


def test_axes_have_kilometres_as_m_values(exported, imported):
    def with_km(row):
        is_plan = row["layout"] == "H"
        return {**row, "km_from": 12 + row["s_from"] / 1000, "km_to": 12 + row["s_to"] / 1000} if is_plan else row

    outcome, path = exported("a.xml", table(design(), change=with_km))
    assert outcome.ok, outcome.error
    _, _, axes = imported(path)
    (axis,) = axes.getFeatures()
    assert QgsWkbTypes.displayString(axes.wkbType()) == "LineStringZM"
    vertices = list(axis.geometry().vertices())
    assert (vertices[0].m(), vertices[-1].m()) == (12.0, pytest.approx(12.36))
    assert (vertices[0].z(), axis["name"], axis["km_to"]) == (50.0, "Track 4", 12.36)
    off = [vertex.distance(vertices[0]) for vertex in vertices]
    assert np.interp(12.05, [one.m() for one in vertices], off) == pytest.approx(50, abs=0.01)


def test_a_dialog_asks_for_no_output_that_needs_tracks(qgis, plugin):
    algorithm = qgis.processingRegistry().createAlgorithmById("railextract:importalignment")
    asked = [one.name() for one in algorithm.destinationParameterDefinitions() if one.createByDefault()]
    assert asked == ["ELEMENTS", "AXIS"]


def test_the_cant_of_tracks_is_compared_with_that_of_the_design(exported, run_step, context):
    _, path = exported("a.xml")
    s = np.arange(20.0, 340.0, 2.0)
    shape, track = FRAME.to_crs(design().xyz(s)), "&field=track_id:integer"
    tracks = layer_of(shape, crs="EPSG:25832", fields=track, values=[(3,)])
    rows = [(3, float(at - s[0]), float(1000 * cant + 4)) for at, cant in zip(s, design().cants(s))]
    fields = f"{track}&field=chainage_m:double&field=cant_mm:double"
    stations = layer_of(kind="Point", crs="EPSG:25832", fields=fields, values=rows)
    outputs = {"ELEMENTS": None, "AXIS": None, "DEVIATIONS": "memory:"}
    outcome = run_step("importalignment", {"INPUT": path, "TRACKS": tracks, "QUALITY": stations, **outputs})
    assert outcome.ok, outcome.error
    found = QgsProcessingUtils.mapLayerFromString(outcome.results["DEVIATIONS"], context).getFeatures()
    off = [one["cant_diff_mm"] for one in found if 25 < one["s"] < 335]
    assert off == pytest.approx([4.0] * len(off), abs=0.1) and len(off) == 309
    alone = run_step("importalignment", {"INPUT": path, "QUALITY": stations, "ELEMENTS": "memory:"})
    assert "QUALITY and RAILS state the cant of measured tracks: choose TRACKS." in alone.error
