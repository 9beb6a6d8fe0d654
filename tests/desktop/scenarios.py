"""What a new user does in QGIS, and what is then found; `conftest.py` has each run in an application of its own."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path

from driver import Driver, algorithm, choose, close, install, later, open_batch, open_dialog, press_run, window
from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsGeometry,
    QgsLayerTree,
    QgsPointCloudLayer,
    QgsPointXY,
    QgsProcessingContext,
    QgsProcessingFeatureSourceDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingUtils,
    QgsProject,
    QgsRectangle,
    QgsSettings,
    QgsVectorLayer,
)
from qgis.PyQt import sip
from qgis.PyQt.QtCore import QObject, QPoint, QPointF, Qt, QUrl, pyqtSlot
from qgis.PyQt.QtGui import QDesktopServices, QTextCursor, QTextDocument, QWheelEvent
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import (
    QAbstractSpinBox,
    QAction,
    QApplication,
    QComboBox,
    QDialogButtonBox,
    QDockWidget,
    QFileDialog,
    QGroupBox,
    QLineEdit,
    QMenu,
    QPushButton,
    QTextBrowser,
    QTextEdit,
    QWidget,
)
from qgis.utils import iface, loadPlugin, plugins, reloadPlugin, startPlugin, unloadPlugin

RAW, LABELLED, GAUGE, SAMPLE, ARCHIVE = (
    os.environ[f"RAIL_EXTRACT_{name}"] for name in ("RAW", "LABELLED", "GAUGE", "SAMPLE", "ZIP")
)
PART = {
    "STANDARD": "IN_75R_1000",
    "EXTENT": "578215,578235,2494290,2494390 [EPSG:32643]",
    "ITERATIONS": 1,
}
"""Parameters for 20 m of the sample's three tracks, for runs of a second or two."""

ON_RAIL, BESIDE = QgsPointXY(500006.0, 3000000.754), QgsPointXY(500006.0, 3000000.0)
"""A place on a rail of the raw cloud, from which a click may be 0.1 m off, and one half a gauge away."""

FOLLOWING = {
    "frpdfcleanup": "Clean the raster",
    "vectorizerails": "Vectorize the rails",
    "buildtrackcenterlines": "Build the track centerlines",
    "measuretrackgeometry": "Measure the track geometry",
}
"""Algorithms by the links that lead to them, from one single step to the next."""


class Browser(QObject):
    """Stands in for the web browser, and keeps what it is told to show."""

    def __init__(self) -> None:
        super().__init__()
        self.urls: list[str] = []
        for scheme in ("file", "http", "https"):
            QDesktopServices.setUrlHandler(scheme, self, "show")

    @pyqtSlot(QUrl)
    def show(self, url: QUrl) -> None:
        """Keep an address."""
        self.urls.append(url.toString())


def dialogs(driver: Driver) -> Iterator:
    """Open every dialog, turn the wheel over its fields, press its buttons, choose clouds, and run one of them."""
    yield from install(ARCHIVE)
    browser, changed = Browser(), {}
    names = [one.name() for one in QgsApplication.processingRegistry().providerById("railextract").algorithms()]
    able = [name for name in names if algorithm(name).canExecute()[0]]
    driver.keep("without their packages", sorted(set(names) - set(able)))
    for name in able:
        dialog = yield from open_dialog(name)
        for group in dialog.findChildren(QGroupBox):
            group.setProperty("collapsed", False)
        yield 0.3
        driver.picture(f"dialog_{name}")
        dialog.buttonBox().setFocus()
        changed[name] = [label for one in _fields(dialog.mainWidget()) for label in _turn_over(one)]
        driver.keep("ids", {**driver.results.get("ids", {}), name: _ids_shown(dialog)})
        dialog.buttonBox().button(QDialogButtonBox.StandardButton.Help).click()
        yield from close(dialog)
        dialog = yield from open_batch(name)
        driver.picture(f"batch_{name}")
        yield from close(dialog)
        driver.keep("dialogs", [*driver.results.get("dialogs", []), name])
    driver.keep("help", browser.urls)
    yield from _select_clouds(driver)
    yield from _wheel_elsewhere(driver, changed)
    yield from _run_or_not(driver)


def _ids_shown(dialog: QWidget) -> list[str]:
    """Return the names of parameters and choices that a dialog shows instead of words, in its lists and its help."""
    definitions = dialog.algorithm().parameterDefinitions()
    lists = [one.options() for one in definitions if isinstance(one, QgsProcessingParameterEnum)]
    ids = {*(one.name() for one in definitions), *(option for options in lists for option in options)}
    combos = dialog.mainWidget().findChildren(QComboBox)
    shown = [combo.itemText(row) for combo in combos for row in range(combo.count())]
    texts = " ".join([*shown, dialog.findChild(QTextBrowser, "textShortHelp").toPlainText()])
    return sorted(set(re.findall("[A-Z][A-Z_]{3,}", texts)) & ids)


