"""The map tool: clicks on a real map canvas, what is drawn, undo, and the dialog with the seeds."""

import time

import numpy as np
import pytest
from qgis.core import QgsCoordinateReferenceSystem, QgsPointCloudLayer, QgsPointXY, QgsProject, QgsRectangle
from qgis.gui import QgsMapCanvas, QgsMessageBar
from qgis.PyQt import sip
from qgis.PyQt.QtCore import QPoint, Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QFileDialog, QMainWindow
from rail_extract.laboratory.scenes.raw_strips import SPACING_M, strip
from rail_extract.rail_extract_plugin.notices import notices
from rail_extract.rail_extract_plugin.paths import SAMPLE

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
TRACK = strip(12.0)
UTM = QgsCoordinateReferenceSystem("EPSG:32643")


def place(along, left):
    return QgsPointXY(*(CORNER[:2] + TRACK.at(along, left)))


@pytest.fixture
def canvas(qgis):
    canvas = QgsMapCanvas()
    canvas.resize(800, 400)
    canvas.setDestinationCrs(UTM)
    canvas.setExtent(QgsRectangle(499_999, 2_999_997, 500_013, 3_000_003))
    canvas.show()
    qgis.processEvents()
    yield canvas
    sip.delete(canvas)  # or Python deletes it after QGIS has ended, which crashes


@pytest.fixture
def layer(qgis, plugin, write_cloud):
    """A layer of the project; it may be invalid here, because this QGIS may lack PDAL."""
    layer = QgsPointCloudLayer(str(write_cloud(TRACK.xyz + CORNER, "raw.laz", 2)), "raw", "pdal")
    layer.setCrs(UTM)
    yield QgsProject.instance().addMapLayer(layer)
    QgsProject.instance().clear()


@pytest.fixture
def growing(qgis, canvas):
    from rail_extract.rail_extract_plugin.growing.tool import GrowRails  # needs QGIS's processing framework

    window, messages = QMainWindow(), QgsMessageBar()
    made = GrowRails(canvas, messages, window)
    made.bar = messages
    yield made
    made.close_for_good()
    if made.dialog is not None:
        made.dialog.close()
    sip.delete(messages)
    sip.delete(window)


def click(canvas, point):
    """Press and release the left button on the map."""
    pixel = canvas.getCoordinateTransform().transform(point)
    QTest.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(round(pixel.x()), round(pixel.y())))


def wait(qgis, growing):
    end = time.monotonic() + 60
    while growing.is_growing and time.monotonic() < end:
        qgis.processEvents()
        time.sleep(0.02)
    assert not growing.is_growing


def lines(seed):
    """Lengths of the lines that are drawn for a click."""
    return [band.asGeometry().length() for band in seed.bands if band.asGeometry().length() > 1]


def test_a_click_shows_both_rails_of_the_track_and_their_ends(qgis, canvas, layer, growing):
    growing.grow_action.trigger()
    assert canvas.mapTool() is growing.tool
    assert growing.grow_action.isChecked()
    click(canvas, place(6.0, SPACING_M / 2))
    assert growing.is_growing
    assert not growing.accept_action.isEnabled()
    wait(qgis, growing)
    (seed,) = growing.seeds
    assert lines(seed) == [pytest.approx(23, abs=1.5)]
    assert seed.bands[-1].asGeometry().constGet().numGeometries() == 2
    assert growing.message.startswith("Followed 1")
    assert growing.message.endswith(": at both ends, the cloud ends.")
    assert growing.accept_action.isEnabled()


def test_a_click_beside_the_rails_is_taken_back_with_a_reason(qgis, canvas, layer, growing):
    growing.click(place(6.0, 0.0))
    wait(qgis, growing)
    assert growing.seeds == []
    assert growing.message.startswith("No railhead within 25 cm of the click: zoom in and click on one, or")
    assert not growing.undo_action.isEnabled()


def test_backspace_takes_the_last_click_back(qgis, canvas, layer, growing):
    growing.grow_action.trigger()
    for along in (4.0, 8.0):
        growing.click(place(along, SPACING_M / 2))
        wait(qgis, growing)
    first, second = growing.seeds
    QTest.keyClick(canvas, Qt.Key.Key_Backspace)
    assert growing.seeds == [first]
    assert not any(band.scene() for band in second.bands)
    assert all(band.scene() for band in first.bands)


def test_undo_stops_a_rail_that_grows(qgis, canvas, layer, growing):
    growing.click(place(6.0, SPACING_M / 2))
    growing.undo()
    assert growing.seeds == []
    for _ in range(50):
        qgis.processEvents()
        time.sleep(0.02)
    assert growing.seeds == []
    growing.click(place(6.0, SPACING_M / 2))
    wait(qgis, growing)
    assert len(growing.seeds) == 1


