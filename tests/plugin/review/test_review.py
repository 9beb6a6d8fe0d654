"""The review of findings: what the dock shows, reads and writes, in QGIS without its main window."""

import time

import numpy as np
import pytest
from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsVectorLayer,
)
from qgis.gui import QgsMapCanvas
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtWidgets import QMainWindow
from rail_extract.core.fields import CLEARANCE_FIELDS, FINDING_FIELDS, INTRUSION_FIELDS, RAIL_FIELDS
from rail_extract.core.frame import LocalFrame
from rail_extract.core.jobs.clouds import CloudSource
from rail_extract.core.jobs.result import ShownProfile
from rail_extract.rail_extract_plugin.review.findings import ACCEPTED, REJECTED, reviews
from rail_extract.rail_extract_plugin.review.section_view import PAPER, POINT, PROFILE, RAIL
from rail_extract.rail_extract_plugin.writing.layers import fields
from rail_extract.rail_extract_plugin.writing.run import RUN, properties_of, properties_of_profile

ZERO = LocalFrame(np.zeros(3))


class Window:
    """The part of QGIS's interface that the dock uses."""

    def __init__(self):
        self._window, self._canvas = QMainWindow(), QgsMapCanvas()
        self._canvas.setDestinationCrs(QgsCoordinateReferenceSystem("EPSG:32643"))

    def mainWindow(self):
        return self._window

    def mapCanvas(self):
        return self._canvas


@pytest.fixture
def project(qgis):
    yield QgsProject.instance()
    QgsProject.instance().clear()


@pytest.fixture
def load(project):
    """Add a layer of lines to the project."""

    def load(name, columns, rows, properties=()):
        layer = QgsVectorLayer("LineStringZ?crs=EPSG:32643", name, "memory")
        layer.dataProvider().addAttributes(fields(columns).toList())
        layer.updateFields()
        for wkt, values in rows:
            feature = QgsFeature(layer.fields())
            feature.setGeometry(QgsGeometry.fromWkt(wkt))
            for key, value in values.items():
                feature[key] = value
            assert layer.dataProvider().addFeature(feature)
        for key, value in dict(properties).items():
            layer.setCustomProperty(key, value)
        return project.addMapLayer(layer)

    return load


def section(start, end, **values):
    line = f"LINESTRING Z ({500_000 + start} 3000000 100, {500_000 + end} 3000000 100)"
    return line, {"reason": "a rail has no points", "track_id": 1, "from_m": start, "to_m": end, **values}


ERRORS = {"sigma_mm": 4.9, "sigmaz_mm": 10.7}
ROWS = [
    section(8.0, 10.0, finding=2, worst_m=9.0, gauge_mm=1440.0, **ERRORS),
    section(2.0, 4.0, finding=1, worst_m=3.0),
]


@pytest.fixture
def dock(project, plugin):
    from rail_extract.rail_extract_plugin.review.dock import ReviewDock

    made = []

    def dock():
        window = Window()
        made.append((ReviewDock(window), window))
        return made[-1][0]

    yield dock
    for one, _ in made:
        one.close_for_good()


def wait(qgis, dock):
    for _ in range(400):
        qgis.processEvents()
        if not dock.is_reading:
            return
        time.sleep(0.02)
    raise TimeoutError


def test_findings_come_in_their_order_with_words_and_figures(load, dock):
    load("Findings", FINDING_FIELDS, ROWS)
    shown = dock()
    assert shown.count.text() == "1 of 2; 0 reviewed"
    assert shown.reason.text() == "A rail has no points"
    assert shown.text.text().startswith("Track 1, 2.0 to 4.0 m")
    assert not shown.buttons["previous"].isEnabled()
    shown.buttons["next"].click()
    figures = "gauge 1440.0 mm, standard error 4.9 mm across, 10.7 mm in height"
    assert shown.text.text() == f"Track 1, 8.0 to 10.0 m: {figures}. Cross-section at 9.0 m."
    assert not shown.buttons["next"].isEnabled()


def test_values_of_a_layer_are_not_read_as_html(load, dock):
    load("Findings", FINDING_FIELDS, [section(2.0, 4.0, finding=1, reason="<img src='//server/share/x.png'>")])
    shown = dock()
    assert shown.reason.text() == "<img src='//server/share/x.png'>"
    assert {label.textFormat() for label in (shown.reason, shown.text, shown.note, shown.problem)} == {
        Qt.TextFormat.PlainText
    }


def test_the_map_shows_the_place(load, dock):
    load("Findings", FINDING_FIELDS, ROWS)
    shown = dock()
    shown.go(1)
    extent = shown._canvas.extent()
    assert (extent.center().x(), extent.center().y()) == pytest.approx((500_009, 3_000_000))
    assert 20 <= max(extent.width(), extent.height()) < 60


