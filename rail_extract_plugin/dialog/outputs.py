"""What algorithms give: layers, files and numbers."""

from __future__ import annotations

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
)

from ..i18n import tr
from .definitions import helped

Numbers = tuple[QgsProcessingOutputNumber, ...]


def rails(name: str = "OUTPUT", optional: bool = False) -> QgsProcessingParameterDefinition:
    """Lines of railheads."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return helped(
        QgsProcessingParameterFeatureSink(name, tr("Rails"), line, optional=optional),
        tr("Lines on top of the railheads, with their length, their support by points and their standard error."),
    )


def centerlines(name: str = "OUTPUT", optional: bool = False) -> QgsProcessingParameterDefinition:
    """Lines midway between rails."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return helped(
        QgsProcessingParameterFeatureSink(name, tr("Track centerlines"), line, optional=optional),
        tr("Lines midway between the two rails of each track, with its gauge and cant."),
    )


def quality(name: str = "OUTPUT") -> QgsProcessingParameterDefinition:
    """Points along tracks."""
    point = QgsProcessing.SourceType.TypeVectorPoint
    return helped(
        QgsProcessingParameterFeatureSink(name, tr("Track geometry"), point, optional=True),
        tr("Points along each track with gauge, cant, twist, radius, gradient, standard error and support."),
    )


def cleaned() -> QgsProcessingParameterDefinition:
    """Rasters after the network."""
    return helped(
        QgsProcessingParameterRasterDestination("CLEANED", tr("Cleaned rail raster"), optional=True),
        tr("What the network made of the rastered points, like the result of FRPDF Cleanup."),
    )


def report() -> QgsProcessingParameterDefinition:
    """Page on the whole result."""
    return helped(
        QgsProcessingParameterFileDestination("REPORT", tr("Report"), tr("Web pages (*.html)"), optional=True),
        tr("A page for the browser: whether the result is good and where it is not, a map, and plots of each track."),
    )


def rail_figures() -> Numbers:
    """Numbers about the rails."""
    return (
        QgsProcessingOutputNumber("RAIL_COUNT", tr("Number of rails")),
        QgsProcessingOutputNumber("RAIL_LENGTH", tr("Length of the rails [m]")),
    )


def centerline_figures() -> Numbers:
    """Numbers about the tracks."""
    return (
        QgsProcessingOutputNumber("CENTERLINE_COUNT", tr("Number of track centerlines")),
        QgsProcessingOutputNumber("CENTERLINE_LENGTH", tr("Length of the track centerlines [m]")),
    )


def quality_figures() -> Numbers:
    """Numbers that tell how well tracks are measured."""
    return (
        QgsProcessingOutputNumber("STATION_COUNT", tr("Number of measured places")),
        QgsProcessingOutputNumber("SIGMA", tr("Standard error of the centerlines [mm]")),
        QgsProcessingOutputNumber("BRIDGED_LENGTH", tr("Length without points on a rail [m]")),
    )


def engine() -> QgsProcessingOutputString:
    """Which engine ran."""
    return QgsProcessingOutputString("ENGINE_USED", tr("Engine that ran the network"))
