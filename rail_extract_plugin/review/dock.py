"""The dock "Rail Extract review": one finding after the other, in the map, in figures and in a cross-section."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from qgis.core import (
    QgsApplication,
    QgsCoordinateTransform,
    QgsProject,
    QgsRectangle,
    QgsVectorLayer,
)
from qgis.PyQt import sip
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtGui import QKeySequence
from qgis.PyQt.QtWidgets import (
    QComboBox,
    QDockWidget,
    QGridLayout,
    QLabel,
    QPushButton,
    QShortcut,
    QVBoxLayout,
    QWidget,
)

from ..dialog.wheel import ignore_wheel
from .findings import ACCEPTED, OPEN, REJECTED, Review, decide, findings_layers, reviews
from .section_view import SectionView
from .sections import ReadingTask, Sections

SURROUNDINGS = 1.6
"""Side of the map relative to the finding, so that what leads to it is seen, too."""

SMALLEST_MAP_M = 20.0
"""Side of the map for short findings, in units of the layer."""

KEYS = {"previous": "P", "next": "N", ACCEPTED: "A", REJECTED: "R"}
"""Keys of the buttons. They work while the dock has the focus; elsewhere, QGIS has other uses for these letters."""


class ReviewDock(QDockWidget):
    """Shows the findings of a layer and writes the user's decisions into it."""

    def __init__(self, iface) -> None:
        super().__init__("Rail Extract review", iface.mainWindow())
        self.setObjectName("RailExtractReview")
        self._canvas = iface.mapCanvas()
        self._layer: QgsVectorLayer | None = None
        self._found: list[Review] = []
        self._at = 0
        self._sections: Sections | None = None
        self._task: ReadingTask | None = None
        self._edited = QTimer(self)  # one reading for all changes of an edit
        self._edited.setSingleShot(True)
        self._edited.timeout.connect(self._read_again)
        self._build()
        project = QgsProject.instance()
        project.layersAdded.connect(self.refresh)
        project.layersRemoved.connect(self.refresh)
        self.refresh()

    def _build(self) -> None:
        """Create the widgets."""
        self.layers, self.view = QComboBox(), SectionView()
        ignore_wheel(self.layers)
        self.count, self.reason, self.text, self.note, self.problem = (QLabel() for _ in range(5))
        for label in (self.reason, self.text, self.note, self.problem):
            label.setWordWrap(True)
            # Otherwise Qt takes values of a layer for HTML, and opens the pictures that they name.
            label.setTextFormat(Qt.TextFormat.PlainText)
        self.reason.setStyleSheet("font-weight: 600")
        self.problem.setStyleSheet("color: #d62839")
        shown = {
            "previous": ("Previous", "Show the finding before."),
            "next": ("Next", "Show the next finding."),
            ACCEPTED: ("Accept", "The lines are right here. Press again to take the decision back."),
            REJECTED: ("Reject", "The lines are wrong here. Press again to take the decision back."),
        }
        self.buttons = {name: QPushButton(label) for name, (label, _) in shown.items()}
        for name, (_, tip) in shown.items():
            self.buttons[name].setToolTip(tip)
        for name in (ACCEPTED, REJECTED):
            self.buttons[name].setCheckable(True)
        for name, key in KEYS.items():
            button, context = self.buttons[name], Qt.ShortcutContext.WidgetWithChildrenShortcut
            button.setToolTip(f"{button.toolTip()} Key: {key}")
            QShortcut(QKeySequence(key), self, button.click, context=context)
        content, column, grid = QWidget(), QVBoxLayout(), QGridLayout()
        content.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        for widget in (self.layers, self.count, self.reason, self.text, self.view, self.note, self.problem):
            column.addWidget(widget, 1 if widget is self.view else 0)
        for number, button in enumerate(self.buttons.values()):
            grid.addWidget(button, number // 2, number % 2)
        column.addLayout(grid)
        content.setLayout(column)
        self.setWidget(content)
        self.layers.activated.connect(lambda _: self.show_layer(self.layers.currentData()))
        self.buttons["previous"].clicked.connect(lambda: self.go(self._at - 1))
        self.buttons["next"].clicked.connect(lambda: self.go(self._at + 1))
        self.buttons[ACCEPTED].clicked.connect(lambda: self.decide(ACCEPTED))
        self.buttons[REJECTED].clicked.connect(lambda: self.decide(REJECTED))

    def refresh(self, *changed) -> None:
        """List the layers of findings in the project, and keep the one that is shown if it still exists."""
        layers = findings_layers()
        self.layers.clear()
        for layer in layers:
            self.layers.addItem(layer.name(), layer.id())
        gone = self._layer is not None and (sip.isdeleted(self._layer) or self._layer not in layers)
        if self._layer is None or gone:
            self.show_layer(layers[0].id() if layers else None)
        elif self._sections is not None and self._sections.lacks_stations:
            self.show_layer(self._layer.id())  # QGIS adds the layers of a run one by one
        else:
            self.layers.setCurrentIndex(self.layers.findData(self._layer.id()))

    def show_layer(self, layer_id: str | None) -> None:
        """Begin with a layer of findings, at the first finding without a decision."""
        self.cancel()
        self._follow(False)
        layer = QgsProject.instance().mapLayer(layer_id) if layer_id else None
        self._layer = layer if isinstance(layer, QgsVectorLayer) else None
        self._follow(True)
        self._found = reviews(self._layer) if self._layer else []
        self._sections = Sections(self._layer, self._found) if self._layer else None
        self.layers.setCurrentIndex(self.layers.findData(layer_id))
        if self._sections is not None and self._found and self._sections.cloud and not self._sections.note:
            shown = self._sections
            self._task = ReadingTask(self._sections.cloud, shown.places, shown.reach_m, self._keep_points)
            QgsApplication.taskManager().addTask(self._task)
        undecided = (number for number, one in enumerate(self._found) if one.decision == OPEN)
        self._at = next(undecided, 0)
        _say(self.problem, "")
        self._show()

    def _follow(self, begin: bool) -> None:
        """Begin or stop to follow what happens to the layer elsewhere, such as Undo."""
        layer = self._layer
        if layer is None or sip.isdeleted(layer):
            return
        edits = (layer.attributeValueChanged, layer.geometryChanged, layer.featureAdded, layer.featureDeleted)
        for signal in (*edits, layer.afterRollBack, layer.afterCommitChanges, layer.dataSourceChanged):
            if begin:
                signal.connect(self._note_edit)
            else:
                signal.disconnect(self._note_edit)

    def _note_edit(self, *_) -> None:
        self._edited.start(0)

    def _read_again(self) -> None:
        """Show what the layer has after an edit; where lines have come or gone, the review begins again."""
        if self._layer is None or sip.isdeleted(self._layer):
            return
        found = reviews(self._layer)
        if _places(found) != _places(self._found):
            self.show_layer(self._layer.id())
            return
        shown = self._found[self._at].feature.id() if self._found else None
        self._found = found
        self._at = next((number for number, one in enumerate(found) if one.feature.id() == shown), 0)
        self._show()

    def go(self, number: int) -> None:
        """Show another finding, in the map as well."""
        self._at = min(max(number, 0), len(self._found) - 1)
        _say(self.problem, "")
        self._show()
        self.zoom()

    def zoom(self) -> None:
        """Show the place of the finding in the map."""
        if self._layer is None or not self._found:
            return
        geometry = self._found[self._at].feature.geometry()
        box = geometry.boundingBox()
        side = max(SURROUNDINGS * max(box.width(), box.height()), SMALLEST_MAP_M)
        box = QgsRectangle.fromCenterAndSize(box.center(), side, side)
        to_map = self._canvas.mapSettings().destinationCrs()
        transform = QgsCoordinateTransform(self._layer.crs(), to_map, QgsProject.instance())
        self._canvas.setExtent(transform.transformBoundingBox(box))
        self._canvas.refresh()
        self._canvas.flashGeometries([geometry], self._layer.crs())

    def decide(self, decision: str) -> None:
        """Write a decision and go on to the next finding; the same decision a second time takes it back."""
        if self._layer is None or not self._found:
            return
        shown = self._found[self._at]
        decision = OPEN if shown.decision == decision else decision
        problem = decide(self._layer, shown, decision)
        if not problem:
            feature = self._layer.getFeature(shown.feature.id())
            self._found[self._at] = Review(feature)
        last = self._at == len(self._found) - 1
        if problem or last or decision == OPEN:
            self._show()
        else:
            self.go(self._at + 1)
        _say(self.problem, problem)

    def close_for_good(self) -> None:
        """Stop reading points and following the project, before the dock is deleted."""
        self.cancel()
        self._follow(False)
        QgsProject.instance().layersAdded.disconnect(self.refresh)
        QgsProject.instance().layersRemoved.disconnect(self.refresh)

    @property
    def is_reading(self) -> bool:
        """Whether points are being read."""
        return self._task is not None

    def cancel(self) -> None:
        """Stop reading points."""
        if self._task is not None:
            with suppress(RuntimeError):  # QGIS deletes finished tasks
                self._task.cancel()
            self._task = None

    def _keep_points(self, points: dict, problem: str) -> None:
        self._task = None
        if self._sections is None or sip.isdeleted(self):
            return
        self._sections.points = points
        self._sections.note = problem or self._sections.note
        self._show()

    def _show(self) -> None:
        """Show the current finding."""
        any_found = bool(self._found)
        for name, button in self.buttons.items():
            button.setEnabled(any_found)
            if button.isCheckable():
                button.setChecked(any_found and self._found[self._at].decision == name)
        self.buttons["previous"].setEnabled(self._at > 0)
        self.buttons["next"].setEnabled(self._at < len(self._found) - 1)
        if not any_found or self._sections is None:
            self.count.setText("There are no findings." if self._layer else "No layer of findings is loaded.")
            for label in (self.reason, self.text, self.note):
                _say(label, "")
            self.view.show_picture(None)
            return
        shown = self._found[self._at]
        decided = sum(one.decision != OPEN for one in self._found)
        self.count.setText(f"{self._at + 1} of {len(self._found)}; {decided} reviewed")
        _say(self.reason, f"{shown.reason[:1].upper()}{shown.reason[1:]}")
        _say(self.text, " ".join((f"{shown.where}: {shown.figures}.", *self._missing(shown), *_section(shown))))
        picture = self._sections.picture(shown)
        self.view.show_picture(picture)
        nothing = picture.points is None or not len(picture.points)
        empty = "There is no point here." if nothing else ""
        _say(self.note, "Reading the points…" if self.is_reading else picture.note or empty)

    def _missing(self, shown: Review) -> list[str]:
        """Say which rail has no points, and from where to where."""
        gaps = self._sections.gaps(shown) if self._sections is not None else []
        return [f"{gap.side} rail without points from {gap.start_m:,.1f} to {gap.end_m:,.1f} m." for gap in gaps]


def _places(found: Sequence[Review]) -> dict[int, bytes]:
    """Return the lines of findings by their ids."""
    return {one.feature.id(): one.feature.geometry().asWkb().data() for one in found}


def _section(shown: Review) -> list[str]:
    """Say where the cross-section is."""
    at_m = shown.at_m
    return [] if at_m is None else [f"Cross-section at {at_m:,.1f} m."]


def _say(label: QLabel, text: str) -> None:
    """Show a text; without one, the label takes no space."""
    label.setText(text)
    label.setVisible(bool(text))