def _select_clouds(driver: Driver) -> Iterator:
    """Use the widget for the cloud: its list, its two buttons, and a typed path."""
    project = QgsProject.instance()
    project.addMapLayer(QgsVectorLayer("LineString?crs=EPSG:32643", "not a cloud", "memory"))
    dialog = yield from open_dialog("extractrails")
    widget = dialog.mainWidget().wrappers["INPUT"].widget
    driver.keep("list without clouds", [widget.combo.itemText(i) for i in range(widget.combo.count())])
    cloud = project.addMapLayer(QgsPointCloudLayer("", "my cloud", ""))
    driver.keep("list with a cloud", [widget.combo.itemText(i) for i in range(widget.combo.count())])
    widget.combo.setCurrentIndex(0)
    driver.keep("chosen layer", dialog.mainWidget().wrappers["INPUT"].parameterValue() == cloud.id())
    later(widget.file_button.click)
    chooser = yield lambda: window("QFileDialog")
    driver.keep("file filters", chooser.nameFilters())
    driver.picture("file_dialog")
    yield from _answer(chooser, SAMPLE)
    driver.keep("selected file", widget.value())
    later(widget.folder_button.click)
    chooser = yield lambda: window("QFileDialog")
    driver.keep("folders only", chooser.testOption(QFileDialog.Option.ShowDirsOnly))
    yield from _answer(chooser, str(Path(SAMPLE).parent))
    driver.keep("selected folder", widget.value())
    widget.combo.lineEdit().selectAll()
    widget.combo.lineEdit().insert("/data/typed.laz")
    driver.keep("typed path", widget.value())
    driver.picture("cloud_widget")
    yield from close(dialog)
    project.clear()


def _answer(chooser: QFileDialog, path: str) -> Iterator:
    """Type a path into a dialog that selects one, and accept it."""
    chooser.findChild(QLineEdit, "fileNameEdit").setText(path)
    later(chooser.findChild(QDialogButtonBox).button(QDialogButtonBox.StandardButton.Open).click)
    yield lambda: window("QFileDialog") is None
    yield 0.5


def _wheel_elsewhere(driver: Driver, changed: dict[str, list]) -> Iterator:
    """Turn the wheel over the lists of the toolbar and of the dock, and over one that has the focus."""
    windows = plugins["rail_extract"].windows
    windows.dock.layers.addItems(["one", "two"])
    changed["toolbar"], changed["dock"] = _turn_over(windows.growing.standards), _turn_over(windows.dock.layers)
    driver.keep("changed", changed)
    dialog = yield from open_dialog("extractrails")
    standard = dialog.mainWidget().wrappers["STANDARD"]
    driver.keep("what is around a list gets the wheel", not _wheel(standard.widget).isAccepted())
    QApplication.setActiveWindow(dialog)  # which no window manager does here
    standard.widget.setFocus()
    driver.keep("changed with the focus", len(_turn_over(standard.widget)))
    driver.picture("wheel")
    yield from close(dialog)


def _run_or_not(driver: Driver) -> Iterator:
    """Choose a standard in a dialog that is closed, and in one that runs; keep what the next dialog begins with."""
    for name, press in (("closed", False), ("run", True)):
        dialog = yield from open_dialog("rasterizerailpoints")
        wrapper = dialog.mainWidget().wrappers["STANDARD"]
        wrapper.widget.setFocus()
        for _ in range(3):
            QTest.keyClick(wrapper.widget, Qt.Key.Key_Up)
        dialog.setParameters({"INPUT": SAMPLE, "EXTENT": PART["EXTENT"]})
        driver.keep(f"chosen and {name}", wrapper.value())
        if press:
            yield from press_run(dialog)
        yield from close(dialog)
        dialog = yield from open_dialog("rasterizerailpoints")
        driver.keep(f"after it was {name}", dialog.mainWidget().wrappers["STANDARD"].value())
        yield from close(dialog)


def _fields(root: QWidget) -> list[QWidget]:
    """Return the lists and numbers of a dialog that are visible."""
    found = [*root.findChildren(QComboBox), *root.findChildren(QAbstractSpinBox)]
    return [one for one in found if one.isVisible() and one.isEnabled()]


def _turn_over(field: QWidget) -> list[str]:
    """Turn the wheel over a field, as far as a hand does at once; returns what it shows then if that is new."""
    shown = field.currentText if isinstance(field, QComboBox) else field.text
    before = shown()
    for _ in range(3):
        _wheel(field)
    return [shown()] if shown() != before else []


def _wheel(field: QWidget) -> QWheelEvent:
    """Turn the wheel by one notch over a field; a wheel that the field does not accept scrolls what is around it."""
    place = field.rect().center()
    turn = (QPoint(0, 0), QPoint(0, -120), Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier)
    phase = Qt.ScrollPhase.NoScrollPhase
    event = QWheelEvent(QPointF(place), QPointF(field.mapToGlobal(place)), *turn, phase, False)
    QApplication.sendEvent(field, event)
    return event


