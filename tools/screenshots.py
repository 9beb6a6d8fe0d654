"""Take the guide's pictures of the dialogs and of the sample's result: `docs/pictures`.

Runs in the environment that `make env` prints; `make screenshots` does both. Chromium, if installed, draws the report.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import laspy  # noqa: E402
import numpy as np  # noqa: E402
from dialog_pictures import HELP_SHARE, SIZES, dialog_pictures, start_qgis  # noqa: E402
from PIL import Image  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsMapLayer,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsMarkerSymbol,
    QgsPointCloudLayer,
    QgsPointXY,
    QgsProject,
    QgsRectangle,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
    QgsVectorLayerCache,
)
from qgis.gui import (  # noqa: E402
    QgsAttributeTableFilterModel,
    QgsAttributeTableModel,
    QgsAttributeTableView,
    QgsMapCanvas,
    QgsMessageBar,
)
from qgis.PyQt.QtCore import QSize  # noqa: E402
from qgis.PyQt.QtGui import QColor  # noqa: E402
from qgis.PyQt.QtWidgets import QMainWindow, QWidget  # noqa: E402
from rail_extract.core.frame import LocalFrame  # noqa: E402
from rail_extract.core.jobs.clouds import CloudSource  # noqa: E402
from rail_extract.core.standards import RAIL_CLASS, resolve  # noqa: E402
from rail_extract.laboratory.scenes.raw_catalogue import turnout  # noqa: E402
from rail_extract.laboratory.scenes.scene import Scene  # noqa: E402
from rail_extract.laboratory.scenes.write import write_cloud  # noqa: E402
from rail_extract.rail_extract_plugin.writing.run import RUN, properties_of  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "resources" / "sample" / "sample.laz"
STYLES = ROOT / "resources" / "styles"
FOLDER = ROOT / "docs" / "pictures"
STANDARD = "IN_75R_1000"

OUTPUTS = {
    "FINDINGS": "findings.gpkg",
    "CENTERLINES": "centerlines.gpkg",
    "RAILS": "rails.gpkg",
    "QUALITY": "quality.gpkg",
    "REPORT": "report.html",
}
"""The files of a run, from the top layer to the bottom; layers have the names of their styles."""

DIALOGS = {
    "extractrails_wide": "dialog",
    "extractrails_all": "dialog_all",
    "installpackages_wide": "install_packages",
    "stationalongaxis_wide": "station_along_axis",
    "comparetracks_wide": "compare_tracks",
}
"""Names of the dialogs' pictures, and their names in the guide."""

MAP_SIZE, TABLE_HEIGHT, REPORT_SIZE = QSize(1000, 480), 230, (1140, 3260)
"""Pixels."""

REVIEW_SIZE = (380, 640)
"""Pixels of the dock."""

REPORT_TOP, PLOTS_TOP = 1300, 2362
"""Height of the picture of the report's top, and of the report above the plots of the first track, in pixels."""

QUIETLY = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run", "--disable-sync"),
    *("--disable-quic", "--disable-background-networking", "--disable-component-update"),
)
"""Options with which Chromium draws a page without a screen and asks for nothing else."""

SPLITTER, BUTTONS = 27, 400
"""Width of a dialog to the right of its fields without the help, and height below them, in pixels."""

DETAIL_M = 16.0
"""Width of the detailed map on the ground, which shows individual stations, in metres."""


GROWN_SEED, GROWN_M, GROWN_TURN, DRAWN = 5, 80.0, -40.0, 150_000
"""Seed of the raw cloud on which rails are clicked, width of the map in metres, degrees by which it is turned, and
points that are drawn."""

GROWN_SIZE = QSize(1000, 300)

LEAD_SIZE, LEAD_M, LEAD_TURN = QSize(1000, 460), 17.0, 24.5
"""Pixels of the first picture of the README, width of its map in metres, and degrees by which it is turned."""

LEAD_MIDDLE = 0.45
"""Where its middle is along the sample, of the whole length: where points are missing, noisy and misclassified."""

CLOUD_COLOURS = {1: ("#b9975b", 0.8), 2: ("#bcc3cc", 0.5), 10: ("#3b4452", 0.5)}
"""Colour and size in millimetres of the sample's points by class: plants, ground, rail."""

SOMEWHERE = LocalFrame(np.array([500_000.0, 3_000_000.0, 100.0]))

COLORS = 128
"""Colours of a picture's palette: no colour changes by more than a few of 255 levels."""


