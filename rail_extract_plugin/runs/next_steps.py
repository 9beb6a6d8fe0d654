"""What a dialog offers after a run, as links at the end of its log."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import Qgis, QgsProcessingContext, QgsProcessingUtils, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QFileDialog

from ...core.errors import RailExtractError, UnclassifiedError
from ...core.standards import STANDARDS
from ..notices import notices
from ..setup.dependencies import INSTALL
from ..writing.bundle import save_all

if TYPE_CHECKING:
    from .run_dialog import RunDialog


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
        yield Step("Find the rail points of this raw cloud, and run again", _again(dialog, CLASSIFY=True))
    yield from _with_other_standard(dialog, standard)


def after_success(
    dialog: RunDialog, results: dict[str, Any], context: QgsProcessingContext, standard: str
) -> Iterator[Step]:
    """Yield what to do with the results of a run; see `after_failure`."""
    algorithm = dialog.algorithm()
    if algorithm.name() == INSTALL and algorithm.provider().algorithm("extractrails").canExecute()[0]:
        yield Step("Open the sample…", notices.sample_wanted.emit)
    layers = _layers([one.name() for one in algorithm.destinationParameterDefinitions()], results, context)
    if "FINDINGS" in layers and layers["FINDINGS"].featureCount():
        findings = layers["FINDINGS"].id()
        yield Step("Review the findings", lambda: notices.findings_loaded.emit(findings))
    if results.get("REPORT"):
        yield Step("Open the report", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(results["REPORT"])))
    if layers:
        yield Step("Save all layers with styles and a project in one GeoPackage…", lambda: _save(dialog, layers))
    yield from _with_other_standard(dialog, standard)


def _with_other_standard(dialog: RunDialog, standard: str) -> Iterator[Step]:
    if standard in STANDARDS and "STANDARD" in dialog.mainWidget().wrappers:
        changes = {"STANDARD": standard, "GAUGE": None, "HEAD_WIDTH": None}
        yield Step(f"Run again as {STANDARDS[standard].label}", _again(dialog, **changes))


def _again(dialog: RunDialog, **changes: Any) -> Callable[[], None]:
    return lambda: dialog.run_again(changes)


def _layers(names: Sequence[str], results: dict[str, Any], context: QgsProcessingContext) -> dict[str, QgsVectorLayer]:
    """Return the layers of lines and points of these outputs that QGIS has loaded, the topmost first, by output."""
    written = {name: results[name] for name in names if isinstance(results.get(name), str)}
    found = {QgsProcessingUtils.mapLayerFromString(value, context, False): name for name, value in written.items()}
    order = QgsProject.instance().layerTreeRoot().layerOrder()
    return {found[layer]: layer for layer in order if layer in found and isinstance(layer, QgsVectorLayer)}


def _save(dialog: RunDialog, layers: dict[str, QgsVectorLayer]) -> None:
    """Ask for a file, and save the layers there."""
    kind = "GeoPackages (*.gpkg)"
    chosen, _ = QFileDialog.getSaveFileName(dialog, "Save all layers of the run", "", kind)
    if not chosen:
        return
    path = Path(chosen).with_suffix(".gpkg")
    try:
        save_all(list(layers.values()), path)
    except RailExtractError as error:
        dialog.messageBar().pushMessage("", str(error), Qgis.MessageLevel.Critical, 0)
        return
    dialog.messageBar().pushMessage("", f"Saved {path}.", Qgis.MessageLevel.Success, 0)
