"""The definitions of QGIS for the parameters, outputs and figures that a job declares.

Labels state the unit. Numbers are plain numbers, so that QGIS does not convert them to the unit of a layer.
"""

from __future__ import annotations

from typing import Any, Callable, Union

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputBoolean,
    QgsProcessingOutputDefinition,
    QgsProcessingOutputFolder,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterField,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterNumber,
    QgsProcessingParameterPoint,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from ...core.jobs import declaration as kinds
from ...core.jobs.declaration import Figure, Parameter
from ...core.jobs.values import Job
from .cloud_parameter import CloudParameter

Definitions = tuple[Union[QgsProcessingParameterDefinition, QgsProcessingOutputDefinition], ...]
"""Parameters and outputs."""

_TYPES = QgsProcessing.SourceType
LAYERS = {
    kinds.LINE: _TYPES.TypeVectorLine,
    kinds.POINT: _TYPES.TypeVectorPoint,
    kinds.POLYGON: _TYPES.TypeVectorPolygon,
    kinds.PLACES: _TYPES.TypeVectorAnyGeometry,
    kinds.TABLE: _TYPES.TypeVector,
}
"""Types of layers."""

CHOICE_WIDGET = {"widget_wrapper": {"class": f"{__package__}.choice_widget.ChoiceWidgetWrapper"}}
"""Metadata by which QGIS finds the list in words. Models contain it: the class never changes its place."""

STANDARD_WIDGET = {"widget_wrapper": {"class": f"{__package__}.standard_widget.StandardWidgetWrapper"}}
"""The same for the list of standards."""

FIGURES = {
    "number": QgsProcessingOutputNumber,
    "text": QgsProcessingOutputString,
    "folder": QgsProcessingOutputFolder,
    "flag": QgsProcessingOutputBoolean,
}


def definitions_of(job: Job) -> Definitions:
    """Return the definitions of a job's parameters, outputs and figures, in the order of the interface."""
    return (*map(_defined, (*job.parameters, *job.outputs)), *map(_figure, job.figures))


def _figure(one: Figure) -> QgsProcessingOutputDefinition:
    return FIGURES[one.kind](one.name, one.label)


def _defined(one: Parameter) -> QgsProcessingParameterDefinition:
    """Define a parameter or an output."""
    made = MAKERS[type(one)](one)
    made.setHelp(one.help)
    if one.advanced:
        made.setFlags(made.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    if isinstance(one, kinds.Output) and one.on_demand:
        made.setCreateByDefault(False)
    return made


def _number(one: kinds.Number) -> QgsProcessingParameterNumber:
    types = QgsProcessingParameterNumber.Type
    kind = types.Integer if one.whole else types.Double
    made = QgsProcessingParameterNumber(one.name, one.label, kind, one.default, one.optional, one.low, one.high)
    if not one.whole:
        made.setMetadata({"widget_wrapper": {"decimals": one.decimals}})
    return made


def _choice(one: kinds.Choice) -> QgsProcessingParameterEnum:
    """Define a choice among ids, for which `choices.WORDS` has the words that dialogs show, or among numbered words."""
    ids = {} if one.numbered else {"usesStaticStrings": True}
    made = QgsProcessingParameterEnum(
        one.name, one.label, list(one.options), one.several, one.default, one.optional, **ids
    )
    if not one.numbered:
        made.setMetadata(STANDARD_WIDGET if one.name == "STANDARD" else CHOICE_WIDGET)
    return made


def _file(one: kinds.FileInput) -> QgsProcessingParameterFile:
    return QgsProcessingParameterFile(one.name, one.label, optional=one.optional, fileFilter=one.kinds)


def _layer(one: kinds.LayerOutput) -> QgsProcessingParameterFeatureSink:
    """Define a layer; features may also be added to an existing one."""
    made = QgsProcessingParameterFeatureSink(one.name, one.label, LAYERS[one.kind], optional=one.optional)
    made.setSupportsAppend(True)
    return made


def _field(one: kinds.FieldInput) -> QgsProcessingParameterField:
    any_type = QgsProcessingParameterField.DataType.Any
    return QgsProcessingParameterField(one.name, one.label, None, one.of, any_type, False, one.optional)


MAKERS: dict[type, Callable[[Any], QgsProcessingParameterDefinition]] = {
    kinds.Number: _number,
    kinds.Flag: lambda one: QgsProcessingParameterBoolean(one.name, one.label, one.default),
    kinds.Choice: _choice,
    kinds.Text: lambda one: QgsProcessingParameterString(one.name, one.label, one.default, optional=one.optional),
    kinds.Cloud: lambda one: CloudParameter(one.name, one.label, one.optional),
    kinds.LayerInput: lambda one: QgsProcessingParameterFeatureSource(
        one.name, one.label, [LAYERS[kind] for kind in one.kinds], optional=one.optional
    ),
    kinds.RasterInput: lambda one: QgsProcessingParameterRasterLayer(one.name, one.label, optional=one.optional),
    kinds.FileInput: _file,
    kinds.FieldInput: _field,
    kinds.System: lambda one: QgsProcessingParameterCrs(one.name, one.label, optional=one.optional),
    kinds.Extent: lambda one: QgsProcessingParameterExtent(one.name, one.label, optional=one.optional),
    kinds.Place: lambda one: QgsProcessingParameterPoint(one.name, one.label, optional=one.optional),
    kinds.LayerOutput: _layer,
    kinds.RasterOutput: lambda one: QgsProcessingParameterRasterDestination(one.name, one.label, optional=one.optional),
    kinds.FileOutput: lambda one: QgsProcessingParameterFileDestination(
        one.name, one.label, one.kinds, optional=one.optional
    ),
}
"""Functions that make a definition, by the kind of what is declared."""
