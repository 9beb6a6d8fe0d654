"""The outputs of the algorithms: layers, files and numbers."""

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

from .definitions import ANY, LINE, POINT, advanced, helped

Numbers = tuple[QgsProcessingOutputNumber, ...]


def rails(name: str = "OUTPUT", optional: bool = False) -> QgsProcessingParameterDefinition:
    """Define the layer of rails."""
    text = "Lines along the top of the railheads, with length, support by points and standard error."
    return _layer(name, LINE, "Rails", text, optional=optional)


def centerlines(name: str = "OUTPUT", optional: bool = False) -> QgsProcessingParameterDefinition:
    """Define the layer of track centerlines."""
    text = "Lines midway between the two rails of each track, with gauge and cant."
    return _layer(name, LINE, "Track centerlines", text, optional=optional)


def quality(name: str = "OUTPUT") -> QgsProcessingParameterDefinition:
    """Define the layer of points along tracks."""
    text = "Points along each track with gauge, cant, twist, radius, gradient, standard error and support."
    return _layer(name, POINT, "Track geometry", text)


def _layer(
    name: str, kind: QgsProcessing.SourceType, label: str, text: str, optional: bool = True
) -> QgsProcessingParameterDefinition:
    """Define a layer with its help text; features may also be added to an existing one."""
    made = QgsProcessingParameterFeatureSink(name, label, kind, optional=optional)
    made.setSupportsAppend(True)
    return helped(made, text)


def airborne_centerlines() -> QgsProcessingParameterDefinition:
    """Define the layer of tracks seen in an airborne cloud."""
    text = "Lines in the middle of the tracks at the top of the rails, where they are seen, with standard errors."
    return _layer("CENTERLINES", LINE, "Track centerlines", text)


def on_demand(definition: QgsProcessingParameterDefinition) -> QgsProcessingParameterDefinition:
    """Leave an output out unless the user asks for it."""
    definition.setCreateByDefault(False)
    return definition


def further(definition: QgsProcessingParameterDefinition) -> QgsProcessingParameterDefinition:
    """Show an output in the section of further results, not in sight."""
    return advanced(definition, definition.help())


def airborne_stations() -> QgsProcessingParameterDefinition:
    """Define the layer of stations along guides."""
    text = (
        "A point every 10 m along each guide: whether the track is seen, or why not; bed, cant, radius, gradient "
        "and standard errors."
    )
    return _layer("STATIONS", POINT, "Stations", text)


def proposed_guides() -> QgsProcessingParameterDefinition:
    """Define the layer of guides for a cloud without any."""
    text = (
        "Only where GUIDE is empty: lines along which tracks seem to lie, with a score. Delete or move what is "
        "wrong, add what is missing, and run again with this layer as GUIDE."
    )
    return _layer("PROPOSED", LINE, "Proposed guides", text)


def airborne_figures() -> Numbers:
    """Define the figures about tracks seen in an airborne cloud."""
    return (
        *centerline_figures(),
        QgsProcessingOutputNumber("GUIDE_LENGTH", "Length of the guides [m]"),
        QgsProcessingOutputNumber("SEEN_LENGTH", "Length on which tracks are seen [m]"),
        QgsProcessingOutputNumber("DENSITY", "Points per square metre along the guides"),
        QgsProcessingOutputNumber("PROPOSED_LENGTH", "Length of the proposed guides [m]"),
    )


def differences() -> QgsProcessingParameterDefinition:
    """Define the layer of differences between two surveys."""
    text = "Points along the lines of the reference with the differences, and along lines that it does not have."
    return _layer("OUTPUT", POINT, "Differences", text)


def comparison_report() -> QgsProcessingParameterDefinition:
    """Define the report on a comparison."""
    return helped(_page(), "A web page with what has moved, the constant shift and the distribution.")