def test_decisions_are_written_and_can_be_taken_back(load, dock):
    layer = load("Findings", FINDING_FIELDS, ROWS)
    shown = dock()
    shown.buttons[ACCEPTED].click()  # goes on
    shown.buttons[REJECTED].click()
    decided = {feature["finding"]: feature["review"] for feature in layer.getFeatures()}
    assert decided == {1: ACCEPTED, 2: REJECTED}
    assert shown.count.text() == "2 of 2; 2 reviewed"
    assert shown.buttons[REJECTED].isChecked()
    shown.buttons[REJECTED].click()
    assert {feature["finding"]: feature["review"] for feature in layer.getFeatures()} == {1: ACCEPTED, 2: ""}
    assert not layer.isEditable()


def test_a_running_edit_session_is_left_open(load, dock):
    layer = load("Findings", FINDING_FIELDS, ROWS)
    layer.startEditing()
    dock().buttons[ACCEPTED].click()
    assert layer.isEditable()
    assert reviews(layer)[0].decision == ACCEPTED
    layer.rollBack()
    assert reviews(layer)[0].value("review") is None


def test_undo_and_other_edits_are_followed(qgis, load, dock):
    layer = load("Findings", FINDING_FIELDS, ROWS)
    layer.startEditing()
    shown = dock()
    shown.buttons[ACCEPTED].click()
    assert shown.count.text() == "2 of 2; 1 reviewed"
    layer.undoStack().undo()
    qgis.processEvents()
    assert shown.count.text() == "2 of 2; 0 reviewed"
    layer.undoStack().redo()
    qgis.processEvents()
    assert shown.count.text() == "2 of 2; 1 reviewed"
    layer.deleteFeature(reviews(layer)[0].feature.id())
    qgis.processEvents()
    assert shown.count.text() == "1 of 1; 0 reviewed"
    layer.rollBack()
    qgis.processEvents()
    assert shown.count.text() == "1 of 2; 0 reviewed"


def test_a_layer_that_cannot_be_changed_is_named(load, dock):
    layer = load("Findings", FINDING_FIELDS, ROWS)
    shown = dock()
    layer.setReadOnly(True)
    shown.buttons[ACCEPTED].click()
    assert shown.problem.text() == 'The layer "Findings" can\'t be edited: save it as a GeoPackage.'
    assert shown.count.text() == "1 of 2; 0 reviewed"
    assert not shown.buttons[ACCEPTED].isChecked()


def test_a_review_goes_on_at_the_first_open_finding(load, dock):
    rows = [section(2.0, 4.0, finding=1, review=ACCEPTED), section(8.0, 9.0, finding=2, review=NULL)]
    load("Findings", FINDING_FIELDS, rows)
    assert dock().count.text() == "2 of 2; 1 reviewed"


def test_layers_that_come_and_go_are_followed(load, dock, project):
    shown = dock()
    assert shown.count.text() == "No layer of findings is loaded."
    load("Rails", RAIL_FIELDS, [])
    assert shown.layers.count() == 0
    layer = load("Findings", FINDING_FIELDS, ROWS)
    assert shown.count.text() == "1 of 2; 0 reviewed"
    project.removeMapLayer(layer.id())
    assert shown.count.text() == "No layer of findings is loaded."
    load("None", FINDING_FIELDS, [])
    assert shown.count.text() == "There are no findings."


@pytest.fixture
def cloud(write_cloud, track):
    """A track with its properties, as a run gives them to its layers."""
    path = write_cloud(track())
    return path, {RUN: "this run", **properties_of(CloudSource((path,)), (10,), 0.072, ZERO)}


def test_the_section_shows_points_and_rails_of_the_run(qgis, load, dock, cloud):
    _, properties = cloud
    half = 1.507 / 2
    rails = [
        (f"LINESTRING Z (500000 {3_000_000 + side} 100, 500012 {3_000_000 + side} 100)", {"rail_id": number})
        for number, side in enumerate((half, -half))
    ]
    load("Rails", RAIL_FIELDS, rails, properties)
    load("Findings", FINDING_FIELDS, ROWS, properties)
    shown = dock()
    wait(qgis, shown)
    picture = shown._sections.picture(shown._found[0])
    assert sorted(picture.rails[:, 0]) == pytest.approx([-half, half], abs=1e-6)
    assert np.abs(picture.rails[:, 1]).max() < 0.001
    assert len(picture.points) == pytest.approx(600, abs=100)  # 300 per metre of each rail, over a metre
    assert np.abs(np.abs(picture.points[:, 0]) - half).max() <= 0.037
    assert abs(picture.points[:, 1].mean()) < 0.001
    shown.resize(360, 480)
    shown.show()
    qgis.processEvents()
    image = shown.view.grab().toImage()
    seen = {image.pixelColor(x, y).name() for x in range(image.width()) for y in range(image.height())}
    assert {colour.name() for colour in (PAPER, POINT, RAIL)} <= seen