def main() -> None:
    """Take all pictures in a running QGIS."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        dialog_pictures(folder / "dialogs")
        for source, target in DIALOGS.items():
            shutil.copy(folder / "dialogs" / f"{source}.png", FOLDER / f"{target}.png")
        _crop(FOLDER / "dialog_all.png", right=round(HELP_SHARE * SIZES["wide"][0]) + SPLITTER, bottom=BUTTONS)
        _extract(folder)
        layers = [_layer(folder / OUTPUTS[output]) for output in ("CENTERLINES", "RAILS", "QUALITY")]
        lines, rails, points = layers[:2], layers[1], layers[2]
        whole = rails.extent()
        whole.scale(1.05)
        _map(lines, whole, FOLDER / "map.png")
        _map(layers, _detail(points), FOLDER / "map_detail.png")
        _lead(folder, FOLDER / "lead.png")
        for layer in lines:
            _table(layer, FOLDER / f"table_{layer.name()}.png")
        _report(folder / OUTPUTS["REPORT"], FOLDER / "report.png")
        _review(folder / OUTPUTS["FINDINGS"], rails, FOLDER / "review.png")
        _growing(folder / "raw.laz", FOLDER / "growing.png")
        del layers, lines, rails, points
    for picture in sorted(FOLDER.glob("*.png")):
        _shrink(picture)
        print(f"{picture.name}: {picture.stat().st_size / 1000:.0f} kB")


def _extract(folder: Path) -> None:
    """Run Extract Rails on the sample."""
    import processing

    outputs = {output: str(folder / name) for output, name in OUTPUTS.items()}
    processing.run("railextract:extractrails", {"INPUT": str(SAMPLE), "STANDARD": STANDARD, **outputs})


def _layer(path: Path) -> QgsMapLayer:
    """Load a layer and style it as the plugin does."""
    layer = QgsVectorLayer(str(path), path.stem)
    layer.loadNamedStyle(str(STYLES / f"{path.stem}.qml"))
    return layer


def _detail(points: QgsVectorLayer) -> QgsRectangle:
    """Choose a small part of the map around the middle station."""
    places = [feature.geometry().asPoint() for feature in points.getFeatures()]
    middle = places[len(places) // 2]
    height = DETAIL_M * MAP_SIZE.height() / MAP_SIZE.width()
    return QgsRectangle.fromCenterAndSize(middle, DETAIL_M, height)


def _map(layers: Sequence[QgsMapLayer], extent: QgsRectangle, picture: Path) -> None:
    """Draw a map as the canvas of QGIS does."""
    settings = QgsMapSettings()
    settings.setLayers(layers)
    settings.setDestinationCrs(layers[0].crs())
    settings.setExtent(extent)
    settings.setOutputSize(MAP_SIZE)
    settings.setOutputDpi(110)
    settings.setBackgroundColor(QColor("white"))
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    job.renderedImage().save(str(picture))


def _table(layer: QgsVectorLayer, picture: Path) -> None:
    """Draw a layer's attribute table."""
    canvas, cache = QgsMapCanvas(), QgsVectorLayerCache(layer, layer.featureCount())
    model = QgsAttributeTableModel(cache)
    model.loadLayer()
    filtered = QgsAttributeTableFilterModel(canvas, model)
    view = QgsAttributeTableView()
    view.setModel(filtered)
    columns = layer.attributeTableConfig()
    columns.update(layer.fields())
    columns.setColumnHidden([one.name for one in columns.columns()].index("fid"), True)
    filtered.setAttributeTableConfig(columns)
    view.setAttributeTableConfig(columns)
    view.resize(view.horizontalHeader().length() + 30, TABLE_HEIGHT)
    view.show()
    QgsApplication.processEvents()
    view.grab().save(str(picture))
    view.setModel(None)


class _Window:
    """The part of QGIS's interface that the dock for reviews uses."""

    def __init__(self) -> None:
        self.mainWindow, self.mapCanvas = partial(_same, QMainWindow()), partial(_same, QgsMapCanvas())


def _same(widget: QWidget) -> QWidget:
    return widget


def _review(path: Path, rails: QgsVectorLayer, picture: Path) -> None:
    """Draw the dock for reviews at the first finding."""
    from rail_extract.rail_extract_plugin.review.dock import ReviewDock

    width_m, frame = resolve(STANDARD).head_width_m, LocalFrame(np.zeros(3))
    properties = {RUN: "this run", **properties_of(CloudSource((SAMPLE,)), (10,), width_m, frame)}
    project, findings = QgsProject.instance(), _layer(path)
    for layer in (rails, findings):
        for name, value in properties.items():
            layer.setCustomProperty(name, value)
        project.addMapLayer(layer.clone())
    window = _Window()
    dock = ReviewDock(window)
    while dock.is_reading:
        QgsApplication.processEvents()
    dock.resize(*REVIEW_SIZE)
    dock.show()
    QgsApplication.processEvents()
    dock.grab().save(str(picture))
    dock.close_for_good()
    project.clear()