def welcome(driver: Driver) -> Iterator:
    """Look at the message after the installation; see that it leads to what is missing, and then to the sample."""
    yield from install(ARCHIVE)
    yield 0.5
    bar = iface.messageBar()
    driver.keep("at first", _message(bar))
    driver.picture("welcome")
    job, notices = type(algorithm("extractrails")).JOB, sys.modules["rail_extract.rail_extract_plugin.notices"].notices
    packages = sys.modules["rail_extract.rail_extract_plugin.setup.dependencies"]
    needs = job.needs
    object.__setattr__(job, "needs", (*needs, ("torch_of_nobody",)))
    packages.PACKAGES += (packages.Package("torch_of_nobody", "torch"),)
    notices.packages_installed.emit()
    yield 0.5
    driver.keep("with a missing package", _message(bar))
    driver.picture("welcome_missing")
    later(_button_of(bar).click)
    dialog = yield lambda: window("AlgorithmDialog")
    driver.keep("first button opens", dialog.algorithm().name())
    object.__setattr__(job, "needs", needs)
    packages.PACKAGES = packages.PACKAGES[:-1]
    driver.keep("log of the installation", (yield from press_run(dialog)))
    driver.picture("welcome_installed")
    yield from close(dialog)
    driver.keep("when all is installed", _message(bar))
    later(_button_of(bar).click)
    dialog = yield lambda: window("AlgorithmDialog")
    yield 0.5
    driver.picture("welcome_sample")
    driver.keep("second button opens", dialog.mainWidget().wrappers["INPUT"].widget.value())
    driver.keep("at last", _message(bar))
    yield from close(dialog)


def _message(bar) -> list[str]:
    """Return the text of the plugin's message and that of its button; empty without one."""
    button = _button_of(bar)
    return [bar.currentItem().text(), button.text()] if button else []


def _button_of(bar) -> QPushButton | None:
    item = bar.currentItem()
    return item.findChild(QPushButton) if item is not None and item.title() == "Rail Extract" else None


def unload(driver: Driver) -> Iterator:
    """Disable the plugin during a run and while a rail grows, enable it again, run, and update it during a run."""
    yield from install(ARCHIVE)
    values = {"INPUT": SAMPLE, "STANDARD": PART["STANDARD"], "FINDINGS": None, "REPORT": None}
    for name in ("disabled", "updated"):
        dialog = yield from open_dialog("extractrails")
        dialog.setParameters(values)
        button = dialog.buttonBox().button(QDialogButtonBox.StandardButton.Ok)
        later(button.click)
        log = dialog.findChild(QTextEdit, "txtLog")
        yield lambda log=log: "Reading 1 file" in log.toPlainText()
        said = f"said when {name}"
        log.textChanged.connect(lambda said=said, log=log: driver.keep(said, log.toPlainText()))
        yield 0.5
        driver.picture(f"{name}_before")
        later(partial(unloadPlugin if name == "disabled" else reloadPlugin, "rail_extract"))
        yield lambda dialog=dialog: sip.isdeleted(dialog) or not dialog.isVisible()
        yield 2.0
        driver.picture(f"{name}_after")
        if name == "disabled":
            driver.keep("without the plugin", QgsApplication.processingRegistry().providerById("railextract") is None)
            loadPlugin("rail_extract")
            startPlugin("rail_extract")
        yield lambda: QgsApplication.processingRegistry().providerById("railextract")
    dialog = yield from open_dialog("rasterizerailpoints")
    dialog.setParameters({"INPUT": SAMPLE, "STANDARD": PART["STANDARD"], "EXTENT": PART["EXTENT"]})
    driver.keep("log", (yield from press_run(dialog)))
    yield from close(dialog)


def raw(driver: Driver) -> Iterator:
    """Run on a raw cloud without its tick, take the step that is offered, and save all that was found."""
    yield from install(ARCHIVE)
    dialog = yield from open_dialog("extractrails")
    driver.keep("standard at first", dialog.mainWidget().wrappers["STANDARD"].widget.currentText())
    dialog.setParameters({"INPUT": RAW, "ITERATIONS": 1})
    log = dialog.findChild(QTextEdit, "txtLog")
    driver.keep("refusal", (yield from press_run(dialog)))
    driver.picture("raw_refused")
    (offer,) = (one for one in dialog.messageBar().findChildren(QPushButton) if "raw cloud" in one.text())
    driver.keep("offer", offer.text())
    driver.keep("why", dialog.messageBar().currentItem().text())
    offer.click()
    button = dialog.buttonBox().button(QDialogButtonBox.StandardButton.Ok)
    yield lambda: not button.isEnabled()
    yield button.isEnabled
    yield 1.0
    driver.keep("log", log.toPlainText())
    driver.picture("raw_found")
    layers = [one for one in QgsProject.instance().mapLayers().values() if isinstance(one, QgsVectorLayer)]
    driver.keep("systems", {layer.name(): layer.crs().toWkt() for layer in layers})
    driver.keep("bars", [item.text() for item in iface.messageBar().items()])
    yield from _save_all(driver, log)
    yield from close(dialog)


def _save_all(driver: Driver, log: QTextEdit) -> Iterator:
    """Follow the link that saves all layers, and open the project that is in the file."""
    path = driver.folder / "all of it.gpkg"
    yield from _save(log, path)
    driver.picture("saved")
    QgsProject.instance().clear()
    driver.keep("project is read", QgsProject.instance().read(f"geopackage:{path}?projectName=Rail Extract"))
    layers = [node.layer() for node in QgsProject.instance().layerTreeRoot().findLayers()]
    driver.keep("saved layers", [layer.name().partition(":")[0] for layer in layers])
    driver.keep("saved sources", sorted({Path(layer.source().partition("|")[0]).name for layer in layers}))
    rails = next(layer for layer in layers if layer.name().startswith("Rails"))
    driver.keep("saved alias", rails.attributeAlias(rails.fields().lookupField("sigma_mm")))
    yield 1.0
    driver.picture("saved_project")


