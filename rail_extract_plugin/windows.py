"""What the plugin adds to QGIS's windows: menu entries, settings, reports after runs, the dock and the toolbar.

QGIS imports this module when it starts with windows; nothing else may.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from qgis.core import QgsApplication, QgsProject
from qgis.PyQt.QtCore import QObject, Qt, QUrl
from qgis.PyQt.QtGui import QDesktopServices, QIcon
from qgis.PyQt.QtWidgets import QAction, QDockWidget, QToolBar

from . import compat
from .dialog.guide import guide
from .links import links
from .model_action import OpenModelAction
from .notices import notices
from .paths import ICON
from .review.report import ReportOpener
from .runs.leftovers import Leftovers
from .runs.missing import open_installation
from .runs.run_dialog import open_dialog
from .sample_action import OpenSampleAction
from .setup import package_setting
from .setup.dependencies import is_installed
from .view_3d_action import NAME, show_in_3d
from .welcome import Welcome

if TYPE_CHECKING:
    from .growing.tool import GrowRails
    from .review.dock import ReviewDock

MENU = "Rail Extract"
"""Submenu of QGIS's menu of plugins."""

TOOLBOX = "ProcessingToolbox"
"""Name of the dock with the toolbox; the review is a tab beside it."""


class Windows(QObject):
    """Adds everything when it is made, and takes it away with `remove`.

    In tests without QGIS's main window there is no interface, and no menu and no dock.
    """

    def __init__(self, iface) -> None:
        super().__init__()
        self._iface = iface
        self._actions = (OpenSampleAction(), OpenModelAction())
        for action in self._actions:
            action.register()
        package_setting.register()
        notices.sample_wanted.connect(self._open_sample)
        self._reports = ReportOpener()
        self._reports.register()
        self._leftovers = Leftovers()
        links.register()
        self.dock: ReviewDock | None = None
        self.growing: GrowRails | None = None
        self._toolbar: QToolBar | None = None
        self._welcome: Welcome | None = None
        self._entries: list[QAction] = []
        if iface is not None:
            self._add_to(iface)

    def _add_to(self, iface) -> None:
        """Add the menu and, if the package that it needs is installed, the dock."""
        self._entries = [
            self._entry("Extract Rails…", lambda: self._open("extractrails")),
            self._entry("Classify Rail Points…", lambda: self._open("classifyrailpoints")),
        ]
        if is_installed("numpy"):
            dock = self._add_dock(iface)
            self._entries += [self._add_toolbar(iface), dock]
        if compat.OPENS_3D_VIEWS:
            self._entries.append(self._entry(NAME, lambda: show_in_3d(iface)))
        self._entries += [
            self._entry(self._actions[0].name, notices.sample_wanted.emit),
            self._entry("Install Packages…", open_installation),
            self._entry("Help", lambda: QDesktopServices.openUrl(QUrl(guide("tutorial")))),
        ]
        for entry in self._entries:
            iface.addPluginToMenu(MENU, entry)
        self._welcome = Welcome(iface.messageBar(), self._open_sample)

    def _entry(self, text: str, do: Callable[[], None]) -> QAction:
        """Make an entry of the menu."""
        made = QAction(QIcon(str(ICON)), text, self._iface.mainWindow())
        made.triggered.connect(lambda: do())
        return made

    def _open_sample(self) -> None:
        self._actions[0].execute()

    def _open(self, name: str) -> None:
        """Open the dialog of an algorithm, or say which packages it lacks."""
        algorithm = QgsApplication.processingRegistry().algorithmById(f"railextract:{name}")
        executable, reason = algorithm.canExecute()
        if executable:
            self._dialog = open_dialog(name, {}, self._iface.mainWindow())
        else:
            self._iface.messageBar().pushWarning(MENU, reason)

    def _add_dock(self, iface) -> QAction:
        """Add the dock, and return the menu entry that shows it."""
        from .review.dock import ReviewDock

        self.dock = ReviewDock(iface)
        iface.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, self.dock)
        window = iface.mainWindow()
        toolbox = window.findChild(QDockWidget, TOOLBOX)
        if toolbox is not None:
            window.tabifyDockWidget(toolbox, self.dock)
        self.dock.hide()
        # QGIS shows at its start what was open at its end.
        iface.initializationCompleted.connect(self._hide_if_empty)
        notices.findings_loaded.connect(self._show_findings)
        review = self.dock.toggleViewAction()
        review.setText("Review Findings")
        return review

    def _add_toolbar(self, iface) -> QAction:
        """Add the toolbar for growing rails, and return the menu entry that begins it."""
        from .growing.tool import GrowRails

        self.growing = GrowRails(iface.mapCanvas(), iface.messageBar(), iface.mainWindow())
        self._toolbar = iface.addToolBar(MENU)
        self._toolbar.setObjectName("RailExtractGrowing")
        self._toolbar.addActions(self.growing.actions)
        self._toolbar.addWidget(self.growing.clouds)
        self._toolbar.addWidget(self.growing.standards)
        return self.growing.grow_action

    def _show_findings(self, layer_id: str) -> None:
        """Open the dock for the findings of a run, if there are any."""
        layer = QgsProject.instance().mapLayer(layer_id)
        if self.dock is not None and layer is not None and layer.featureCount():
            self.dock.show_layer(layer_id)
            self.dock.show()
            self.dock.raise_()
            self.dock.widget().setFocus()

    def _hide_if_empty(self) -> None:
        """Close the dock if it has nothing to show."""
        if self.dock is not None and not self.dock.layers.count():
            self.dock.hide()

    def remove(self) -> None:
        """Take everything away."""
        if self.dock is not None:
            self._iface.initializationCompleted.disconnect(self._hide_if_empty)
            notices.findings_loaded.disconnect(self._show_findings)
            self.dock.close_for_good()
            self._iface.removeDockWidget(self.dock)
            self.dock.deleteLater()
            self.dock = None
        if self.growing is not None and self._toolbar is not None:
            self.growing.close_for_good()
            self._iface.mainWindow().removeToolBar(self._toolbar)
            self._toolbar.deleteLater()
            self._toolbar = None
        if self._welcome is not None:
            self._welcome.remove()
            self._welcome = None
        for entry in self._entries:
            self._iface.removePluginMenu(MENU, entry)
        self._entries = []
        if self.growing is not None:
            self.growing.deleteLater()
            self.growing = None
        notices.sample_wanted.disconnect(self._open_sample)
        self._reports.deregister()
        self._leftovers.stop()
        links.deregister()
        package_setting.deregister()
        for action in self._actions:
            action.deregister()
