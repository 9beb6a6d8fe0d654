"""The message after the installation that says what to do next, and has the button for it."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import Qgis, QgsSettings
from qgis.gui import QgsMessageBar, QgsMessageBarItem
from qgis.PyQt import sip
from qgis.PyQt.QtCore import QObject
from qgis.PyQt.QtWidgets import QPushButton

from ..core.jobs.extract_rails import JOB
from .notices import notices
from .runs.missing import open_installation
from .setup.dependencies import Package, missing_packages

SHOWN = "rail_extract/welcomed_to"
"""Setting: the step that was shown last."""

INSTALL, SAMPLE = "packages", "sample"
"""Values of the setting."""


class Welcome(QObject):
    """Leads to the missing packages, and once there are none, to the sample; each is shown once."""

    def __init__(self, bar: QgsMessageBar, open_sample: Callable[[], None]) -> None:
        super().__init__()
        self._bar, self._open_sample = bar, open_sample
        self._item: QgsMessageBarItem | None = None
        notices.packages_installed.connect(self.show)
        notices.sample_wanted.connect(self._close)
        self.show()

    def show(self) -> None:
        """Show the next step, unless it was the last one that was shown."""
        missing = missing_packages(JOB.needs)
        step = INSTALL if missing else SAMPLE
        if QgsSettings().value(SHOWN) == step:
            return
        QgsSettings().setValue(SHOWN, step)
        self._close()
        if missing:
            self._push(_what_is_missing(missing), "Install packages…", open_installation)
        else:
            text = "Ready: the sample shows what the plugin does."
            self._push(text, "Open the sample…", self._open_sample)

    def remove(self) -> None:
        """Take the message away."""
        notices.packages_installed.disconnect(self.show)
        notices.sample_wanted.disconnect(self._close)
        self._close()

    def _push(self, text: str, label: str, do: Callable[[], None]) -> None:
        """Show a message with a button."""
        self._item, button = self._bar.createMessage("Rail Extract", text), QPushButton(label)

        def follow() -> None:
            self._close()
            do()

        button.clicked.connect(lambda: follow())
        self._item.layout().addWidget(button)
        self._bar.pushWidget(self._item, Qgis.MessageLevel.Info, 0)

    def _close(self) -> None:
        """Remove the message if the user has not closed it."""
        if self._item is not None and not sip.isdeleted(self._item):
            self._bar.popWidget(self._item)
        self._item = None


def _what_is_missing(missing: tuple[Package, ...]) -> str:
    names = ", ".join(package.module for package in missing)
    return f"To work, the plugin needs Python packages that this QGIS does not have: {names}."
