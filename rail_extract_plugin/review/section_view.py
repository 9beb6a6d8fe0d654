"""The widget that draws a cross-section: the whole of it on top, and the heads of both rails, enlarged, below."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from qgis.PyQt.QtCore import QPointF, QRectF, QSize, Qt
from qgis.PyQt.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF, QTextOption
from qgis.PyQt.QtWidgets import QSizePolicy, QWidget

from .sections import REACH_M, Picture

POINT, RAIL, FRAME, PAPER, SOFT = (QColor(name) for name in ("#1565c0", "#d62839", "#dfe5ec", "#ffffff", "#5d6b7a"))
PROFILE = QColor("#2e7d4f")

POINT_PX, CROSS_PX, LINE_PX, GAP_PX = 1.6, 6.0, 18.0, 6.0
"""Radius of a point, half the height of a rail's mark, height of a line of text, and space between panels."""

WHOLE = 0.35
"""Largest share of the height, or half the width, for the whole section."""

WHOLE_HEIGHT_M = 0.8
"""Height that the whole section shows at least: both heads of a track with the largest cant, and what is near."""

WIDE_WIDTH_M, WIDE_HEIGHT_M, WIDE_UP_M = 7.0, 6.4, 2.6
"""Width, height and height of the middle of the whole cross-section of an object inside a profile."""

KEY_PX = 24.0
"""Length of the line before the words that say what the outline is."""

MARK_PX = 7.0
"""Radius of the ring around the worst place."""

HEAD_M = 0.04
"""Height of the outline of a head without points: about as high as heads of all profiles."""

HEADS, HEADS_HIGH = 3.0, 1.6
"""Width and height of an enlarged head in head widths at least, so that points next to it are seen, too."""


@dataclass(frozen=True)
class Panel:
    """A part of a section and where it is drawn: its middle and the least that is seen of it, metres."""

    box: QRectF
    right: float
    up: float
    width_m: float
    height_m: float
    title: str

    @property
    def scale(self) -> float:
        """Pixels per metre, in both directions."""
        return min(self.box.width() / self.width_m, max(self.box.height() - LINE_PX, 1.0) / self.height_m)

    def place(self, right: float, up: float) -> QPointF:
        """Return where a place of the section is drawn."""
        middle = self.box.center()
        return QPointF(
            middle.x() + (right - self.right) * self.scale,
            middle.y() + 0.5 * LINE_PX - (up - self.up) * self.scale,
        )


