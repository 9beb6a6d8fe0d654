"""The hook through which every text that a user sees in QGIS passes."""

from __future__ import annotations

from qgis.PyQt.QtCore import QCoreApplication


def tr(text: str) -> str:
    """Translate `text` into the language of QGIS; English where there is no translation."""
    return QCoreApplication.translate("RailExtract", text)