def comparison_figures() -> Numbers:
    """Define the figures about a comparison."""
    return (
        QgsProcessingOutputNumber("COMPARED_LENGTH", "Length on lines of both surveys [m]"),
        QgsProcessingOutputNumber("MOVED_LENGTH", "Length that has moved [m]"),
        QgsProcessingOutputNumber("MISSING_LENGTH", "Length of the reference without a line [m]"),
        QgsProcessingOutputNumber("EXTRA_LENGTH", "Length of lines that the reference does not have [m]"),
        QgsProcessingOutputNumber("ACROSS_RMS", "Differences across, root mean square [mm]"),
        QgsProcessingOutputNumber("HEIGHT_RMS", "Differences in height, root mean square [mm]"),
        QgsProcessingOutputNumber("SHIFT_EAST", "Constant shift east [mm]"),
        QgsProcessingOutputNumber("SHIFT_NORTH", "Constant shift north [mm]"),
        QgsProcessingOutputNumber("SHIFT_UP", "Constant shift up [mm]"),
    )


def stationed() -> QgsProcessingParameterDefinition:
    """Define the copy of a layer with kilometres."""
    text = "The features of the layer with all their fields, and with axis, kilometre, offset and side."
    return _layer("OUTPUT", ANY, "Layer with kilometres", text, optional=False)


def station_figures() -> Numbers:
    """Define the figures about places along an axis."""
    return (
        QgsProcessingOutputNumber("PLACE_COUNT", "Number of features with a kilometre"),
        QgsProcessingOutputNumber("BEYOND_COUNT", "Number of features without a kilometre"),
        QgsProcessingOutputNumber("AMBIGUOUS_COUNT", "Number of features with an ambiguous kilometre"),
    )


def findings() -> QgsProcessingParameterDefinition:
    """Define the layer of places to look at."""
    text = "Places to look at, with the reason, the most harmful first: the table of the report as lines to review."
    return _layer("FINDINGS", LINE, "Findings", text)


def stops() -> QgsProcessingParameterDefinition:
    """Define the layer of places where rails were not followed further."""
    return _layer("STOPS", POINT, "Stops", "Points where a rail is not followed further, with the reason.", True)


def elements() -> QgsProcessingParameterDefinition:
    """Define the element table."""
    text = "The element table: a line for each element in plan, in height and of cant, with its figures."
    return _layer("ELEMENTS", LINE, "Elements", text)


def deviations() -> QgsProcessingParameterDefinition:
    """Define the layer of deviations from a design."""
    text = "Points along the design, one per metre, with slew, lift and difference of cant: measured minus design."
    return _layer("DEVIATIONS", POINT, "Deviations", text)


def alignment_report() -> QgsProcessingParameterDefinition:
    """Define the report on alignments."""
    return helped(
        _page(),
        "A web page with a diagram of each track: curvature, cant, gradient, elements, slews and lifts, to print.",
    )


def axes() -> QgsProcessingParameterDefinition:
    """Define the layer of alignments as lines."""
    text = "A line for each alignment, less than a millimetre off the exact curve, with kilometres as M values."
    return _layer("AXIS", LINE, "Axes", text)


def alignment_file() -> QgsProcessingParameterDefinition:
    """Define the file for design software."""
    kinds = "LandXML files (*.xml);;IFC files (*.ifc);;DXF files (*.dxf)"
    return helped(
        QgsProcessingParameterFileDestination("OUTPUT", "File for design software", kinds),
        "The name decides the format: .xml is LandXML 1.2, .ifc is IFC 4.3, .dxf is DXF of release 12.",
    )


def alignment_figures() -> Numbers:
    """Define the figures about alignments."""
    return (
        QgsProcessingOutputNumber("ALIGNMENT_COUNT", "Number of alignments"),
        QgsProcessingOutputNumber("ELEMENT_COUNT", "Number of elements"),
    )


def cleaned() -> QgsProcessingParameterDefinition:
    """Define the raster that the network returns."""
    return helped(
        QgsProcessingParameterRasterDestination("CLEANED", "Cleaned rail raster", optional=True),
        "The raster after the network, as from Clean Rail Raster.",
    )


