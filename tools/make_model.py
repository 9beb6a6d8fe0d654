"""Write models/extract_rails.model3, the editable twin of Extract Rails, from the algorithms as they are.

Run it after a change of their parameters, in the environment that `make env` prints. Every parameter of Extract Rails
is an input of the model, and goes to all steps that have one of that name.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ["QT_HASH_SEED"] = "0"  # the same model gives the same file

from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
    QgsProcessingParameterFile,
)
from qgis.PyQt.QtCore import QPointF  # noqa: E402

MODEL = Path(__file__).resolve().parent.parent / "models" / "extract_rails.model3"

STEPS = {
    "raster": "rasterizerailpoints",
    "cleaned": "frpdfcleanup",
    "rails": "vectorizerails",
    "centerlines": "buildtrackcenterlines",
    "quality": "measuretrackgeometry",
}
"""What each step makes, which is its id in the model, and the algorithm that makes it."""

CLOUDS = {("raster", "INPUT"), ("rails", "POINTS"), ("quality", "POINTS")}
RAILS = ("quality", "RAILS")
TOLD_BY_RASTER = {(step, name) for step in ("cleaned", "rails") for name in ("GAUGE", "HEAD_WIDTH")}

RESULTS = {"rails": "RAILS", "centerlines": "CENTERLINES", "quality": "QUALITY"}

COLUMN, ROW = 260, 130
"""Distances in the designer's picture."""

HELP = (
    "The steps of Extract Rails one by one, to be changed in the model designer: leave a step out, put your own in its "
    "place, or look at what lies between. As it is, it gives the lines of Extract Rails, of clouds beyond half a "
    "kilometre within half a millimetre."
)


def build() -> QgsProcessingModelAlgorithm:
    """Make the model; the plugin's provider has to be registered."""
    registry = QgsApplication.processingRegistry()
    whole = registry.algorithmById("railextract:extractrails")
    model = QgsProcessingModelAlgorithm("Extract rails, step by step", "Rails and tracks", "railsandtracks")
    model.setHelpContent({"ALG_DESC": HELP})
    inputs = [definition.clone() for definition in whole.parameterDefinitions() if not definition.isDestination()]
    inputs[0] = _file_instead_of(inputs[0])
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
            child.setModelOutputs({RESULTS[step]: _output(step, number)})
        model.addChildAlgorithm(child)
        before = step
    return model


def _file_instead_of(cloud) -> QgsProcessingParameterFile:
    """Make a file parameter of the cloud's: a QGIS without PDAL refuses every path in a point cloud parameter."""
    made = QgsProcessingParameterFile(cloud.name(), "Point cloud (LAS, LAZ or COPC file, folder of them, or .vpc)")
    made.setHelp("The path of a LAS, LAZ or COPC file, of a folder of them or of a virtual point cloud (.vpc).")
    return made


def _source(step: str, definition, inputs: set[str], before: str | None):
    """Say where a parameter of a step gets its value from; None leaves it empty."""
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


def _output(step: str, number: int) -> QgsProcessingModelOutput:
    """Make what a step gives an output of the model."""
    output = QgsProcessingModelOutput(RESULTS[step], RESULTS[step].capitalize())
    output.setChildId(step)
    output.setChildOutputName("OUTPUT")
    output.setPosition(QPointF((number + 0.5) * COLUMN, 6 * ROW))
    return output


def main() -> None:
    """Register the plugin in a bare QGIS, and write the model."""
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