def rails_with_gaps(left_gaps, right_gaps):
    """Rows of the two rails of a track that lead east, (left, right); a rail without its gaps is missing."""
    half = 1.507 / 2
    return [
        (f"LINESTRING Z (500012 {3_000_000 + side} 100, 500000 {3_000_000 + side} 100)", {"rail_id": 1, "gaps": gaps})
        for side, gaps in ((half, left_gaps), (-half, right_gaps))
        if gaps is not None
    ]


def test_the_rail_without_points_is_named_and_outlined(qgis, load, dock, cloud):
    _, properties = cloud
    load("Rails", RAIL_FIELDS, rails_with_gaps("2.50-3.50,8.50-9.60", ""), properties)
    load("Findings", FINDING_FIELDS, ROWS, properties)
    shown = dock()
    # the line leads west, from 500012: its second gap is from 2.4 to 3.5 m of the track, its first from 8.5 to 9.5 m
    assert shown.text.text().endswith("Left rail without points from 2.4 to 3.5 m. Cross-section at 3.0 m.")
    picture = shown._sections.picture(shown._found[0])
    assert picture.missing.tolist() == [True, False]
    assert picture.rails[0, 0] == pytest.approx(-1.507 / 2)
    shown.buttons["next"].click()
    assert "Left rail without points from 8.5 to 9.5 m." in shown.text.text()


def test_a_rail_that_was_not_found_is_outlined_opposite_to_the_other(load, dock, cloud):
    _, properties = cloud
    load("Rails", RAIL_FIELDS, rails_with_gaps("", None), properties)
    load("Findings", FINDING_FIELDS, ROWS, properties)
    shown = dock()
    picture = shown._sections.picture(shown._found[0])
    np.testing.assert_allclose(picture.rails, [[-1.507 / 2, 0], [1.507 / 2, 0]], atol=1e-6)
    assert picture.missing.tolist() == [False, True]


def test_a_rail_of_no_track_is_neither_left_nor_right(load, dock, cloud):
    _, properties = cloud
    rail = f"LINESTRING Z (500000 {3_000_000 + 1.507 / 2} 100, 500012 {3_000_000 + 1.507 / 2} 100)"
    load("Rails", RAIL_FIELDS, [(rail, {"rail_id": 1})], properties)
    load("Findings", FINDING_FIELDS, [(rail, {**ROWS[0][1], "track_id": None, "rail_id": 1})], properties)
    shown = dock()
    picture = shown._sections.picture(shown._found[0])
    np.testing.assert_allclose(picture.rails, [[0, 0]], atol=1e-6)
    assert [panel.title for panel in shown.view._panels(picture)][1:] == ["rail"]


def test_without_the_cloud_gauge_and_cant_place_the_rails(load, dock, cloud):
    path, properties = cloud
    path.unlink()
    load("Findings", FINDING_FIELDS, [section(2.0, 4.0, finding=1, gauge_mm=1435.0, cant_mm=40.0)], properties)
    shown = dock()
    picture = shown._sections.picture(shown._found[0])
    np.testing.assert_allclose(picture.rails, [[-0.7535, 0.02], [0.7535, -0.02]], atol=1e-9)
    assert picture.points is None
    assert shown.note.text() == picture.note == "cloud is not at its place any more: only rails are shown."


def test_a_damaged_cloud_is_one_sentence(qgis, load, dock, cloud):
    path, properties = cloud
    path.write_bytes(b"LASF" + bytes(40))
    load("Findings", FINDING_FIELDS, ROWS, properties)
    shown = dock()
    wait(qgis, shown)
    assert "cloud.las" in shown._sections.note
    assert "Traceback" not in shown._sections.note


def test_intrusions_are_stepped_through_with_the_cross_section_of_the_cloud(qgis, load, project, dock, write_cloud):
    plate = np.array([[500_000 + x, 3_000_000 + 1.5, 100 + z] for x in (9.9, 10.0, 10.1) for z in (1.0, 2.0, 3.0)])
    path = write_cloud(plate, class_code=1)
    properties = {RUN: "this run", **properties_of(CloudSource((path,)), range(256), 0.07, ZERO)}
    stations = [{"track_id": 1, "chainage_m": float(x), "lmar_mm": -145.0} for x in range(21)]
    add_points(project, CLEARANCE_FIELDS, [(x, 0.0, 0.0, one) for x, one in enumerate(stations)], properties)
    row = {"intrusion": 1, "track_id": 1, "from_m": 9.9, "to_m": 10.1, "chainage_m": 10.0, "pen_mm": 145.0, "sure": 1}
    add_points(project, INTRUSION_FIELDS, [(10.0, 1.5, 2.0, {**row, "side": "left", "sigma_mm": 1.5})], properties)
    shown = dock()
    wait(qgis, shown)
    assert shown.reason.text() == "145.0 mm inside"
    assert shown.text.text() == ("Track 1, 9.9 to 10.1 m: standard error 1.5 mm, on the left. Cross-section at 10.0 m.")
    picture = shown._sections.picture(shown._found[0])
    assert len(picture.points) == len(plate)
    assert picture.mark == pytest.approx([-1.5, 2.0], abs=1e-3)
    shown.buttons["accepted"].click()
    assert next(shown._layer.getFeatures())["review"] == "accepted"