def classified(name: str = "OUTPUT") -> QgsProcessingParameterDefinition:
    """Define the classified copy of a cloud."""
    kinds = "LAZ files (*.laz);;LAS files (*.las);;Virtual point clouds (*.vpc)"
    return helped(
        QgsProcessingParameterFileDestination(name, "Classified point cloud", kinds),
        "A LAZ or LAS file. For a folder of tiles or a virtual point cloud, a virtual point cloud (.vpc) and, next "
        "to it, a folder of the same name with the tiles.",
    )


def classified_figures() -> Numbers:
    """Define the figures about classified points."""
    return (
        QgsProcessingOutputNumber("POINT_COUNT", "Number of points in the cloud"),
        QgsProcessingOutputNumber("RAIL_POINTS", "Number of points on rails"),
        QgsProcessingOutputNumber("PAIRED_LENGTH", "Length of the rails with a partner [m]"),
        QgsProcessingOutputNumber("SINGLE_LENGTH", "Length of the rails without a partner [m]"),
        QgsProcessingOutputNumber("CELLS_PER_M", "Cells with points per metre of rail"),
    )


def report() -> QgsProcessingParameterDefinition:
    """Define the report."""
    return helped(_page(), "A web page with an assessment of the result, a map, and plots of each track.")


def weights() -> QgsProcessingParameterDefinition:
    """Define the weights of a trained classifier."""
    return helped(
        QgsProcessingParameterFileDestination("WEIGHTS", "Weights of the classifier", "Weights (*.npz)"),
        "The trained classifier. Until the training is complete, a folder next to it keeps what was "
        "learned, and a run with the same name continues.",
    )


def card() -> QgsProcessingParameterDefinition:
    """Define the card of a trained classifier."""
    return helped(
        QgsProcessingParameterFileDestination("CARD", "Card", "Web pages (*.html)", optional=True),
        "A web page with recall and precision by tile, the course of the training, and its settings.",
    )


def training_figures() -> Numbers:
    """Define the figures about a trained classifier."""
    return (
        QgsProcessingOutputNumber("RECALL", "Share of the rail points kept back that are found"),
        QgsProcessingOutputNumber("PRECISION", "Share of the points found that are rail points"),
        QgsProcessingOutputNumber("STEPS", "Steps of the training"),
    )


def check_report() -> QgsProcessingParameterDefinition:
    """Define the report on the installation."""
    return helped(_page(), "A web page with the result, to be attached to bug reports.")


def _page() -> QgsProcessingParameterDefinition:
    return QgsProcessingParameterFileDestination("REPORT", "Report", "Web pages (*.html)", optional=True)


def rail_figures() -> Numbers:
    """Define the figures about rails."""
    return (
        QgsProcessingOutputNumber("RAIL_COUNT", "Number of rails"),
        QgsProcessingOutputNumber("RAIL_LENGTH", "Length of the rails [m]"),
    )


def centerline_figures() -> Numbers:
    """Define the figures about tracks."""
    return (
        QgsProcessingOutputNumber("CENTERLINE_COUNT", "Number of track centerlines"),
        QgsProcessingOutputNumber("CENTERLINE_LENGTH", "Length of the track centerlines [m]"),
    )


def quality_figures() -> Numbers:
    """Define the figures about the measured track geometry."""
    return (
        QgsProcessingOutputNumber("STATION_COUNT", "Number of measured stations"),
        QgsProcessingOutputNumber("SIGMA", "Standard error of the centerlines, root mean square [mm]"),
        QgsProcessingOutputNumber("BRIDGED_LENGTH", "Length of track where a rail has no points [m]"),
    )


def engine() -> QgsProcessingOutputString:
    """Define the name of the engine."""
    return QgsProcessingOutputString("ENGINE_USED", "Engine that ran the network")


def fit_figures() -> Numbers:
    """Define the figures about fitted elements."""
    return (
        QgsProcessingOutputNumber("ELEMENT_COUNT", "Number of elements"),
        QgsProcessingOutputNumber("RMS", "Root mean square of the slews [mm]"),
    )