def test_the_dialog_opens_with_the_seeds_and_runs(qgis, canvas, layer, growing, run_step, tmp_path):
    growing.standards.setCurrentIndex(growing.standards.findData("EN_49E1_1435"))
    growing.click(place(6.0, -SPACING_M / 2))
    wait(qgis, growing)
    growing.accept()
    values = growing.dialog.mainWidget().createProcessingParameters()
    assert values["INPUT"] in (layer.id(), layer.source())
    assert values["STANDARD"] == "EN_49E1_1435"
    growing.dialog.algorithmFinished.emit(False, {})
    assert len(growing.seeds) == 1  # to try again
    growing.dialog.algorithmFinished.emit(True, {})
    assert growing.seeds == []
    done = run_step("growrailpoints", {**values, "INPUT": layer.source(), "OUTPUT": tmp_path / "new.laz"})
    assert done.ok, done.error
    assert done.results["PAIRED_LENGTH"] == pytest.approx(23, abs=1.5)


def test_seeds_have_one_layer_until_a_run_has_used_it(qgis, canvas, layer, growing):
    def seed_layers():
        return [one for one in QgsProject.instance().mapLayers().values() if one.name() == "Rail seeds"]

    for along, layers in ((4.0, 1), (8.0, 1), (6.0, 2)):
        growing.click(place(along, SPACING_M / 2))
        wait(qgis, growing)
        growing.accept()
        assert len(seed_layers()) == layers
        growing.dialog.close()
        if len(growing.seeds) == 2:
            assert seed_layers()[0].featureCount() == 2
            growing.dialog.algorithmFinished.emit(True, {})
    assert sorted(one.featureCount() for one in seed_layers()) == [1, 2]


def test_the_toolbar_takes_the_standard_of_the_last_run(qgis, canvas, growing):
    for used, chosen in (("EN_49E1_1435", "EN_49E1_1435"), ("DETECT", "EN_49E1_1435")):
        notices.standard_used.emit(used)
        assert growing.standards.currentData() == chosen


def test_a_click_beside_the_cloud_says_so(qgis, canvas, layer, growing):
    growing.click(place(9000.0, 0.0))
    wait(qgis, growing)
    assert growing.message == "The cloud has no point here: click on a rail of the cloud."


def test_of_several_clouds_one_is_to_be_selected(qgis, canvas, layer, growing):
    QgsProject.instance().addMapLayer(QgsPointCloudLayer("", "other", ""))
    growing.clouds.set_value(None)
    growing.click(place(6.0, 0.0))
    assert growing.message.startswith("Choose the point cloud in the toolbar")
    canvas.setCurrentLayer(layer)
    assert growing.clouds.value() == layer.id()


def test_without_a_layer_a_file_is_taken(qgis, canvas, plugin, growing, write_cloud, monkeypatch):
    path, asked = str(write_cloud(TRACK.xyz + CORNER, "raw.laz", 2)), []
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *given: (asked.append(given) or path, ""))
    for along in (4.0, 8.0):
        growing.click(place(along, SPACING_M / 2))
        wait(qgis, growing)
    assert len(asked) == 1
    assert [len(lines(seed)) for seed in growing.seeds] == [1, 1]
    growing.accept()
    assert growing.dialog.mainWidget().createProcessingParameters()["INPUT"] == path


def test_a_file_is_shown_and_can_be_changed(qgis, canvas, plugin, growing, write_cloud, tmp_path):
    here, elsewhere = write_cloud(TRACK.xyz + CORNER, "here.laz", 2), write_cloud(TRACK.xyz, "elsewhere.laz", 2)
    growing.clouds.set_value(str(elsewhere))
    growing.click(place(6.0, SPACING_M / 2))
    wait(qgis, growing)
    assert growing.message.startswith("The cloud has no point here")
    assert growing.clouds.combo.currentText() == str(elsewhere)
    growing.clouds.set_value(str(here))
    growing.click(place(6.0, SPACING_M / 2))
    wait(qgis, growing)
    assert len(growing.seeds) == 1


def test_a_cloud_with_rail_points_is_named_before_the_click(qgis, canvas, plugin, growing, write_cloud):
    growing.clouds.set_value(str(write_cloud(TRACK.xyz + CORNER, "raw.laz", 2)))
    growing.grow_action.trigger()
    assert growing.message == ""
    growing.clouds.set_value(str(SAMPLE / "sample.laz"))
    assert growing.message.startswith("This cloud has points of class 10")
    growing.message = ""
    growing.grow_action.trigger()
    assert "Extract Rails uses them as they are" in growing.message


def test_messages_are_not_read_as_html(growing):
    growing._say("<img src='//server/share/x.las'> does not exist")
    assert "&lt;img" in growing.bar.currentItem().text()


def test_a_second_cloud_has_to_wait(qgis, canvas, layer, growing):
    growing.click(place(6.0, SPACING_M / 2))
    wait(qgis, growing)
    other = QgsProject.instance().addMapLayer(QgsPointCloudLayer("", "other", ""))
    canvas.setCurrentLayer(other)
    growing.click(place(6.0, SPACING_M / 2))
    assert growing.message.startswith("Rails of another point cloud are still shown")
    assert len(growing.seeds) == 1


def test_removing_the_layer_takes_its_clicks_away(qgis, canvas, layer, growing):
    growing.click(place(6.0, SPACING_M / 2))
    wait(qgis, growing)
    QgsProject.instance().removeMapLayer(layer.id())
    assert growing.seeds == []
    assert not growing.accept_action.isEnabled()