def missing(driver: Driver) -> Iterator:
    """Open an algorithm whose packages are missing, and follow the link of its message."""
    yield from install(ARCHIVE)
    object.__setattr__(type(algorithm("trainrailclassifier")).JOB, "needs", (("torch_of_nobody",),))
    packages = sys.modules["rail_extract.rail_extract_plugin.setup.dependencies"]
    packages.PACKAGES = (packages.Package("torch_of_nobody", "torch"),)
    packages.OPTIONAL = sys.modules["rail_extract.rail_extract_plugin.runs.missing"].OPTIONAL = ("torch_of_nobody",)
    later(choose("trainrailclassifier").executeAlgorithm)
    message = yield lambda: window("MessageDialog")
    yield 0.5
    driver.picture("missing")
    text = message.findChild(QTextBrowser)
    driver.keep("message", text.toPlainText())
    address = re.search('<a href="(railextract:[0-9]+)"', text.toHtml())[1]
    later(partial(text.anchorClicked.emit, QUrl(address)))
    dialog = yield lambda: window("AlgorithmDialog")
    yield 0.5
    driver.keep("opened", dialog.algorithm().name())
    driver.keep("PyTorch", dialog.mainWidget().wrappers["TORCH"].value())
    driver.keep("message is closed", window("MessageDialog") is None)
    driver.picture("missing_install")
    yield from close(dialog)


def reopened(driver: Driver) -> Iterator:
    """Begin in the profile of `review`, which was left with the dock open."""
    yield 1.0
    dock = iface.mainWindow().findChild(QDockWidget, "RailExtractReview")
    driver.keep("dock is visible", dock.isVisible())
    driver.keep("message", _message(iface.messageBar()))
    driver.picture("reopened")
    menu = next(one for one in iface.pluginMenu().actions() if one.text() == "Rail Extract").menu()
    next(one for one in menu.actions() if one.text() == "Review Findings").trigger()
    iface.mainWindow().findChild(QDockWidget, "ProcessingToolbox").setUserVisible(True)
    yield 0.5
    driver.keep("dock opens", dock.isVisible())
    driver.keep("tabs beside the dock", [one.objectName() for one in iface.mainWindow().tabifiedDockWidgets(dock)])


def again(driver: Driver) -> Iterator:
    """Run with a wrong gauge, follow the link that runs again, then those to the report and to the findings."""
    yield from install(ARCHIVE)
    browser = Browser()
    dialog = yield from open_dialog("extractrails")
    outputs = {"FINDINGS": str(driver.folder / "found.gpkg"), "REPORT": str(driver.folder / "report.html")}
    dialog.setParameters({"INPUT": SAMPLE, **PART, **outputs, "STANDARD": "EN_60E1_1435"})
    log = dialog.findChild(QTextEdit, "txtLog")
    driver.keep("wrong", (yield from press_run(dialog)))
    driver.picture("wrong_gauge")
    _follow(log, "Run again as")
    button = dialog.buttonBox().button(QDialogButtonBox.StandardButton.Ok)
    yield lambda: not button.isEnabled()
    yield button.isEnabled
    yield 1.0
    driver.keep("standard", dialog.mainWidget().wrappers["STANDARD"].parameterValue())
    driver.keep("results", dialog.results())
    driver.keep("right", log.toPlainText().rpartition("starting")[2])
    driver.picture("right_gauge")
    browser.urls.clear()
    _follow(log, "Open the report")
    yield 0.5
    driver.keep("opened", browser.urls)
    dock = iface.mainWindow().findChild(QDockWidget, "RailExtractReview")
    dock.hide()
    _follow(log, "Review the findings")
    yield 0.5
    driver.keep("dock is visible", dock.isVisible())
    driver.keep("first finding", dock.reason.text())
    driver.picture("right_review")
    yield from close(dialog)


