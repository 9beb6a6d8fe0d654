"""The inputs of the algorithms: clouds, rasters and lines."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterField,
    QgsProcessingParameterFile,
    QgsProcessingParameterPoint,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from ...core.alignment.km_text import HECTOMETRES, NOTATIONS
from ...core.design_numbers import KM
from ...core.parameters import AIRBORNE_CLASSES
from ...core.standards import RAIL_CLASS
from .cloud_parameter import CloudParameter
from .definitions import ANY, LINE, POINT, TABLE, Definitions, advanced, choice, helped, number
from .parameter_values import DIRECTIONS, INCREASING


def cloud() -> Definitions:
    """Define the parameters for the rail points."""
    return (
        helped(
            CloudParameter("INPUT", "Point cloud (layer, file or folder)"),
            "A loaded point cloud layer, or the path of a LAS, LAZ or COPC file, of a folder of such files, or of "
            "a virtual point cloud (.vpc).",
        ),
        helped(
            QgsProcessingParameterString("RAIL_CLASSES", "Rail classes", defaultValue=str(RAIL_CLASS)),
            "Classes of the points on rails, such as 10 or 10,11. Each class is processed separately.",
        ),
    )


def raw_cloud() -> QgsProcessingParameterDefinition:
    """Define the parameter for a cloud that nobody has classified."""
    return helped(
        CloudParameter("INPUT", "Point cloud (layer, file or folder)"),
        "A loaded point cloud layer, or the path of a LAS, LAZ or COPC file, of a folder of such files, or of a "
        "virtual point cloud (.vpc). It needs no classes.",
    )


def classify() -> QgsProcessingParameterDefinition:
    """Define whether the rail points are to be found first."""
    return helped(
        QgsProcessingParameterBoolean("CLASSIFY", "Find the rail points of a raw cloud", defaultValue=False),
        "For clouds that nobody has classified: finds the rail points first, as Classify Rail Points does. The "
        "rail classes are ignored.",
    )


def guide() -> QgsProcessingParameterDefinition:
    """Define the lines along which rails are searched."""
    return advanced(
        QgsProcessingParameterFeatureSource("GUIDE", "Guide", [LINE], optional=True),
        "Lines along the tracks, from a map such as OpenStreetMap or drawn by hand. Rails are searched near them "
        "only. Lines in another coordinate system are transformed.",
    )


def airborne_cloud() -> Definitions:
    """Define the parameters for an airborne cloud."""
    return (
        helped(
            CloudParameter("INPUT", "Airborne point cloud (layer, file or folder)"),
            "A loaded point cloud layer, or the path of a LAS, LAZ or COPC file, of a folder of such files, or of "
            "a virtual point cloud (.vpc).",
        ),
        advanced(
            QgsProcessingParameterString(
                "CLASSES", "Classes", defaultValue=",".join(map(str, AIRBORNE_CLASSES)), optional=True
            ),
            "Classes of the points to use: by default unclassified and ground. Empty uses all but noise.",
        ),
    )


def tracks_meant() -> QgsProcessingParameterDefinition:
    """Define the lines that say which tracks are meant."""
    return helped(
        QgsProcessingParameterFeatureSource("GUIDE", "Guide", [LINE], optional=True),
        "One line for each track of the railway, such as railway=rail of OpenStreetMap, up to 3 m off. Give every "
        "track its guide: they are fitted together. Leave empty to have guides proposed.",
    )


def seeds() -> Definitions:
    """Define the places from which rails are followed."""
    return (
        helped(
            QgsProcessingParameterFeatureSource("SEEDS", "Seeds", [POINT, LINE], optional=True),
            "Points on railheads, or lines along them, one for each rail or track to follow. In another coordinate "
            "system they are transformed. The map tool Grow Rails makes such a layer.",
        ),
        helped(
            QgsProcessingParameterPoint("SEED", "Seed on the map", optional=True),
            "A single place on a railhead, picked on the map, besides the layer or instead of it.",
        ),
    )


def seeds_in_raw() -> QgsProcessingParameterDefinition:
    """Define the places in a raw cloud from which rails grow that are to be extracted."""
    return advanced(
        QgsProcessingParameterFeatureSource("SEEDS", "Seeds in a raw cloud", [POINT, LINE], optional=True),
        "Points on railheads, or lines along them: only the rails that grow from these are extracted, as Grow Rail "
        "Points from Seeds follows them. The rail classes are ignored.",
    )


def merge_classes() -> QgsProcessingParameterDefinition:
    """Define whether the rail classes are to be taken for one."""
    return advanced(
        QgsProcessingParameterBoolean("MERGE_CLASSES", "Take all rail classes for one", defaultValue=False),
        "For tracks whose rails, or parts of rails, are of different classes. The results have the first class.",
    )


def raster() -> QgsProcessingParameterDefinition:
    """Define the parameter for a rail raster."""
    return helped(
        QgsProcessingParameterRasterLayer("INPUT", "Rail raster"),
        "One band per class, with 1 where there is rail, as from Rasterize Rail Points. North up, square cells.",
    )


def points() -> QgsProcessingParameterDefinition:
    """Define the parameter for the points that give lines their heights."""
    return helped(
        CloudParameter("POINTS", "Point cloud (layer, file or folder)", optional=True),
        "The cloud from which the raster was made: it moves the lines onto the railheads and gives them heights.",
    )


def rails() -> QgsProcessingParameterDefinition:
    """Define the parameter for the rails."""
    return helped(
        QgsProcessingParameterFeatureSource("INPUT", "Rails", [LINE]),
        "Lines of railheads, from Vectorize Rails or drawn by hand.",
    )


def centerlines() -> QgsProcessingParameterDefinition:
    """Define the parameter for the track centerlines."""
    return helped(
        QgsProcessingParameterFeatureSource("INPUT", "Track centerlines", [LINE]),
        "Lines midway between rails, from Build Track Centerlines or drawn by hand. Chainage is measured along them.",
    )


def rails_of_tracks() -> QgsProcessingParameterDefinition:
    """Define the parameter for the rails of the centerlines."""
    return helped(
        QgsProcessingParameterFeatureSource("RAILS", "Rails", [LINE]),
        "The rails of these tracks: those named in left_ids and right_ids, otherwise the nearest.",
    )


def points_of_rails() -> QgsProcessingParameterDefinition:
    """Define the parameter for the points that support the rails."""
    return helped(
        CloudParameter("POINTS", "Point cloud (layer, file or folder)", optional=True),
        "The cloud from which the rails were extracted: it gives heights, sigma_mm and points for each station.",
    )


def elements() -> Definitions:
    """Define the parameters for an element table."""
    return (
        helped(
            QgsProcessingParameterFeatureSource("INPUT", "Elements", [TABLE]),
            "Element table of Fit Alignment or Import Alignment; it may be edited. Its geometries are not used.",
        ),
        advanced(
            QgsProcessingParameterCrs("CRS", "CRS of a table without one", optional=True),
            "Projected coordinate system in metres for a table without geometries; other tables keep their own.",
        ),
    )


def tracks_beside_design() -> QgsProcessingParameterDefinition:
    """Define the measured tracks that are compared with a design."""
    return helped(
        QgsProcessingParameterFeatureSource("TRACKS", "Measured tracks", [LINE], optional=True),
        "Centerlines that lie along the alignments, for deviations and report; each is compared with the alignment "
        "beside it, up to 2 m away.",
    )


def cant_beside_design() -> Definitions:
    """Define the layers from which the cant of measured tracks is known, where it is compared with a design."""
    return (
        advanced(
            QgsProcessingParameterFeatureSource("QUALITY", "Track geometry", [POINT], optional=True),
            "Points of Extract Rails or Measure Track Geometry for these tracks, with the cant.",
        ),
        advanced(
            QgsProcessingParameterFeatureSource("RAILS", "Rails", [LINE], optional=True),
            "3D lines of both rails, for the cant where there is no track geometry.",
        ),
    )


def landxml() -> Definitions:
    """Define the parameters for a LandXML file."""
    behaviour = QgsProcessingParameterFile.Behavior.File
    kinds = "LandXML files (*.xml *.landxml);;All files (*)"
    return (
        helped(
            QgsProcessingParameterFile("INPUT", "LandXML file", behaviour, fileFilter=kinds),
            "LandXML 1.0 to 1.2 in metres, with alignments of lines, arcs and clothoids.",
        ),
        advanced(
            QgsProcessingParameterCrs("CRS", "CRS of a file without one", optional=True),
            "Projected coordinate system in metres for a file that does not state one; other files keep their own.",
        ),
        advanced(
            QgsProcessingParameterBoolean("EAST_FIRST", "Points are written easting first", defaultValue=False),
            "For files that, against the format, write the easting of points before their northing. All curves of "
            "such a file turn to the other side than it states.",
        ),
    )


def surveys() -> Definitions:
    """Define the lines that are compared, and the rails of their tracks."""
    rails = "For centerlines: the rails of these tracks, for differences of gauge and cant."
    return (
        helped(
            QgsProcessingParameterFeatureSource("REFERENCE", "Reference", [LINE]),
            "Rails or centerlines of the earlier survey, of the design, or of a control measurement.",
        ),
        helped(
            QgsProcessingParameterFeatureSource("INPUT", "Lines to compare", [LINE]),
            "The same kind of lines of the later survey, in the same coordinate system.",
        ),
        advanced(
            QgsProcessingParameterFeatureSource("REFERENCE_RAILS", "Rails of the reference", [LINE], optional=True),
            rails,
        ),
        advanced(
            QgsProcessingParameterFeatureSource("RAILS", "Rails to compare", [LINE], optional=True),
            rails,
        ),
    )


def places() -> QgsProcessingParameterDefinition:
    """Define the layer whose features are to get kilometres."""
    return helped(
        QgsProcessingParameterFeatureSource("INPUT", "Layer", [ANY]),
        "Points, lines or polygons. A line counts where it is half way, a polygon at a place inside.",
    )


def axis(optional: bool) -> Definitions:
    """Define the axis and what states its kilometres: the line, its start and posts in sight unless it is optional."""
    show = advanced if optional else helped
    return (
        show(
            QgsProcessingParameterFeatureSource("AXIS", "Axis", [LINE], optional=optional),
            "Line that carries the kilometres: with M values in kilometres or metres, or with the fields below. In "
            "another coordinate system it is transformed.",
        ),
        show(
            number("START_KM", "Start of the axis [km]", None, KM.low, KM.high, optional=True, decimals=6),
            "Kilometre at the first vertex of the axis, for an axis that is a single line. It overrides M values.",
        ),
        advanced(
            choice("DIRECTION", "Kilometres along the axis", DIRECTIONS, INCREASING),
            "Whether kilometres increase or decrease from the start of the axis; used with its start kilometre.",
        ),
        *_posts(show),
    )


def _posts(show: Callable[..., QgsProcessingParameterDefinition]) -> Definitions:
    """Define what else states kilometres, and how they are written; `show` shows the posts."""
    posts = QgsProcessingParameterFeatureSource("POSTS", "Kilometre posts", [POINT], optional=True)
    kinds = QgsProcessingParameterField.DataType
    field = QgsProcessingParameterField(
        "POST_FIELD", "Field of the posts with the kilometre", None, "POSTS", kinds.Any, False, True
    )
    jumps = QgsProcessingParameterFeatureSource("JUMPS", "Jumps of the kilometres", [TABLE], optional=True)
    return (
        show(
            posts,
            "Points of kilometre or hectometre posts up to 50 m beside the axis. Kilometres are interpolated "
            "between them. They override the start and M values.",
        ),
        advanced(field, "Numbers, or texts such as 12.3+45. Empty means the first of km, kilometre, km_text, station."),
        advanced(
            jumps,
            "Table with the fields km_back, the kilometre before each jump, and km_ahead, the one behind it, in "
            "the order of increasing kilometres.",
        ),
        advanced(
            choice("FORMAT", "Kilometres as text", tuple(NOTATIONS), HECTOMETRES),
            "HECTOMETRES writes 12.3+45.67, KILOMETRES 12+345.67, GERMAN 12,3 + 46, and MILES 7 mi 1181.39 yd, in "
            "miles and yards.",
        ),
    )


def tracks_to_fit() -> QgsProcessingParameterDefinition:
    """Define the parameter for the tracks whose design is wanted."""
    return helped(
        QgsProcessingParameterFeatureSource("INPUT", "Track centerlines", [LINE]),
        "3D lines of tracks, such as the centerlines of Extract Rails. A field track_id numbers them.",
    )


def cant_of_tracks() -> Definitions:
    """Define the layers from which the cant of tracks is known."""
    return (
        helped(
            QgsProcessingParameterFeatureSource("QUALITY", "Track geometry", [POINT], optional=True),
            "Points of Extract Rails or Measure Track Geometry for these tracks: their cant gives elements, and "
            "sections without rail points do not count.",
        ),
        advanced(
            QgsProcessingParameterFeatureSource("RAILS", "Rails", [LINE], optional=True),
            "3D lines of both rails, for the cant where there is no track geometry.",
        ),
    )


def fixed() -> QgsProcessingParameterDefinition:
    """Define the parameter for a corrected table of elements."""
    return advanced(
        QgsProcessingParameterFeatureSource("FIXED", "Corrected elements", [TABLE], optional=True),
        "Elements of an earlier run that you have corrected. Their types are held, and radii and starts that you "
        "changed; the rest is fitted again.",
    )
