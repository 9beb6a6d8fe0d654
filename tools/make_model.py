"""Write models/extract_rails.model3, the editable form of Extract Rails, from the algorithms.

Run it after a change to their parameters, in the environment that `make env` prints. Each parameter of Extract Rails is
an input of the model and is passed to all steps that have a parameter of this name.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ["QT_HASH_SEED"] = "0"  # makes the file reproducible

from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsProcessingAlgorithm,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
)
from qgis.PyQt.QtCore import QPointF  # noqa: E402
from rail_extract.rail_extract_plugin.dialog.cloud_parameter import model_input  # noqa: E402

MODEL = Path(__file__).resolve().parent.parent / "models" / "extract_rails.model3"

STEPS = {
    "raster": "rasterizerailpoints",
    "cleaned": "frpdfcleanup",
    "rails": "vectorizerails",
    "centerlines": "buildtrackcenterlines",
    "quality": "measuretrackgeometry",
}
"""Algorithm of each step, by the result of the step, which is its id in the model."""

CLOUDS = {("raster", "INPUT"), ("rails", "POINTS"), ("quality", "POINTS")}
RAILS = ("quality", "RAILS")
TOLD_BY_RASTER = {(step, name) for step in ("cleaned", "rails") for name in ("GAUGE", "HEAD_WIDTH")}

RESULTS = {
    "rails": {"RAILS": "OUTPUT"},
    "centerlines": {"CENTERLINES": "OUTPUT", "PAIRED_RAILS": "RAILS"},
    "quality": {"QUALITY": "OUTPUT", "FINDINGS": "FINDINGS", "REPORT": "REPORT"},
}
"""Results of the model by step, and the output of the step that each is; rails know their tracks once paired."""

FURTHER = {"PAIRED_RAILS": "Rails with the numbers of their tracks"}
"""Words for the results that Extract Rails does not have."""

WITHOUT_STEP = ("CLASSIFY", "METHOD", "WEIGHTS", "SEEDS")
"""Parameters of Extract Rails that no step of the model has: Classify Rail Points or Grow Rail Points from Seeds can be
put before it."""

COLUMN, ROW = 260, 130
"""Spacing of the boxes in the model designer."""

HELP = (
    "The individual steps of Extract Rails, for editing in the model designer: remove a step, replace one with your "
    "own, or inspect the intermediate results. Unchanged, the model gives the same lines as Extract Rails; for clouds "
    "longer than half a kilometre, the lines agree to within 0.5 mm."
)


def build() -> QgsProcessingModelAlgorithm:
    """Build the model; the plugin's provider must be registered."""
    registry = QgsApplication.processingRegistry()
    whole = registry.algorithmById("railextract:extractrails")
    model = QgsProcessingModelAlgorithm("Extract rails, step by step", "Rails and tracks", "railsandtracks")
    model.setHelpContent({"ALG_DESC": HELP})
    inputs = [
        definition.clone()
        for definition in whole.parameterDefinitions()
        if not definition.isDestination() and definition.name() not in WITHOUT_STEP
    ]
    inputs[0] = model_input(inputs[0])
    # Each step reads the standard, and those after the first have no points to detect it from.
    standard = registry.algorithmById("railextract:rasterizerailpoints").parameterDefinition("STANDARD")
    inputs = [standard.clone() if one.name() == "STANDARD" else one for one in inputs]
    for number, definition in enumerate(inputs):
        component = QgsProcessingModelParameter(definition.name())
        component.setPosition(QPointF((number // 8) * COLUMN, (number % 8) * ROW / 2))
        model.addModelParameter(definition, component)
    model.setParameterOrder([definition.name() for definition in inputs])
    names = {definition.name() for definition in inputs}
    before = None
    for number, (step, algorithm) in enumerate(STEPS.items()):
        child = QgsProcessingModelChildAlgorithm(f"railextract:{algorithm}")
        child.setChildId(step)
        child.setDescription(registry.algorithmById(child.algorithmId()).displayName())
        child.setPosition(QPointF((number + 0.5) * COLUMN, 5 * ROW))
        for definition in child.algorithm().parameterDefinitions():
            source = _source(step, definition, names, before)
            if source is not None:
                child.addParameterSources(definition.name(), [source])
        if step in RESULTS:
            child.setModelOutputs({result: _output(whole, step, result, number) for result in RESULTS[step]})
        model.addChildAlgorithm(child)
        before = step
    return model


def _source(step: str, definition, inputs: set[str], before: str | None):
    """Return the source of a parameter's value; None leaves the parameter empty."""
    name = definition.name()
    if (step, name) in CLOUDS:
        return QgsProcessingModelChildParameterSource.fromModelParameter("INPUT")
    if (step, name) == RAILS:
        return QgsProcessingModelChildParameterSource.fromChildOutput("rails", "OUTPUT")
    if name == "INPUT":
        return QgsProcessingModelChildParameterSource.fromChildOutput(before, "OUTPUT")
    if (step, name) in TOLD_BY_RASTER or definition.isDestination():
        return None
    if name in inputs:
        return QgsProcessingModelChildParameterSource.fromModelParameter(name)
    return QgsProcessingModelChildParameterSource.fromStaticValue(definition.defaultValue())


def _output(whole: QgsProcessingAlgorithm, step: str, result: str, number: int) -> QgsProcessingModelOutput:
    """Define a result of a step as an output of the model, with the words of Extract Rails."""
    known = whole.parameterDefinition(result)
    output = QgsProcessingModelOutput(result, known.description() if known else FURTHER[result])
    output.setChildId(step)
    output.setChildOutputName(RESULTS[step][result])
    output.setPosition(QPointF((number + 0.5) * COLUMN, (6 + list(RESULTS[step]).index(result)) * ROW))
    return output


def main() -> None:
    """Register the plugin in a QGIS without other plugins, and write the model."""
    application = QgsApplication([], False)
    application.initQgis()
    from rail_extract import classFactory

    plugin = classFactory(None)
    plugin.initProcessing()
    written = build().toFile(str(MODEL))
    plugin.unload()
    application.exitQgis()
    sys.exit(0 if written else f"{MODEL} can't be written.")


if __name__ == "__main__":
    main()