def onwards(driver: Driver) -> Iterator:
    """Run the sample, save the run, decide, open another dialog, and go on with the lines: fit, export, stations."""
    yield from install(ARCHIVE)
    _menu("Open the Sample…").trigger()
    dialog = yield lambda: window("AlgorithmDialog")
    dialog.setParameters({"QUALITY": "TEMPORARY_OUTPUT"})
    yield from press_run(dialog)
    driver.picture("onwards_sample")
    yield from _save(dialog.findChild(QTextEdit, "txtLog"), driver.folder / "run.gpkg")
    driver.picture("onwards_saved")
    driver.keep("saved", [dialog.messageBar().currentItem().text(), *sorted(_names(driver.folder.glob("run*")))])
    yield from close(dialog)
    dialog = yield from open_dialog("extractrails")
    driver.keep("standard of the next dialog", dialog.mainWidget().wrappers["STANDARD"].value())
    yield from close(dialog)
    layers = {one.name().partition(":")[0]: one for one in QgsProject.instance().mapLayers().values()}
    driver.keep("sources", sorted({Path(one.source().partition("|")[0]).name for one in layers.values()}))
    iface.mainWindow().findChild(QDockWidget, "RailExtractReview").buttons["rejected"].click()
    saved = QgsVectorLayer(f"{driver.folder / 'run.gpkg'}|layername=findings", "", "ogr")
    driver.keep("decided", [feature["review"] for feature in saved.getFeatures()][:2])
    tracks, quality = layers["Track centerlines"], layers["Track geometry"]
    dialog = yield from open_dialog("fitalignment")
    dialog.setParameters({"INPUT": tracks.id(), "QUALITY": quality.id()})
    driver.keep("fit", (yield from press_run(dialog)).splitlines()[-1])
    driver.picture("onwards_fit")
    _follow(dialog.findChild(QTextEdit, "txtLog"), "Export the elements")
    export = yield lambda: next((one for one in _dialogs() if one.algorithm().name() == "exportalignment"), None)
    elements = QgsProject.instance().mapLayer(export.mainWidget().wrappers["INPUT"].parameterValue())
    driver.keep("exported", elements.name())
    driver.picture("onwards_export")
    yield from close(export)
    yield from close(dialog)
    dialog = yield from open_dialog("stationalongaxis")
    tracks.selectByIds([next(tracks.getFeatures()).id()])
    axis = QgsProcessingFeatureSourceDefinition(tracks.id(), True)
    dialog.setParameters({"INPUT": layers["Findings"].id(), "AXIS": axis, "START_KM": 10.0})
    yield from press_run(dialog)
    yield from close(dialog)
    stationed = next(one for one in QgsProject.instance().mapLayers().values() if "with kilometres" in one.name())
    driver.keep("aliases", [stationed.attributeAlias(stationed.fields().lookupField(one)) for one in ("doubt_m", "km")])
    driver.keep("colours", [one.symbol().color().name() for one in stationed.renderer().categories()])
    driver.keep("groups", _groups())
    driver.picture("onwards_stations")


def tried(driver: Driver) -> Iterator:
    """Try a part of the sample without a map, another one that the map shows, and then run on all of it."""
    yield from install(ARCHIVE)
    dialog = yield from open_dialog("extractrails")
    rails = str(driver.folder / "rails.gpkg")
    dialog.setParameters(
        {"INPUT": SAMPLE, "RAILS": rails, "STANDARD": PART["STANDARD"], "ITERATIONS": 1, "REPORT": None}
    )
    button = next(one for one in dialog.buttonBox().buttons() if "visible" in one.text())
    for name in ("without a map", "in the map"):
        later(button.click)
        yield lambda: not button.isEnabled()
        yield button.isEnabled
        yield 1.0
        driver.picture(f"tried {name}")
        driver.keep(name, _groups())
        (layer,) = [one for one in QgsProject.instance().mapLayers().values() if one.name().startswith("Rails")]
        driver.keep(f"extent {name}", layer.extent().toRectF().getCoords())
        iface.mapCanvas().setExtent(QgsRectangle.fromCenterAndSize(layer.extent().center(), 20, 20))
        iface.mapCanvas().refresh()
        yield 1.0
    log = dialog.findChild(QTextEdit, "txtLog")
    driver.keep("offered", log.toPlainText().splitlines()[-1])
    driver.keep("file", Path(rails).exists())
    driver.keep("standard that is remembered", QgsSettings().value("rail_extract/standard"))
    dialog.setParameters({"EXTENT": PART["EXTENT"]})
    _follow(log, "Run on all")
    yield lambda: not button.isEnabled()
    yield button.isEnabled
    yield 1.0
    driver.keep("at last", _groups())
    yield from close(dialog)


def _menu(text: str) -> QAction:
    """Return an entry of the plugin's menu."""
    menu = next(one for one in iface.pluginMenu().actions() if one.text() == "Rail Extract").menu()
    return next(one for one in menu.actions() if one.text() == text)


def _dialogs() -> list[QWidget]:
    """Return the visible dialogs of algorithms."""
    return [one for one in QApplication.topLevelWidgets() if one.isVisible() and hasattr(one, "algorithm")]


def _names(paths: Iterable[Path]) -> list[str]:
    return [path.name for path in paths]


def _groups() -> dict[str, list[str]]:
    """Return the groups of the project, the topmost first, with their layers."""
    groups = [one for one in QgsProject.instance().layerTreeRoot().children() if QgsLayerTree.isGroup(one)]
    return {one.name(): [node.name() for node in one.findLayers()] for one in groups}


def _save(log: QTextEdit, path: Path) -> Iterator:
    """Follow the link that saves all layers."""
    _follow(log, "Save all layers")
    chooser = yield lambda: window("QFileDialog")
    chooser.findChild(QLineEdit, "fileNameEdit").setText(str(path))
    later(chooser.findChild(QDialogButtonBox).button(QDialogButtonBox.StandardButton.Save).click)
    yield path.exists
    yield 1.0


def _follow(log: QTextEdit, text: str) -> None:
    """Click the last link of a log that begins with a text, with the mouse."""
    log.moveCursor(QTextCursor.MoveOperation.End)
    found = log.document().find(text, log.textCursor(), QTextDocument.FindFlag.FindBackward)
    log.setTextCursor(found)
    found.setPosition(found.selectionStart() + 1)
    QTest.mouseClick(log.viewport(), Qt.MouseButton.LeftButton, pos=log.cursorRect(found).center())