@pytest.mark.parametrize(("margin_m", "wide_mm"), [(0.0, 0.0), (0.1, 0.0), (0.0, 25.0), (0.1, 25.0)])
def test_the_profile_leans_with_the_track_and_is_as_deep_around_the_object_as_stated(
    qgis, load, project, dock, write_cloud, margin_m, wide_mm
):
    v, w, cant_m, spacing_m, pen_m = 1.560 + margin_m + wide_mm / 1000, 2.0, 0.150, 1.5, 0.060
    roll = np.arcsin(cant_m / spacing_m)
    left, up = v * np.cos(roll) - w * np.sin(roll), v * np.sin(roll) + w * np.cos(roll)
    path = write_cloud(np.array([[500_010.0, 3_000_000 + left, 100 + up]]), class_code=1)
    half = ((1.62, 0.4), (1.62, 4.0), (0.0, 4.0), (-1.62, 4.0), (-1.62, 0.4))
    properties = {
        RUN: "this run",
        **properties_of(CloudSource((path,)), range(256), 0.07, ZERO),
        **properties_of_profile(ShownProfile("EBO_G9", half, margin_m, {1: spacing_m})),
    }
    one = {"track_id": 1, "lmar_mm": -60.0, "cant_mm": 1000 * cant_m, "wide_l_mm": wide_mm, "wide_r_mm": 2 * wide_mm}
    stations = [(x, 0.0, 0.0, {**one, "chainage_m": float(x)}) for x in range(21)]
    add_points(project, CLEARANCE_FIELDS, stations, properties)
    row = {"intrusion": 1, "track_id": 1, "from_m": 9.9, "to_m": 10.1, "chainage_m": 10.0, "pen_mm": 1000 * pen_m}
    places = [(10.0, left, up, {**row, "v_mm": 1000 * v, "w_mm": 1000 * w, "sure": 1, "sigma_mm": 1.5})]
    add_points(project, INTRUSION_FIELDS, places, properties)
    shown = dock()
    wait(qgis, shown)
    picture = shown._sections.picture(shown._found[0])
    outline = QgsGeometry.fromPolygonXY([[QgsPointXY(*corner) for corner in picture.outline]])
    mark = QgsGeometry.fromPointXY(QgsPointXY(*picture.mark))
    assert outline.contains(mark)
    edge = QgsGeometry.fromPolylineXY([QgsPointXY(*corner) for corner in picture.outline])
    assert edge.distance(mark) == pytest.approx(pen_m, abs=1e-3)
    rise = np.array([np.cos(roll), -np.sin(roll)])
    np.testing.assert_allclose(picture.rails, [-rise * spacing_m / 2, rise * spacing_m / 2], atol=1e-6)
    widths = (picture.outline - picture.outline.mean(axis=0)) @ rise
    assert np.ptp(widths) == pytest.approx(2 * 1.62 + 2 * margin_m + 3 * wide_mm / 1000, abs=1e-3)
    words = [
        "profile EBO_G9",
        "margin 100 mm" if margin_m else "",
        "widening 25 and 50 mm" if wide_mm else "",
    ]
    assert picture.legend == ", ".join(filter(None, words))
    shown.view.resize(400, 400)
    image = shown.view.grab().toImage()
    colours = {image.pixelColor(x, y).name() for x in range(image.width()) for y in range(image.height())}
    assert PROFILE.name() in colours


def add_points(project, columns, rows, properties):
    """Add a layer of points along the track to the project."""
    layer = QgsVectorLayer("PointZ?crs=EPSG:32643", "points", "memory")
    layer.dataProvider().addAttributes(fields(columns).toList())
    layer.updateFields()
    for x, y, z, values in rows:
        feature = QgsFeature(layer.fields())
        feature.setGeometry(QgsGeometry.fromWkt(f"POINT Z ({500_000 + x} {3_000_000 + y} {100 + z})"))
        for key, value in values.items():
            feature[key] = value
        assert layer.dataProvider().addFeature(feature)
    for key, value in properties.items():
        layer.setCustomProperty(key, value)
    return project.addMapLayer(layer)
