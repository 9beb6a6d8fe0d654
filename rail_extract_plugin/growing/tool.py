"""The toolbar "Rail Extract": click rails on the map, see them grow, undo, and accept them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from html import escape
from typing import Any

from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsFeature,
    QgsGeometry,
    QgsMapLayer,
    QgsPointCloudLayer,
    QgsPointXY,
    QgsProcessingContext,
    QgsProject,
    QgsSettings,
    QgsVectorLayer,
    QgsWkbTypes,
)
from qgis.gui import QgsMapCanvas, QgsMapMouseEvent, QgsMapTool, QgsMessageBar, QgsRubberBand
from qgis.PyQt import sip
from qgis.PyQt.QtCore import QObject, Qt
from qgis.PyQt.QtGui import QColor, QIcon
from qgis.PyQt.QtWidgets import QAction, QComboBox, QWidget

from ...core.errors import RailExtractError
from ...core.jobs.clouds import CloudSource, checked_crs
from ...core.jobs.grow_rail_points import JOB
from ...core.standards import DEFAULT, STANDARDS
from ..dialog.cloud_widget import CloudWidget, loaded_clouds
from ..dialog.standard_setting import LAST
from ..dialog.wheel import ignore_wheel
from ..notices import notices
from ..paths import ICONS
from ..reading.clouds import cloud_source
from ..setup.dependencies import explain_missing, missing_packages
from ..systems import system
from .task import CLASSIFIED, GrowTask, Shown, has_rail_points

COLOUR, WIDTH, END_SIZE = "#e64a19", 3, 11
"""Colour and width of the rails, and size of the marks at their ends, in pixels."""

MESSAGE_S = 10
"""Time for which a message is shown."""


CLOUD_WIDTH = 320
"""Pixels for the cloud in the toolbar, with its two buttons."""


@dataclass
class Seed:
    """A click in the layer's coordinate system, and what is drawn for it."""

    place: QgsPointXY
    crs: QgsCoordinateReferenceSystem
    bands: list[QgsRubberBand]