def review(driver: Driver) -> Iterator:
    """Extract the sample's rails from the plugin's menu, and review the findings in the dock."""
    yield from install(ARCHIVE)
    browser = Browser()
    menu = next(one for one in iface.pluginMenu().actions() if one.text() == "Rail Extract").menu()
    driver.keep("menu", [action.text() for action in menu.actions()])
    later(next(one for one in menu.actions() if one.text() == "Open the Sample…").trigger)
    dialog = yield lambda: window("AlgorithmDialog")
    driver.keep("sample", dialog.mainWidget().wrappers["INPUT"].widget.value())
    driver.keep("standard", dialog.mainWidget().wrappers["STANDARD"].parameterValue())
    findings = str(driver.folder / "findings.gpkg")
    dialog.setParameters({**PART, "INPUT": SAMPLE, "FINDINGS": findings, "REPORT": "TEMPORARY_OUTPUT"})
    driver.picture("review_dialog")
    yield from press_run(dialog)
    yield from close(dialog)
    driver.keep("opened", browser.urls)
    dock = iface.mainWindow().findChild(QDockWidget, "RailExtractReview")
    driver.keep("dock is visible", dock.isVisible())
    yield lambda: not dock.is_reading
    driver.keep("count", dock.count.text())
    dock.go(0)
    dock.buttons["next"].click()
    yield 1.0
    driver.picture("review_next")
    dock.buttons["previous"].click()
    dock.buttons["accepted"].click()
    yield 1.0
    driver.picture("review_accepted")
    dock.buttons["rejected"].click()
    driver.keep("count after", dock.count.text())
    driver.keep("scale", iface.mapCanvas().extent().width())
    yield 1.0
    driver.picture("review_rejected")
    driver.keep("order", [node.name() for node in QgsProject.instance().layerTreeRoot().findLayers()])
    yield from _show_in_3d(driver, menu)


def clearance(driver: Driver) -> Iterator:
    """Measure clearance from the dialog, and step through the intrusions in the dock."""
    yield from install(ARCHIVE)
    browser, project = Browser(), QgsProject.instance()
    lines = f"{GAUGE}/lines.gpkg|layername="
    dialog = yield from open_dialog("measureclearance")
    given = {"INPUT": f"{lines}centerlines", "RAILS": f"{lines}rails", "POINTS": f"{GAUGE}/cloud.las"}
    outputs = dict.fromkeys(("OUTPUT", "PLATFORMS", "REPORT"), "TEMPORARY_OUTPUT")
    dialog.setParameters({**given, **outputs, "INTRUSIONS": str(driver.folder / "intrusions.gpkg"), "WIRES": None})
    driver.picture("clearance_dialog")
    driver.keep("log", (yield from press_run(dialog)))
    yield from close(dialog)
    driver.keep("opened", browser.urls)
    layers = list(project.mapLayers().values())
    driver.keep("layers", {layer.name(): layer.featureCount() for layer in layers})
    found = next(layer for layer in layers if layer.fields().lookupField("pen_mm") >= 0)
    driver.keep("depths", [one["pen_mm"] for one in found.getFeatures()])
    dock = iface.mainWindow().findChild(QDockWidget, "RailExtractReview")
    driver.keep("dock is visible", dock.isVisible())
    yield lambda: not dock.is_reading
    dock.go(0)
    seen: dict[str, list] = {"counts": [], "reasons": [], "marks": [], "points": [], "inside": [], "legends": []}
    for press in ("accepted", "next"):
        yield 1.0
        driver.picture(f"clearance_{press}")
        seen["counts"].append(dock.count.text())
        seen["reasons"].append(dock.reason.text())
        seen["marks"].append(dock.view.picture.mark.tolist())
        seen["points"].append(len(dock.view.picture.points))
        outline = QgsGeometry.fromPolylineXY([QgsPointXY(*corner) for corner in dock.view.picture.outline.tolist()])
        seen["inside"].append(outline.distance(QgsGeometry.fromPointXY(QgsPointXY(*seen["marks"][-1]))))
        seen["legends"].append(dock.view.picture.legend)
        dock.buttons[press].click()
    for name, values in seen.items():
        driver.keep(name, values)
    driver.keep("decisions", [one["review"] for one in found.getFeatures()])


def _show_in_3d(driver: Driver, menu: QMenu) -> Iterator:
    """Show the rails in 3D, if QGIS lets plugins open a view."""
    entry = next((one for one in menu.actions() if one.text() == "Show Lines in 3D"), None)
    if entry is None:
        return
    rails = next(one for one in QgsProject.instance().mapLayers().values() if one.name() == "Rails: sample")
    iface.setActiveLayer(rails)
    entry.trigger()
    (view,) = iface.mapCanvases3D()
    yield 5.0
    driver.picture("lines_in_3d")
    camera, extent = view.cameraController(), rails.extent()
    place = view.mapSettings().worldToMapCoordinates(camera.lookingAtPoint())
    driver.keep("looks at the rails", extent.contains(QgsPointXY(place.x(), place.y())))
    driver.keep("distance to extent", camera.distance() / max(extent.width(), extent.height()))
    driver.keep("height looked at", place.z())
    driver.keep("height of rails", next(rails.getFeatures()).geometry().vertexAt(0).z())