class SectionView(QWidget):
    """Draws a picture."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.picture: Picture | None = None
        self.setMinimumHeight(140)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_picture(self, picture: Picture | None) -> None:
        """Draw another picture."""
        self.picture = picture
        self.update()

    def sizeHint(self) -> QSize:
        """Return the preferred size."""
        return QSize(340, 260)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), PAPER)
        if self.picture is not None:
            for panel in self._panels(self.picture):
                painter.save()
                painter.setClipRect(panel.box)
                _draw(painter, panel, self.picture)
                painter.restore()
        painter.end()

    def _panels(self, picture: Picture) -> Iterator[Panel]:
        """Yield the whole section, and the nearest rail on either side; only one where none is on the other side."""
        if picture.mark is not None:
            box = QRectF(0, 0, float(self.width()), float(self.height()))
            yield Panel(box, 0.0, WIDE_UP_M, WIDE_WIDTH_M, WIDE_HEIGHT_M, "left – right")
            return
        whole, one, other = _boxes(float(self.width()), float(self.height()))
        yield Panel(whole, 0.0, 0.0, 2 * REACH_M, WHOLE_HEIGHT_M, "left" + " – " + "right")
        is_left = picture.rails[:, 0] < 0
        least = HEADS * picture.head_width_m, HEADS_HIGH * picture.head_width_m
        heads = [(one, "left rail", is_left), (other, "right rail", ~is_left)]
        if is_left.all() or not is_left.any():
            heads = [(one.united(other), "rail", np.ones_like(is_left))] if len(is_left) else []
        for box, title, side in heads:
            mine = picture.rails[side]
            right, up = mine[np.argmin(np.abs(mine[:, 0]))]
            yield Panel(box, float(right), float(up), *least, title)


def _boxes(width: float, height: float) -> tuple[QRectF, QRectF, QRectF]:
    """Return the boxes of the whole section and of both heads: beside each other where this shows heads larger."""
    high = min(WHOLE * height, width * WHOLE_HEIGHT_M / (2 * REACH_M) + LINE_PX)
    below, half = height - high - GAP_PX, 0.5 * (width - GAP_PX)
    if min(half / HEADS, below / HEADS_HIGH) >= min(0.5 * half / HEADS, height / HEADS_HIGH):
        whole, top = QRectF(0, 0, width, high), high + GAP_PX
        return whole, QRectF(0, top, half, below), QRectF(half + GAP_PX, top, half, below)
    quarter = 0.5 * (half - GAP_PX)
    first, second = QRectF(half + GAP_PX, 0, quarter, height), QRectF(width - quarter, 0, quarter, height)
    return QRectF(0, 0, half, height), first, second


def _draw(painter: QPainter, panel: Panel, picture: Picture) -> None:
    """Draw points, rails, frame and scale of a panel."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(POINT)
    for right, up in picture.points if picture.points is not None else ():
        painter.drawEllipse(panel.place(right, up), POINT_PX, POINT_PX)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if picture.outline is not None:
        _draw_outline(painter, panel, picture.outline, picture.legend)
    if picture.mark is not None:
        painter.setPen(QPen(RAIL, 2.0))
        painter.drawEllipse(panel.place(*picture.mark.tolist()), MARK_PX, MARK_PX)
    for (right, up), missing in zip(picture.rails, picture.missing):
        place, half = panel.place(right, up), 0.5 * picture.head_width_m * panel.scale
        painter.setPen(QPen(RAIL, 1.6, Qt.PenStyle.DashLine if missing else Qt.PenStyle.SolidLine))
        if missing:
            painter.drawRect(QRectF(place.x() - half, place.y(), 2 * half, HEAD_M * panel.scale))
            continue
        painter.drawLine(place - QPointF(half, 0), place + QPointF(half, 0))
        painter.drawLine(place - QPointF(0, CROSS_PX), place + QPointF(0, CROSS_PX))
    painter.setPen(QPen(FRAME))
    painter.drawRect(panel.box.adjusted(0.5, 0.5, -0.5, -0.5))
    painter.setPen(QPen(SOFT))
    painter.drawText(panel.box.adjusted(6, 2, -6, 0), panel.title, QTextOption(Qt.AlignmentFlag.AlignLeft))
    painter.drawText(panel.box.adjusted(6, 2, -6, 0), _width(panel), QTextOption(Qt.AlignmentFlag.AlignRight))


def _draw_outline(painter: QPainter, panel: Panel, outline: np.ndarray, legend: str) -> None:
    """Draw the outline of a profile, and say at the foot of the panel, in up to two lines, what it is."""
    painter.setPen(QPen(PROFILE, 1.6))
    painter.drawPolyline(QPolygonF([panel.place(right, up) for right, up in outline.tolist()]))
    foot = panel.box.adjusted(6, panel.box.height() - 2 * LINE_PX, -6, 0)
    painter.drawLine(QPointF(foot.left(), foot.center().y()), QPointF(foot.left() + KEY_PX, foot.center().y()))
    painter.setPen(QPen(SOFT))
    painter.drawText(foot.adjusted(KEY_PX + 6, 0, 0, 0), legend, QTextOption(Qt.AlignmentFlag.AlignVCenter))


def _width(panel: Panel) -> str:
    """Write the width that a panel shows."""
    width_m = panel.box.width() / panel.scale
    return f"{width_m:.1f} m" if width_m >= 1 else f"{1000 * width_m:.0f} mm"