class ClickTool(QgsMapTool):
    """Reports clicks on the map, in its coordinate system, and the keys for undo and accept."""

    def __init__(
        self,
        canvas: QgsMapCanvas,
        clicked: Callable[[QgsPointXY], None],
        undo: Callable[[], None],
        accept: Callable[[], None],
    ) -> None:
        super().__init__(canvas)
        self._clicked = clicked
        self._keys = {
            Qt.Key.Key_Backspace: undo,
            Qt.Key.Key_Delete: undo,
            Qt.Key.Key_Return: accept,
            Qt.Key.Key_Enter: accept,
        }
        self.setCursor(Qt.CursorShape.CrossCursor)

    def canvasReleaseEvent(self, event: QgsMapMouseEvent) -> None:
        """Pass a click of the left button on."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._clicked(event.mapPoint())

    def keyPressEvent(self, event) -> None:
        """Undo with Backspace, accept with Enter."""
        action = self._keys.get(event.key())
        if action is not None:
            event.ignore()  # or the canvas takes the key as well
            action()


class GrowRails(QObject):
    """Grows rails from clicks on a point cloud layer."""

    def __init__(
        self,
        canvas: QgsMapCanvas,
        messages: QgsMessageBar,
        parent: QWidget,
    ) -> None:
        super().__init__(parent)
        self._canvas, self._messages = canvas, messages
        self._cloud: str | None = None
        self._task: GrowTask | None = None
        self.seeds: list[Seed] = []
        self._seed_layer_id = ""
        self.dialog: QWidget | None = None
        self.message = ""
        self.tool = ClickTool(canvas, self.click, self.undo, self.accept)
        self.grow_action = self._action("growrailpoints.svg", "Grow Rails", self._begin)
        self.grow_action.setCheckable(True)
        self.grow_action.setToolTip("Click rails on a point cloud and see how far they can be followed")
        self.tool.setAction(self.grow_action)
        self.undo_action = self._action("undo.svg", "Undo Last Rail", self.undo)
        self.accept_action = self._action("accept.svg", "Classify Grown Rails…", self.accept)
        self.clouds = CloudWidget(loaded_clouds)
        self.clouds.setToolTip("Point cloud in which rails grow: a layer, or the path of a file or folder")
        self.clouds.setMaximumWidth(CLOUD_WIDTH)
        self.clouds.changed.connect(self._warn_of_classes)
        self.standards = QComboBox()
        self.standards.setToolTip("Rail standard of the rails that are clicked")
        for name, standard in STANDARDS.items():
            self.standards.addItem(standard.label, name)
        self._choose_standard(DEFAULT)
        self._choose_standard(QgsSettings().value(LAST))
        notices.standard_used.connect(self._choose_standard)
        ignore_wheel(self.standards)
        self._follow_project(True)
        self._select(canvas.currentLayer())
        self._enable()

    def _follow_project(self, begin: bool) -> None:
        """Begin or stop to follow which clouds the project has, and which one is selected."""
        project, to_list = QgsProject.instance(), self.clouds.list_choices
        followed = ((project.layersAdded, to_list), (project.layersRemoved, to_list))
        for signal, do in (
            *followed,
            (project.layersRemoved, self._forget_removed),
            (self._canvas.currentLayerChanged, self._select),
        ):
            if begin:
                signal.connect(do)
            else:
                signal.disconnect(do)

    def _select(self, layer: QgsMapLayer | None) -> None:
        """Take a cloud that is selected in the layer panel; without one, the only cloud of the project."""
        clouds = dict(loaded_clouds())
        if isinstance(layer, QgsPointCloudLayer):
            self.clouds.set_value(layer.id())
        elif self.clouds.value() is None and len(clouds) == 1:
            self.clouds.set_value(*clouds.values())

    def _begin(self) -> None:
        """Take clicks on the map from now on."""
        self._canvas.setMapTool(self.tool)
        self._warn_of_classes()

    def _warn_of_classes(self) -> None:
        """Say at once if rails need not be grown, because the cloud has rail points already."""
        value = self.clouds.value()
        if value is None or self._canvas.mapTool() is not self.tool:
            return
        with suppress(RailExtractError):  # said when rails are clicked
            if has_rail_points(_source(value)):
                self._say(CLASSIFIED)

    def _choose_standard(self, name: str | None) -> None:
        """Choose the standard of a run, unless the toolbar does not have it, such as one that was to be detected."""
        number = self.standards.findData(name)
        if number >= 0:
            self.standards.setCurrentIndex(number)

    def _action(self, icon: str, text: str, do: Callable[[], None]) -> QAction:
        """Make an action."""
        made = QAction(QIcon(str(ICONS / icon)), text, self.parent())
        made.triggered.connect(lambda: do())
        return made

    @property
    def actions(self) -> Sequence[QAction]:
        """Actions of the toolbar, in order."""
        return self.grow_action, self.undo_action, self.accept_action

    @property
    def is_growing(self) -> bool:
        """Whether a rail is being followed."""
        return self._task is not None

    def click(self, place: QgsPointXY) -> None:
        """Follow the rail at a place in the coordinate system of the map."""
        if self.is_growing:
            self._say("The rail of the last click is still growing: wait, or undo it.")
            return
        try:
            value = self._chosen_cloud()
            if value is None:
                return
            cloud, layer = _source(value), QgsProject.instance().mapLayer(value)
            crs = layer.crs() if layer is not None else system(checked_crs(cloud))
        except RailExtractError as error:
            self._say(str(error))
            return
        self._cloud, map_crs = value, self._canvas.mapSettings().destinationCrs()
        to_cloud = QgsCoordinateTransform(map_crs, crs, QgsProject.instance())
        seed = Seed(to_cloud.transform(place), crs, [])
        self.seeds.append(seed)
        self._draw(seed, [QgsGeometry.fromPointXY(seed.place)], QgsWkbTypes.GeometryType.PointGeometry)
        standard = STANDARDS[self.standards.currentData()]
        self._task = GrowTask(cloud, standard, seed.place, lambda shown: self._show(seed, shown))
        self._task.taskTerminated.connect(self._stopped)
        QgsApplication.taskManager().addTask(self._task)
        self._enable()

    def _chosen_cloud(self) -> str | None:
        """Return the layer or the path to grow in; None if the user was asked for a file and chose none.

        Raises RailExtractError if there are several clouds, seeds of another cloud wait, or packages are missing.
        """
        missing = missing_packages(JOB.needs)
        if missing:
            raise RailExtractError(explain_missing("Grow Rails", missing, []))
        if self.clouds.value() is None:
            self._select(self._canvas.currentLayer())
        if self.clouds.value() is None and loaded_clouds():
            raise RailExtractError("Choose the point cloud in the toolbar, or select its layer, then click on a rail.")
        if self.clouds.value() is None:
            self.clouds.file_button.click()
        chosen = self.clouds.value()
        if self.seeds and chosen != self._cloud:
            raise RailExtractError(
                "Rails of another point cloud are still shown: classify or undo them before you click on this one."
            )
        return chosen

    def _show(self, seed: Seed, shown: Shown) -> None:
        """Draw what grew, or take the click back if nothing did."""
        self._task = None
        if sip.isdeleted(self) or seed not in self.seeds:
            return
        if shown.rails:
            lines = [QgsGeometry.fromPolylineXY([QgsPointXY(*place) for place in rail]) for rail in shown.rails]
            self._draw(seed, lines, QgsWkbTypes.GeometryType.LineGeometry)
            ends = [QgsGeometry.fromPointXY(QgsPointXY(*end)) for end in shown.ends]
            self._draw(seed, ends, QgsWkbTypes.GeometryType.PointGeometry, QgsRubberBand.IconType.ICON_X)
        else:
            self._remove(seed)
        self._say(shown.text)
        self._enable()

    def _draw(
        self,
        seed: Seed,
        shapes: Sequence[QgsGeometry],
        kind: QgsWkbTypes.GeometryType,
        icon: QgsRubberBand.IconType = QgsRubberBand.IconType.ICON_CIRCLE,
    ) -> None:
        """Draw shapes over the map."""
        band = QgsRubberBand(self._canvas, kind)
        band.setColor(QColor(COLOUR))
        band.setWidth(WIDTH)
        band.setIcon(icon)
        band.setIconSize(END_SIZE)
        for shape in shapes:
            band.addGeometry(shape, seed.crs)
        seed.bands.append(band)

    def undo(self) -> None:
        """Take the last click back, also while its rail grows."""
        self.cancel()
        if self.seeds:
            self._remove(self.seeds[-1])
        self._enable()

    def accept(self) -> None:
        """Open the dialog of the algorithm with the seeds as a layer; the map is cleared once it has run."""
        from ..runs.run_dialog import open_dialog

        if self.is_growing or not self.seeds or self._cloud is None:
            return
        values = {
            "INPUT": self._cloud,
            "SEEDS": self._seed_layer().id(),
            "STANDARD": self.standards.currentData(),
        }
        self.dialog = open_dialog(JOB.name, values, self.parent())
        self.dialog.algorithmFinished.connect(self._clear_after)

    def _clear_after(self, successful: bool, results: dict[str, Any]) -> None:
        """Take all clicks back once their rails are classified; after a failure, they are tried again."""
        if successful:
            self.clear()
            self._seed_layer_id = ""

    def _seed_layer(self) -> QgsVectorLayer:
        """Return a layer of the project with the seeds: the one of a dialog that has not run yet, or a new one."""
        layer = QgsProject.instance().mapLayer(self._seed_layer_id)
        if layer is None:
            layer = QgsProject.instance().addMapLayer(QgsVectorLayer("Point", "Rail seeds", "memory"))
            self._seed_layer_id = layer.id()
        layer.setCrs(self.seeds[0].crs)
        features = [QgsFeature() for _ in self.seeds]
        for feature, seed in zip(features, self.seeds):
            feature.setGeometry(QgsGeometry.fromPointXY(seed.place))
        layer.dataProvider().truncate()
        layer.dataProvider().addFeatures(features)
        layer.updateExtents()
        layer.triggerRepaint()
        return layer

    def clear(self) -> None:
        """Take all clicks back."""
        self.cancel()
        for seed in list(self.seeds):
            self._remove(seed)
        self._cloud = None
        self._enable()

    def cancel(self) -> None:
        """Stop growing."""
        if self._task is not None:
            task, self._task = self._task, None
            with suppress(RuntimeError):  # QGIS deletes finished tasks
                task.cancel()

    def close_for_good(self) -> None:
        """Stop and clean the map, before the tool is deleted."""
        self._follow_project(False)
        notices.standard_used.disconnect(self._choose_standard)
        self.clear()
        if self._canvas.mapTool() is self.tool:
            self._canvas.unsetMapTool(self.tool)

    def _stopped(self) -> None:
        """Take the click of a task back that was cancelled in the status bar."""
        if self._task is not None:
            self.undo()

    def _remove(self, seed: Seed) -> None:
        """Take a click back."""
        for band in seed.bands:
            self._canvas.scene().removeItem(band)
        self.seeds.remove(seed)

    def _forget_removed(self, ids: Sequence[str]) -> None:
        """Take all clicks back if their layer was removed."""
        if self._cloud in ids:
            self.clear()

    def _say(self, text: str) -> None:
        """Show a message above the map."""
        self.message = text
        self._messages.pushMessage("Grow Rails", escape(text), Qgis.MessageLevel.Info, MESSAGE_S)

    def _enable(self) -> None:
        """Enable what can be done."""
        self.undo_action.setEnabled(bool(self.seeds))
        self.accept_action.setEnabled(bool(self.seeds) and not self.is_growing)


def _source(value: str) -> CloudSource:
    """Return the cloud of a layer, given by its id, or of a path."""
    return cloud_source(QgsProject.instance().mapLayer(value) or value, QgsProcessingContext())