def _growing(cloud: Path, picture: Path) -> None:
    """Draw the map after two clicks with the tool Grow Rails: before a switch, and on its branch."""
    from rail_extract.rail_extract_plugin.growing.tool import GrowRails

    scene = turnout(GROWN_SEED)
    write_cloud(Scene("raw", scene.xyz, np.ones(len(scene.xyz), np.uint8), (), (), scene.standard, SOMEWHERE), cloud)
    layer = QgsPointCloudLayer(str(cloud), "raw", "pdal")  # invalid in a QGIS without PDAL
    layer.setCrs(QgsCoordinateReferenceSystem("EPSG:32643"))
    QgsProject.instance().addMapLayer(layer)
    points = _points(scene.xyz[:, :2] + SOMEWHERE.origin[:2], layer.crs())
    canvas, bar, window = QgsMapCanvas(), QgsMessageBar(), QMainWindow()
    canvas.resize(GROWN_SIZE)
    canvas.setDestinationCrs(layer.crs())
    canvas.setLayers([points])
    ends = [rail[place] + SOMEWHERE.origin for rail, place in ((scene.rails[0], 20), (scene.rails[-1], -20))]
    middle = np.mean(scene.xyz[:, :2], axis=0) + SOMEWHERE.origin[:2]
    height = GROWN_M * GROWN_SIZE.height() / GROWN_SIZE.width()
    canvas.setExtent(QgsRectangle.fromCenterAndSize(QgsPointXY(*middle), GROWN_M, height))
    canvas.setRotation(GROWN_TURN)
    canvas.show()
    tool = GrowRails(canvas, bar, window)
    for place in ends:
        tool.click(QgsPointXY(*place[:2]))
        while tool.is_growing:
            QgsApplication.processEvents()
    canvas.refresh()
    canvas.waitWhileRendering()
    QgsApplication.processEvents()
    canvas.grab().save(str(picture))
    tool.close_for_good()
    QgsProject.instance().clear()


def _lead(folder: Path, picture: Path) -> None:
    """Draw the canvas with findings, centerlines and rails over the points of the sample."""
    lines = [_layer(folder / OUTPUTS[output]) for output in ("FINDINGS", "CENTERLINES", "RAILS")]
    cloud, crs = laspy.read(SAMPLE), lines[0].crs()
    xy, classes = np.column_stack([cloud.x, cloud.y]), np.asarray(cloud.classification)
    shown = [_points(xy[classes == code], crs, *CLOUD_COLOURS[code]) for code in sorted(CLOUD_COLOURS, reverse=True)]
    canvas = QgsMapCanvas()
    canvas.resize(LEAD_SIZE)
    canvas.setDestinationCrs(crs)
    canvas.setLayers([*lines, *shown])
    first, last = xy[classes == RAIL_CLASS].min(axis=0), xy[classes == RAIL_CLASS].max(axis=0)
    middle = first + LEAD_MIDDLE * (last - first)
    height = LEAD_M * LEAD_SIZE.height() / LEAD_SIZE.width()
    canvas.setExtent(QgsRectangle.fromCenterAndSize(QgsPointXY(*middle), LEAD_M, height))
    canvas.setRotation(LEAD_TURN)
    canvas.show()
    canvas.refresh()
    canvas.waitWhileRendering()
    QgsApplication.processEvents()
    canvas.grab().save(str(picture))


def _points(
    xy: np.ndarray, crs: QgsCoordinateReferenceSystem, colour: str = "#787878", size_mm: float = 0.25
) -> QgsVectorLayer:
    """Make a layer of points of a cloud, (n, 2), of which at most about `DRAWN` are drawn."""
    layer = QgsVectorLayer("MultiPoint", "points", "memory")
    layer.setCrs(crs)
    feature = QgsFeature()
    feature.setGeometry(QgsGeometry.fromMultiPointXY([QgsPointXY(*place) for place in xy[:: len(xy) // DRAWN or 1]]))
    layer.dataProvider().addFeature(feature)
    symbol = QgsMarkerSymbol.createSimple({"size": str(size_mm), "color": colour, "outline_style": "no"})
    layer.setRenderer(QgsSingleSymbolRenderer(symbol))
    return layer


def _report(page: Path, picture: Path) -> None:
    """Draw the top of the report."""
    chromium = shutil.which("chromium")
    if chromium is None:
        print(f"chromium is not installed: {picture.name} is not updated (apt-get install chromium).")
        return
    options = (f"--window-size={','.join(map(str, REPORT_SIZE))}", f"--user-data-dir={page.parent / 'chromium'}")
    command = [chromium, *QUIETLY, *options, f"--screenshot={picture}", page.as_uri()]
    subprocess.run(command, check=True, capture_output=True)
    shutil.copy(picture, FOLDER / "report_track.png")
    _crop(picture, bottom=REPORT_SIZE[1] - REPORT_TOP)
    _crop(FOLDER / "report_track.png", top=PLOTS_TOP)


def _crop(picture: Path, top: int = 0, right: int = 0, bottom: int = 0) -> None:
    """Cut pixels off the sides of a picture."""
    with Image.open(picture) as image:
        cropped = image.crop((0, top, image.width - right, image.height - bottom))
    cropped.save(picture)


def _shrink(picture: Path) -> None:
    """Store a picture with a palette that covers all colours, including those of thin lines."""
    with Image.open(picture) as image:
        smaller = image.convert("RGB").quantize(COLORS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    smaller.save(picture, optimize=True)


if __name__ == "__main__":
    started = start_qgis()  # kept until the end, because QGIS would crash at the exit of Python
    main()
