"""Links in logs and messages of QGIS's windows that do something."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from itertools import count

from qgis.PyQt.QtCore import QEvent, QObject, Qt, QTimer, QUrl, pyqtSlot
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QTextEdit

SCHEME = "railextract"
"""Of the addresses of these links."""


class _Links(QObject):
    """Calls what a link stands for when QGIS opens its address."""

    def __init__(self) -> None:
        super().__init__()
        self._calls: dict[str, Callable[[], None]] = {}
        self._numbers = count(1)

    def register(self) -> None:
        """Receive the addresses that QGIS opens."""
        QDesktopServices.setUrlHandler(SCHEME, self, "open")

    def deregister(self) -> None:
        """Stop, and forget all links."""
        QDesktopServices.unsetUrlHandler(SCHEME)
        self._calls.clear()

    def to(self, text: str, call: Callable[[], None]) -> str:
        """Return a link in HTML that calls a function."""
        address = f"{SCHEME}:{next(self._numbers)}"
        self._calls[address] = call
        return f'<a href="{address}">{escape(text)}</a>'

    @pyqtSlot(QUrl)
    def open(self, address: QUrl) -> None:
        """Follow a link; links of an earlier session of the plugin lead nowhere."""
        call = self._calls.get(address.toString())
        if call is not None:
            call()


links = _Links()


class LinkFollower(QObject):
    """Follows the links of a log that is clicked; the log of QGIS 3.22 does not follow any."""

    def __init__(self, log: QTextEdit) -> None:
        super().__init__(log)
        self._log = log
        log.viewport().setMouseTracking(True)
        log.viewport().installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow a link that is clicked, and show the hand over it."""
        if event.type() not in (QEvent.Type.MouseMove, QEvent.Type.MouseButtonRelease):
            return False
        address = self._log.anchorAt(event.pos())
        is_mine = address.startswith(f"{SCHEME}:")
        if event.type() == QEvent.Type.MouseButtonRelease and is_mine:
            # Later, because the link may open a window that keeps its own event loop.
            QTimer.singleShot(0, lambda: links.open(QUrl(address)))
            return True
        shape = Qt.CursorShape.PointingHandCursor if is_mine else Qt.CursorShape.IBeamCursor
        self._log.viewport().setCursor(shape)
        return False
