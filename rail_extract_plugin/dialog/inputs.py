"""What algorithms take: clouds, rasters and lines."""

from __future__ import annotations

from qgis.core import (
    QgsProcessing,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterPointCloudLayer,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from ...core.standards import RAIL_CLASS
from ..i18n import tr
from .definitions import Definitions, helped


def cloud() -> Definitions:
    """Which points are rail."""
    return (
        helped(
            QgsProcessingParameterPointCloudLayer("INPUT", tr("Point cloud (layer, file or folder)")),
            tr(
                "A loaded point cloud, or the path of a LAS, LAZ or COPC file, of a folder of them or of a .vpc file. "
                "The dialog's button takes one file: for many, take their virtual point cloud (.vpc)."
            ),
        ),
        helped(
            QgsProcessingParameterString("RAIL_CLASSES", tr("Rail classes"), defaultValue=str(RAIL_CLASS)),
            tr("Classes whose points lie on rails, such as 10 or 10,11. Each class is extracted on its own."),
        ),
    )


def raster() -> QgsProcessingParameterDefinition:
    """Which raster of rails."""
    return helped(
        QgsProcessingParameterRasterLayer("INPUT", tr("Rail raster")),
        tr("One band a class, 1 where there is rail, as Rasterize Rail Points makes it. North up, square cells."),
    )


def points() -> QgsProcessingParameterDefinition:
    """Which points give lines their heights."""
    return helped(
        QgsProcessingParameterPointCloudLayer("POINTS", tr("Point cloud (layer, file or folder)"), optional=True),
        tr("The cloud that the raster was made from: it moves lines onto their railheads and gives them heights."),
    )


def rails() -> QgsProcessingParameterDefinition:
    """Which lines are rails."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return helped(
        QgsProcessingParameterFeatureSource("INPUT", tr("Rails"), [line]),
        tr("Lines of railheads, from Vectorize Rails or drawn by hand."),
    )


def centerlines() -> QgsProcessingParameterDefinition:
    """Which lines are track centerlines."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return helped(
        QgsProcessingParameterFeatureSource("INPUT", tr("Track centerlines"), [line]),
        tr("Lines midway between rails, from Build Track Centerlines or drawn by hand; chainage counts along them."),
    )


def rails_of_tracks() -> QgsProcessingParameterDefinition:
    """Which rails lie beside the centerlines."""
    line = QgsProcessing.SourceType.TypeVectorLine
    return helped(
        QgsProcessingParameterFeatureSource("RAILS", tr("Rails"), [line]),
        tr("The lines that the centerlines were built from; those that left_ids and right_ids name, else the nearest."),
    )


def points_of_rails() -> QgsProcessingParameterDefinition:
    """Which points support the rails."""
    return helped(
        QgsProcessingParameterPointCloudLayer("POINTS", tr("Point cloud (layer, file or folder)"), optional=True),
        tr("The cloud that the rails came from: it tells heights, sigma_mm and points metre by metre."),
    )
