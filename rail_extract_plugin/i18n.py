"""The hook for translating the texts that users see in QGIS."""

from __future__ import annotations

from qgis.PyQt.QtCore import QCoreApplication


def tr(text: str) -> str:
    """Translate `text` into the language of QGIS; English if there is no translation."""
    return QCoreApplication.translate("RailExtract", text)
