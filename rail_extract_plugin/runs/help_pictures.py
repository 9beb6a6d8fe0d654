"""Pictures in the help of a dialog that is narrower than they are."""

from __future__ import annotations

from collections.abc import Iterator

from qgis.PyQt.QtCore import QEvent, QObject
from qgis.PyQt.QtGui import QTextCursor, QTextDocument, QTextFragment
from qgis.PyQt.QtWidgets import QTextBrowser

WIDTH_PX = 240
"""Nominal width of the pictures."""


class PictureFitter(QObject):
    """Keeps pictures within the width of the help, which then needs no horizontal scroll bar."""

    def __init__(self, browser: QTextBrowser) -> None:
        super().__init__(browser)
        self._browser = browser
        browser.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Fit the pictures when the help gets another width."""
        if event.type() == QEvent.Type.Resize:
            document = self._browser.document()
            around = 2 * (self._browser.frameWidth() + document.documentMargin())
            room = self._browser.width() - self._browser.verticalScrollBar().sizeHint().width() - around
            width = min(WIDTH_PX, max(room, 1))
            for picture in list(_pictures(document)):
                _set_width(document, picture, width)
        return False


def _pictures(document: QTextDocument) -> Iterator[QTextFragment]:
    """Yield the parts of a text that are pictures."""
    block = document.begin()
    while block.isValid():
        parts = block.begin()
        while not parts.atEnd():
            if parts.fragment().charFormat().isImageFormat():
                yield parts.fragment()
            parts += 1
        block = block.next()


def _set_width(document: QTextDocument, picture: QTextFragment, width: float) -> None:
    """Draw a picture with a width, if it is not that wide already."""
    shape = picture.charFormat().toImageFormat()
    if shape.width() == width:
        return
    shape.setWidth(width)
    cursor = QTextCursor(document)
    cursor.setPosition(picture.position())
    cursor.setPosition(picture.position() + picture.length(), QTextCursor.MoveMode.KeepAnchor)
    cursor.setCharFormat(shape)
