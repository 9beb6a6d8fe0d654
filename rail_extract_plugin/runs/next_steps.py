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
from ..writing.bundle import move_to, save_all
from .preview import name_preview

if TYPE_CHECKING:
    from .run_dialog import RunDialog


@dataclass(frozen=True)
class Step:
    """A step that the user may take next: its words, what it does and, after a failure, why it may help."""

    text: str
    take: Callable[[], None]
    why: str = ""


CARRIED = ("POINTS", "STANDARD", "GAUGE", "HEAD_WIDTH", "OTHER_GAUGES", "LEAVE_OUT")
"""Parameters that a chain of steps shares: what one of them was given is proposed in the following ones."""

FOLLOWING = {
    "rasterizerailpoints": ("Clean the raster…", "frpdfcleanup", {"INPUT": "OUTPUT", "POINTS": "INPUT"}),
    "frpdfcleanup": ("Vectorize the rails…", "vectorizerails", {"INPUT": "OUTPUT"}),
    "vectorizerails": ("Build the track centerlines…", "buildtrackcenterlines", {"INPUT": "OUTPUT"}),
    "buildtrackcenterlines": (
        *("Measure the track geometry…", "measuretrackgeometry"),
        {"INPUT": "OUTPUT", "RAILS": "INPUT"},
    ),
}
"""What follows a single step: words, algorithm, and its parameters by outputs and parameters of that step."""


def after_failure(dialog: RunDialog, failure: type | None, standard: str) -> Iterator[Step]:
    """Yield what may help after a run that failed with an error of this class.

    The standard fits the points better; it is empty if none does.
    """
    yield from _with_other_standard(dialog, standard)
    if failure is UnclassifiedError and "CLASSIFY" in dialog.mainWidget().wrappers:
        why = "No point of the cloud has a rail class."
        yield Step("Find the rail points of this raw cloud, and run again", _again(dialog, CLASSIFY=True), why)


def after_success(
    dialog: RunDialog, results: dict[str, Any], context: QgsProcessingContext, standard: str, is_preview: bool = False
) -> Iterator[Step]:
    """Yield what to do with the results of a run, or of a preview; see `after_failure`."""
    yield from _with_other_standard(dialog, standard)
    algorithm = dialog.algorithm()
    if algorithm.name() == INSTALL and algorithm.provider().algorithm("extractrails").canExecute()[0]:
        yield Step("Open the sample…", notices.sample_wanted.emit)
    layers = _layers([one.name() for one in algorithm.destinationParameterDefinitions()], results, context)
    if is_preview:
        for layer in list(layers.values())[:1]:
            name_preview(layer)
        yield Step("Run on all that is chosen", _again(dialog))
        return
    yield from _in_other_dialogs(dialog, layers, results)
    if "FINDINGS" in layers and layers["FINDINGS"].featureCount():
        findings = layers["FINDINGS"].id()
        yield Step("Review the findings", lambda: notices.findings_loaded.emit(findings))
    report = results.get("REPORT")
    if report:
        yield Step("Open the report", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(report)))
    if layers:
        ids = [layer.id() for layer in layers.values()]
        text = "Save all layers with styles and a project in one GeoPackage…"
        yield Step(text, lambda: _save(dialog, ids, Path(report) if report else None))


def _with_other_standard(dialog: RunDialog, standard: str) -> Iterator[Step]:
    if standard in STANDARDS and "STANDARD" in dialog.mainWidget().wrappers:
        changes = {"STANDARD": standard, "GAUGE": None, "HEAD_WIDTH": None}
        label = STANDARDS[standard].label
        yield Step(f"Run again as {label}", _again(dialog, **changes), f"The rails look like {label}.")


def _in_other_dialogs(dialog: RunDialog, layers: dict[str, QgsVectorLayer], results: dict[str, Any]) -> Iterator[Step]:
    """Yield what goes on from the main result of a run: with another algorithm, or with the same one once more."""
    if "ELEMENTS" in layers and "FIXED" in dialog.mainWidget().wrappers:
        values = {"INPUT": layers["ELEMENTS"].id()}
        yield Step("Export the elements for design software…", lambda: dialog.go_on("exportalignment", values))
    if "RAIL_POINTS" in results and results.get("OUTPUT"):
        given = dialog.mainWidget().createProcessingParameters()
        values = {"INPUT": dialog.cloud_layer(results["OUTPUT"]), "RAIL_CLASSES": str(given["RAIL_CLASS"])}
        values["STANDARD"] = given["STANDARD"]
        name = Path(results["OUTPUT"]).name
        yield Step(f"Extract the rails of {name}…", lambda: dialog.go_on("extractrails", values))
    if dialog.algorithm().name() == "trainrailclassifier" and results.get("WEIGHTS"):
        yield from _after_training(dialog, results)
    if dialog.algorithm().name() in FOLLOWING and results.get("OUTPUT"):
        yield _following(dialog, results)


def _after_training(dialog: RunDialog, results: dict[str, Any]) -> Iterator[Step]:
    """Yield the classification of a cloud with the new weights, and the page on the training."""
    standard = dialog.mainWidget().createProcessingParameters()["STANDARD"]
    values = {"METHOD": "LEARNED", "WEIGHTS": results["WEIGHTS"], "STANDARD": standard}
    yield Step("Classify a cloud with these weights…", lambda: dialog.go_on("classifyrailpoints", values))
    card = results.get("CARD")
    if card:
        yield Step("Open the page on the training", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(card)))


def _following(dialog: RunDialog, results: dict[str, Any]) -> Step:
    """Return the step after a single step, with its result, and with what this one and those before were given."""
    text, name, sources = FOLLOWING[dialog.algorithm().name()]
    given = dialog.mainWidget().createProcessingParameters()
    carried = {one: given[one] for one in CARRIED if given.get(one)}
    found = {one: results.get(source) or given[source] for one, source in sources.items()}
    return Step(text, lambda: dialog.go_on(name, {**dialog.given, **carried, **found}))


def _again(dialog: RunDialog, **changes: Any) -> Callable[[], None]:
    return lambda: dialog.run_again(changes)


def _layers(names: Sequence[str], results: dict[str, Any], context: QgsProcessingContext) -> dict[str, QgsVectorLayer]:
    """Return the layers of lines and points of these outputs that QGIS has loaded, the topmost first, by output."""
    written = {name: results[name] for name in names if isinstance(results.get(name), str)}
    found = {QgsProcessingUtils.mapLayerFromString(value, context, False): name for name, value in written.items()}
    order = QgsProject.instance().layerTreeRoot().layerOrder()
    return {found[layer]: layer for layer in order if layer in found and isinstance(layer, QgsVectorLayer)}


def _save(dialog: RunDialog, ids: Sequence[str], report: Path | None) -> None:
    """Ask for a file, save the layers there that are still in the project, and have the project use the file."""
    kind = "GeoPackages (*.gpkg)"
    chosen, _ = QFileDialog.getSaveFileName(dialog, "Save all layers of the run", "", kind)
    if not chosen:
        return
    path = Path(chosen).with_suffix(".gpkg")
    layers = [layer for layer in map(QgsProject.instance().mapLayer, ids) if layer is not None]
    try:
        copied = save_all(layers, path, report)
    except RailExtractError as error:
        dialog.messageBar().pushMessage("", str(error), Qgis.MessageLevel.Critical, 0)
        return
    move_to(layers, path)
    text = f"Saved {' and '.join(one.name for one in (path, copied) if one)}. The project uses this file from now on."
    dialog.messageBar().pushMessage("", text, Qgis.MessageLevel.Success, 0)
