"""What a dialog offers after a run, as links at the end of its log."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import Qgis, QgsProcessingContext, QgsProcessingUtils, QgsVectorLayer
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QFileDialog

from ...core.errors import RailExtractError, UnclassifiedError
from ...core.standards import STANDARDS
from ..i18n import tr
from ..notices import notices
from ..writing.bundle import save_all

if TYPE_CHECKING:
    from .run_dialog import RunDialog

TOP_TO_BOTTOM = ("FINDINGS", "CENTERLINES", "RAILS", "QUALITY", "OUTPUT", "STOPS")
"""Order of the layers in a GeoPackage's project, by output."""


@dataclass(frozen=True)
class Step:
    """A step that the user may take next: its words, and what it does."""

    text: str
    take: Callable[[], None]


def after_failure(dialog: RunDialog, failure: type | None, standard: str) -> Iterator[Step]:
    """Yield what may help after a run that failed.

    Parameters
    ----------
    dialog : RunDialog
    failure : type or None
        Class of the error.
    standard : str
        Name of a rail standard that fits the points better; empty if there is none.
    """
    if failure is UnclassifiedError and "CLASSIFY" in dialog.mainWidget().wrappers:
        yield Step(tr("Find the rail points of this raw cloud, and run again"), _again(dialog, CLASSIFY=True))
    yield from _with_other_standard(dialog, standard)


def after_success(
    dialog: RunDialog, results: dict[str, Any], context: QgsProcessingContext, standard: str
) -> Iterator[Step]:
    """Yield what to do with the results of a run; see `after_failure`."""
    layers = _layers(results, context)
    if "FINDINGS" in layers and layers["FINDINGS"].featureCount():
        findings = layers["FINDINGS"].id()
        yield Step(tr("Review the findings"), lambda: notices.findings_loaded.emit(findings))
    if results.get("REPORT"):
        yield Step(tr("Open the report"), lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(results["REPORT"])))
    if layers:
        yield Step(tr("Save all layers with styles and a project in one GeoPackage…"), lambda: _save(dialog, layers))
    yield from _with_other_standard(dialog, standard)


def _with_other_standard(dialog: RunDialog, standard: str) -> Iterator[Step]:
    if standard in STANDARDS and "STANDARD" in dialog.mainWidget().wrappers:
        changes = {"STANDARD": standard, "GAUGE": None, "HEAD_WIDTH": None}
        yield Step(tr("Run again as {}").format(STANDARDS[standard].label), _again(dialog, **changes))


def _again(dialog: RunDialog, **changes: Any) -> Callable[[], None]:
    return lambda: dialog.run_again(changes)


def _layers(results: dict[str, Any], context: QgsProcessingContext) -> dict[str, QgsVectorLayer]:
    """Return the layers of a run that QGIS has loaded, the topmost first, by output."""
    named = [name for name in TOP_TO_BOTTOM if isinstance(results.get(name), str)]
    found = {name: QgsProcessingUtils.mapLayerFromString(results[name], context, False) for name in named}
    return {name: layer for name, layer in found.items() if isinstance(layer, QgsVectorLayer)}


def _save(dialog: RunDialog, layers: dict[str, QgsVectorLayer]) -> None:
    """Ask for a file, and save the layers there."""
    kind = tr("GeoPackages (*.gpkg)")
    chosen, _ = QFileDialog.getSaveFileName(dialog, tr("Save all layers of the run"), "", kind)
    if not chosen:
        return
    path = Path(chosen).with_suffix(".gpkg")
    try:
        save_all(list(layers.values()), path)
    except RailExtractError as error:
        dialog.messageBar().pushMessage("", str(error), Qgis.MessageLevel.Critical, 0)
        return
    dialog.messageBar().pushMessage("", tr("Saved {}.").format(path), Qgis.MessageLevel.Success, 0)