def growing(driver: Driver) -> Iterator:
    """Click beside a rail in a file, click a rail of a layer twice, undo one of them, and classify the other."""
    yield from install(ARCHIVE)
    system, canvas = QgsCoordinateReferenceSystem("EPSG:32643"), iface.mapCanvas()
    QgsProject.instance().setCrs(system)
    menu = next(one for one in iface.pluginMenu().actions() if one.text() == "Rail Extract").menu()
    next(one for one in menu.actions() if one.text() == "Grow Rails").trigger()
    tool = plugins["rail_extract"].windows.growing
    tool.standards.setCurrentIndex(tool.standards.findData("EN_60E1_1435"))
    yield from _click(BESIDE)
    chooser = yield lambda: window("QFileDialog")
    yield from _answer(chooser, RAW)
    yield lambda: tool.message and not tool.is_growing
    driver.keep("said beside", tool.message)
    driver.picture("grow_missed")
    layer = QgsPointCloudLayer(RAW, "raw", "pdal")  # invalid in a QGIS without PDAL
    layer.setCrs(system)
    iface.setActiveLayer(QgsProject.instance().addMapLayer(layer))
    for _ in range(2):
        yield from _click(ON_RAIL)
        yield lambda: not tool.is_growing
    driver.keep("said", tool.message)
    canvas.setExtent(QgsRectangle.fromCenterAndSize(ON_RAIL, 200, 200))
    canvas.refresh()
    yield 1.0
    driver.picture("grown")
    tool.undo_action.trigger()
    driver.keep("left after undo", len(tool.seeds))
    later(tool.accept_action.trigger)
    yield from close((yield lambda: window("AlgorithmDialog")))
    driver.keep("left after the dialog", len(tool.seeds))
    later(tool.accept_action.trigger)
    dialog = yield lambda: window("AlgorithmDialog")
    values = dialog.mainWidget().createProcessingParameters()
    driver.keep("standard", values["STANDARD"])
    driver.picture("grow_dialog")
    classified = str(driver.folder / "classified.las")
    dialog.setParameters({**values, "INPUT": RAW, "RAIL_CLASS": 20, "OUTPUT": classified})
    driver.keep("log", (yield from press_run(dialog)))
    driver.keep("results", dialog.results())
    driver.picture("grown_classified")
    _follow(dialog.findChild(QTextEdit, "txtLog"), "Extract the rails of classified.las")
    onwards = yield lambda: next((one for one in _dialogs() if one.algorithm().name() == "extractrails"), None)
    values = onwards.mainWidget().createProcessingParameters()
    driver.keep("extract", [values["INPUT"], values["RAIL_CLASSES"], values["STANDARD"]])
    yield from close(onwards)
    yield from close(dialog)


def _click(place: QgsPointXY) -> Iterator:
    """Click a place of the map, of which 20 m are shown."""
    canvas = iface.mapCanvas()
    canvas.setExtent(QgsRectangle.fromCenterAndSize(place, 20, 20))
    yield 1.0
    pixel = canvas.getCoordinateTransform().transform(place)
    pos = QPoint(round(pixel.x()), round(pixel.y()))
    later(partial(QTest.mouseClick, canvas.viewport(), Qt.MouseButton.LeftButton, pos=pos))
    yield 0.5


def steps(driver: Driver) -> Iterator:
    """Go from the sample to the track geometry by the links that single steps offer."""
    yield from install(ARCHIVE)
    own = sys.modules["rail_extract.rail_extract_plugin.paths"].SAMPLE / "sample.laz"  # that of the menu
    dialog = yield from open_dialog("rasterizerailpoints")
    dialog.setParameters({"INPUT": str(own), "STANDARD": PART["STANDARD"], "EXTENT": PART["EXTENT"]})
    proposed = {}
    for name, text in FOLLOWING.items():
        yield from press_run(dialog)
        _follow(dialog.findChild(QTextEdit, "txtLog"), text)
        yield from close(dialog)
        dialog = yield lambda name=name: next((one for one in _dialogs() if one.algorithm().name() == name), None)
        proposed[name] = _proposed(dialog)
        driver.keep("proposed", proposed)
        driver.picture(f"steps_{name}")
    driver.keep("log", (yield from press_run(dialog)))
    driver.keep("stations", dialog.results()["STATION_COUNT"])
    driver.picture("steps_measured")
    yield from close(dialog)
    rails = next(one for one in QgsProject.instance().mapLayers().values() if one.name().startswith("Rails"))
    dialog = yield from open_dialog("buildtrackcenterlines")
    dialog.setParameters({"INPUT": rails.id(), "STANDARD": PART["STANDARD"]})
    yield from press_run(dialog)
    yield from close(dialog)
    driver.keep("standard that is remembered", QgsSettings().value("rail_extract/standard"))


def _proposed(dialog: QWidget) -> dict[str, str]:
    """Return what a dialog proposes for its inputs, with layers by their names."""
    wrappers = dialog.mainWidget().wrappers
    values = {
        one: wrappers[one].parameterValue() for one in ("INPUT", "RAILS", "POINTS", "STANDARD") if one in wrappers
    }
    context = QgsProcessingContext()
    context.setProject(QgsProject.instance())
    layers = {one: QgsProcessingUtils.mapLayerFromString(str(value), context) for one, value in values.items()}
    return {one: layers[one].name() if layers[one] else value for one, value in values.items()}


def train(driver: Driver) -> Iterator:
    """Train for an epoch on a cloud with a class of rails, and follow the links to the page and to the use of it."""
    yield from install(ARCHIVE)
    driver.keep("able", algorithm("trainrailclassifier").canExecute()[0])
    if not driver.results["able"]:
        return
    browser = Browser()
    dialog = yield from open_dialog("trainrailclassifier")
    dialog.setParameters({"INPUT": LABELLED, "EPOCHS": 1, "DEVICE": "CPU"})
    driver.keep("log", (yield from press_run(dialog)))
    driver.picture("trained")
    _follow(dialog.findChild(QTextEdit, "txtLog"), "Open the page")
    yield 0.5
    driver.keep("opened", browser.urls)
    _follow(dialog.findChild(QTextEdit, "txtLog"), "Classify a cloud")
    onwards = yield lambda: next((one for one in _dialogs() if one.algorithm().name() == "classifyrailpoints"), None)
    fields = onwards.mainWidget().wrappers
    driver.keep("weights", fields["WEIGHTS"].parameterValue() == dialog.results()["WEIGHTS"])
    driver.keep("method", fields["METHOD"].parameterValue())
    driver.picture("trained_classify")
    yield from close(onwards)
    yield from close(dialog)


def batch(driver: Driver) -> Iterator:
    """Fill two rows of the batch dialog, with an output left blank, and a report."""
    yield from install(ARCHIVE)
    dialog = yield from open_batch("extractrails")
    panel = dialog.mainWidget()
    panel.checkLoadLayersOnCompletion.setChecked(True)
    panel.addRow()
    for row in range(2):
        values = {"INPUT": SAMPLE, **PART}
        for name, value in values.items():
            panel.wrappers[row][panel.parameter_to_column[name]].setParameterValue(value, panel.processing_context)
        for name, ending in {"RAILS": "gpkg", "REPORT": "html"}.items():
            cell = panel.tblParameters.cellWidget(row + 1, panel.parameter_to_column[name])
            cell.setValue(str(driver.folder / f"{name}{row}.{ending}"))
    driver.picture("batch_filled")
    driver.keep("log", (yield from press_run(dialog)))
    driver.picture("batch_ran")
    driver.keep("files", sorted(path.name for path in driver.folder.glob("R*")))
    driver.keep("layers", [layer.name() for layer in QgsProject.instance().mapLayers().values()])
    for row in range(2):
        column = panel.parameter_to_column["RAIL_CLASSES"]
        panel.wrappers[row][column].setParameterValue("99", panel.processing_context)
    driver.keep("failed log", (yield from press_run(dialog)))
    yield from close(dialog)
    yield 1.0
    driver.keep("tasks left", [task.description() for task in QgsApplication.taskManager().activeTasks()])


def model(driver: Driver) -> Iterator:
    """Open Extract Rails as a model, look at a step, and run the model on a folder."""
    from processing.gui.ProviderActions import ProviderContextMenuActions

    yield from install(ARCHIVE)
    choose("extractrails")
    action = next(one for one in ProviderContextMenuActions.actions if one.name == "Open as Model…")
    action.setData(algorithm("extractrails"), None)
    later(action.execute)
    designer = yield lambda: window("ModelerDialog")
    yield 1.0
    driver.picture("model")
    later(lambda: _edit(designer, "raster"))
    dialog = yield lambda: window("ModelerParametersDialog")
    wrapper = dialog.widget.widget.wrappers["INPUT"]
    driver.keep("choices of a step", [wrapper.widget.combo.itemText(i) for i in range(wrapper.widget.combo.count())])
    driver.keep("choice of a step", wrapper.widget.combo.currentText())
    driver.picture("model_step")
    dialog.buttonBox.button(QDialogButtonBox.StandardButton.Ok).click()
    yield lambda: window("ModelerParametersDialog") is None
    later(designer.actionRun().trigger)
    dialog = yield lambda: window("AlgorithmDialog")
    dialog.mainWidget().wrappers["INPUT"].widget.combo.lineEdit().insert(str(Path(SAMPLE).parent))
    standards = dialog.mainWidget().wrappers["STANDARD"]
    driver.keep("standard of the model", [standards.value(), standards.parameterDefinition().help()])
    dialog.setParameters(PART)
    driver.picture("model_dialog")
    driver.keep("log", (yield from press_run(dialog)))
    driver.picture("model_ran")
    driver.keep("results", {name: value for name, value in dialog.results().items() if ":" in name})
    yield from close(dialog)
    designer.setDirty(False)
    yield from close(designer)
    layers = QgsProject.instance().mapLayers().values()
    driver.keep("layers", sorted(layer.name() for layer in layers))


def _edit(designer, step: str) -> None:
    """Open the dialog of a model's step, as a double click does."""
    scene = designer.view().scene()
    items = (item for item in scene.items() if hasattr(item, "editComponent") and hasattr(item, "component"))
    next(item for item in items if getattr(item.component(), "childId", lambda: None)() == step).editComponent()
