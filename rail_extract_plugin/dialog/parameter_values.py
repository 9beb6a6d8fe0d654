"""The values of an algorithm's parameters, read from QGIS in the types that the core expects."""

from __future__ import annotations

import math
import re
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingFeatureSource,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
    QgsWkbTypes,
)

from ...core.errors import ParameterError, RailExtractError, RasterError
from ...core.parameters import AirborneParameters, GrowParameters, Parameters
from ...core.standards import (
    CUSTOM,
    DEFAULT,
    DETECT,
    LAST_CLASS,
    Gauge,
    RailStandard,
    is_class,
    read_gauges,
    resolve,
)
from ..reading.clouds import CloudSource, checked_crs, cloud_source
from ..setup.interpreter import known_interpreter
from ..systems import prepare_system, system
from .passwords import masked

if TYPE_CHECKING:
    import numpy as np

    from ...core.airborne.survey import Guide
    from ...core.alignment.placed_axes import PlacedAxes
    from ...core.clouds.mask import Mask
    from ...core.output.raster_file import RasterHeader
    from ...core.run.loop import Runner

INCREASING, DECREASING = DIRECTIONS = ("INCREASING", "DECREASING")
"""Whether kilometres increase from the first vertex of an axis."""

NUMBERS = {
    "SMOOTHING_XY": "smoothing_xy_m",
    "SMOOTHING_Z": "smoothing_z_m",
    "TOLERANCE_XY": "tolerance_xy_m",
    "TOLERANCE_Z": "tolerance_z_m",
    "CROWN_RADIUS": "crown_radius_m",
    "MAX_GAP": "max_gap_m",
    "GAP_ANGLE": "gap_angle_deg",
    "SIMPLIFY_XY": "simplify_xy_m",
    "SIMPLIFY_Z": "simplify_z_m",
    "MIN_LENGTH": "min_length_m",
    "CENTERLINE_TOLERANCE": "centerline_tolerance_m",
}
"""Attribute of the core's `Parameters` for each number of the interface."""

GROWTH = {
    "SEARCH": "search_m",
    "THICKNESS": "thickness_m",
    "WINDOW": "window_m",
    "MIN_HEIGHT": "min_height_m",
    "TOLERANCE_Z": "tolerance_z_m",
    "MAX_LENGTH": "max_length_m",
}
"""The same for `GrowParameters`; TOLERANCE_Z has another default there."""

AIRBORNE = {"REACH": "reach_m", "FOOTPRINT": "footprint_m", "RAIL_HEIGHT": "rail_height_m"}
"""The same for `AirborneParameters`."""

TYPES_WITHOUT_LINES = (
    QgsWkbTypes.GeometryType.PointGeometry,
    QgsWkbTypes.GeometryType.PolygonGeometry,
    QgsWkbTypes.GeometryType.NullGeometry,
)
"""Types of layers without lines; a layer of unknown type may have lines."""

CHOICES = {"ENGINE": "engine", "DEVICE": "device", "MODEL": "model", "STRIPS": "strips"}


class ParameterValues:
    """Values of the parameters of one run.

    Parameters
    ----------
    algorithm : QgsProcessingAlgorithm
    parameters : dict
        Values by name, as QGIS passes them.
    context : QgsProcessingContext

    Attributes
    ----------
    algorithm, parameters, context
        As given, for the functions that write outputs.
    """

    def __init__(
        self, algorithm: QgsProcessingAlgorithm, parameters: dict[str, Any], context: QgsProcessingContext
    ) -> None:
        self.algorithm, self.parameters, self.context = algorithm, parameters, context

    def number(self, name: str) -> float:
        """Read a number.

        Raises
        ------
        ParameterError
            The value is NaN, which QGIS accepts.
        """
        number = self.algorithm.parameterAsDouble(self.parameters, name, self.context)
        if math.isnan(number):
            raise ParameterError(f"{name} can't be nan: give a number.")
        return number

    def optional_number(self, name: str) -> float | None:
        """Read a number that may be left empty."""
        return self.number(name) if self.filled(name) else None

    def runner(self) -> AbstractContextManager[Runner]:
        """Provide the runner with as many processes as WORKERS asks for."""
        from ...core.run.processes import workers

        return workers(int(self.number("WORKERS")), known_interpreter)

    def flag(self, name: str) -> bool:
        """Read a choice of yes or no."""
        return self.algorithm.parameterAsBoolean(self.parameters, name, self.context)

    def text(self, name: str) -> str:
        """Read a text."""
        return self.algorithm.parameterAsString(self.parameters, name, self.context)

    def choice(self, name: str) -> str:
        """Read the static string of an enum."""
        return self.algorithm.parameterAsEnumString(self.parameters, name, self.context)

    def filled(self, name: str) -> bool:
        """Return whether a value was entered."""
        return self.parameters.get(name) not in (None, "", NULL)

    def file(self, name: str) -> Path | None:
        """Read a file that may be left empty."""
        given = self.algorithm.parameterAsFile(self.parameters, name, self.context)
        return Path(given) if given else None

    def wanted(self, name: str) -> bool:
        """Return whether an output is to be written; the batch dialog gives an empty definition for a skipped one."""
        return bool(destination_text(self.parameters.get(name), self.context))

    def output_file(self, name: str) -> str:
        """Return the file of an output; QGIS chooses the name of a temporary one during the run."""
        return self.algorithm.parameterAsFileOutput(self.parameters, name, self.context)

    def command(self) -> str:
        """Return the command that repeats the run, without passwords."""
        return masked(self.algorithm.asPythonCommand(self.parameters, self.context))

    def rails_only(self) -> bool:
        """Return whether CONTENT leaves out what is not on rails."""
        return self.algorithm.parameterAsEnum(self.parameters, "CONTENT", self.context) == 1

    def raster(self, name: str) -> tuple[Path, RasterHeader]:
        """Return the file of a raster and its header.

        Raises
        ------
        RasterError
            The value is not a rail raster in a file.
        """
        from ..reading.geotiff import read_header

        layer = self.algorithm.parameterAsRasterLayer(self.parameters, name, self.context)
        if layer is None:
            raise RasterError(f"{name} is not a readable raster: give the output of Rasterize Rail Points.")
        path = Path(layer.source())
        header = read_header(path)
        prepare_system(header.frame.crs_wkt)
        return path, header

    def lines(self, name: str) -> QgsProcessingFeatureSource:
        """Return a line layer.

        Raises
        ------
        RailExtractError
            There is no such layer, it is not a line layer, or it is in degrees.
        """
        from ..reading.line_layers import check_system, wkt_of

        source = self._line_source(name)
        check_system(source.sourceCrs())
        prepare_system(wkt_of(source.sourceCrs()))
        return source

    def guide(self, cloud: CloudSource) -> tuple[np.ndarray, ...]:
        """Read the lines of GUIDE, in the coordinate system of the cloud; none if it is empty.

        Raises
        ------
        RailExtractError
            The layer has no lines, or they can't be transformed; or ONLY_GUIDED is set without GUIDE.
        """
        from ..reading.line_layers import read_guide

        if not self.filled("GUIDE"):
            if self.flag("ONLY_GUIDED"):
                raise ParameterError("ONLY_GUIDED needs lines to compare tracks with: choose GUIDE.")
            return ()
        return read_guide(self._line_source("GUIDE"), system(checked_crs(cloud)), self.context)

    def tracks_meant(self, cloud: CloudSource) -> tuple[Guide, ...]:
        """Read the lines of GUIDE with what the layer states of them; none if it is empty.

        Raises
        ------
        RailExtractError
            The layer has no lines, or they can't be transformed.
        """
        from ..reading.line_layers import read_tracks_meant

        if not self.filled("GUIDE"):
            return ()
        return read_tracks_meant(self._line_source("GUIDE"), system(checked_crs(cloud)), self.context)

    def airborne(self, standard: RailStandard) -> AirborneParameters:
        """Read how tracks are looked for in an airborne cloud."""
        lengths = {field: self.number(name) for name, field in AIRBORNE.items()}
        return AirborneParameters(standard.gauge_m, standard.head_width_m, **lengths)

    def has_axis(self) -> bool:
        """Return whether AXIS is filled in.

        Raises
        ------
        ParameterError
            It is not, but what states its kilometres is.
        """
        lone = next((name for name in ("START_KM", "POSTS", "JUMPS") if self.filled(name)), None)
        if lone and not self.filled("AXIS"):
            raise ParameterError(f"{lone} needs the line that it applies to: choose AXIS.")
        return self.filled("AXIS")

    def axes(self, crs: QgsCoordinateReferenceSystem) -> PlacedAxes:
        """Read AXIS and what states its kilometres, in a coordinate system.

        Raises
        ------
        RailExtractError
            They can't be transformed, state no kilometres or contradict each other.
        """
        from ...core.alignment.stations import Start
        from ..reading.axes import AxisSources, read_axes

        start_km = self.optional_number("START_KM")
        start = None if start_km is None else Start(start_km, self.choice("DIRECTION") == DECREASING)
        posts, jumps = (self.table(name) if self.filled(name) else None for name in ("POSTS", "JUMPS"))
        sources = AxisSources(self._line_source("AXIS"), start, posts, self.text("POST_FIELD"), jumps)
        return read_axes(sources, crs, self.choice("FORMAT"), self.context)

    def axis_crs(self) -> QgsCoordinateReferenceSystem:
        """Return the coordinate system of AXIS."""
        return self._line_source("AXIS").sourceCrs()

    def table(self, name: str) -> QgsProcessingFeatureSource:
        """Return a layer or a table."""
        source = self.algorithm.parameterAsSource(self.parameters, name, self.context)
        if source is None:
            raise RailExtractError(f"{name} is not a readable layer: choose another one.")
        return source

    def seeds(self, cloud: CloudSource) -> tuple[np.ndarray, ...]:
        """Read SEEDS and SEED, in the coordinate system of the cloud.

        Raises
        ------
        RailExtractError
            There are none, or they can't be transformed.
        """
        from ..reading.line_layers import read_place, read_seeds

        if not self.filled("SEEDS") and not self.filled("SEED"):
            raise ParameterError("A rail is followed from seeds: choose a layer for SEEDS, or pick a point for SEED.")
        crs = system(checked_crs(cloud))
        found: tuple[np.ndarray, ...] = ()
        if self.filled("SEEDS"):
            source = self.algorithm.parameterAsSource(self.parameters, "SEEDS", self.context)
            if source is None:
                raise RailExtractError("SEEDS is not a readable layer: give a layer of points or lines.")
            found = read_seeds(source, crs, self.context)
        if self.filled("SEED"):
            place = self.algorithm.parameterAsPoint(self.parameters, "SEED", self.context)
            own = self.algorithm.parameterAsPointCrs(self.parameters, "SEED", self.context)
            found = (*found, read_place(place, own, crs, self.context))
        return found

    def growth(self) -> GrowParameters:
        """Read how rails are followed."""
        lengths = {field: self.number(name) for name, field in GROWTH.items()}
        return GrowParameters(both=self.flag("BOTH"), max_outliers=int(self.number("MAX_OUTLIERS")), **lengths)

    def _mask(self, cloud: CloudSource) -> Mask | None:
        """Read the polygons of MASK, in the coordinate system of the cloud.

        Raises
        ------
        RailExtractError
            The layer has no polygons, or they can't be transformed.
        """
        if not self.filled("MASK"):
            return None
        from ..reading.line_layers import read_mask

        source = self.algorithm.parameterAsSource(self.parameters, "MASK", self.context)
        if source is None:
            raise RailExtractError("MASK is not a readable layer: give a polygon layer.")
        return read_mask(source, system(checked_crs(cloud)), self.context)

    def _left_out(self) -> tuple[str, ...]:
        """Read LEAVE_OUT; nothing where an algorithm does not have it."""
        if not self._has("LEAVE_OUT"):
            return ()
        return tuple(self.algorithm.parameterAsEnumStrings(self.parameters, "LEAVE_OUT", self.context))

    def _line_source(self, name: str) -> QgsProcessingFeatureSource:
        """Return a layer that may have lines."""
        source = self.algorithm.parameterAsSource(self.parameters, name, self.context)
        if source is None:
            raise RailExtractError(f"{name} is not a readable layer: give a line layer.")
        kind = source.wkbType()
        if QgsWkbTypes.geometryType(kind) in TYPES_WITHOUT_LINES:
            raise RailExtractError(
                f"{name} has the geometry type {QgsWkbTypes.displayString(kind)}: give a line layer."
            )
        return source

    def cloud(self, name: str) -> CloudSource:
        """Return the files of a cloud; the parameter CRS, if any, applies to files that state no coordinate system."""
        source = cloud_source(self.parameters.get(name), self.context)
        crs = self.projected_crs()
        source = replace(source, crs_wkt=crs.toWkt()) if crs.isValid() else source
        prepare_system(checked_crs(source))
        return replace(source, mask=self._mask(source), leave_out=self._left_out())

    def projected_crs(self) -> QgsCoordinateReferenceSystem:
        """Return the coordinate system CRS, an invalid one if it is empty.

        Raises
        ------
        ParameterError
            It is not a coordinate system, or it is in degrees.
        """
        crs = self.algorithm.parameterAsCrs(self.parameters, "CRS", self.context)
        if self.filled("CRS") and not crs.isValid():
            raise ParameterError(f"CRS {self.parameters['CRS']} is not a coordinate system: choose one from the list.")
        if crs.isGeographic():
            raise ParameterError(
                f"CRS {crs.authid()} is in degrees, where lengths can't be measured: choose a projected one."
            )
        return crs

    def extent(self, crs: QgsCoordinateReferenceSystem) -> tuple[float, float, float, float] | None:
        """Read EXTENT in `crs`: west, south, east and north limits.

        Raises
        ------
        ParameterError
            The extent has no area, or an infinite one.
        """
        if not self.filled("EXTENT"):
            return None
        extent = self.algorithm.parameterAsExtent(self.parameters, "EXTENT", self.context, crs)
        if extent.isEmpty() or not extent.isFinite():
            raise ParameterError(
                "EXTENT has no area, or an infinite one: give a rectangle as xmin,xmax,ymin,ymax, or leave it empty."
            )
        return extent.xMinimum(), extent.yMinimum(), extent.xMaximum(), extent.yMaximum()

    def engine(self) -> str:
        """Read ENGINE, and check that it is installed and runs on DEVICE."""
        from ...core.frpdf.engine import choose_engine

        return choose_engine(self.choice("ENGINE"), self.choice("DEVICE"))

    def weights(self) -> Path | None:
        """Read METHOD and WEIGHTS: the weights of the network that finds rail points, or None for geometry.

        Raises
        ------
        ParameterError, ModelError
            They contradict each other, or can't be used.
        """
        from ...core.learned.model import weights_for

        return weights_for(self.choice("METHOD"), self.file("WEIGHTS"))

    def class_codes(self) -> tuple[int, ...]:
        """Read RAIL_CLASSES."""
        return class_numbers(self.text("RAIL_CLASSES"), "RAIL_CLASSES")

    def detects(self) -> bool:
        """Return whether the points are to tell the rail standard."""
        return self.choice("STANDARD") == DETECT

    def standard(self, detected: str | None = None) -> RailStandard:
        """Read STANDARD, or take the one that was detected; GAUGE and HEAD_WIDTH override its values."""
        name = detected or self.choice("STANDARD")
        return resolve(name, self.optional_number("GAUGE"), self.optional_number("HEAD_WIDTH"))

    def head_width_m(self) -> float:
        """Read HEAD_WIDTH, or the value of STANDARD."""
        head_width_mm = self.optional_number("HEAD_WIDTH")
        if head_width_mm is None and self.choice("STANDARD") == CUSTOM:
            raise ParameterError("STANDARD CUSTOM needs the railhead width, in millimetres: fill in HEAD_WIDTH.")
        return resolve(DEFAULT if head_width_mm else self.choice("STANDARD"), None, head_width_mm).head_width_m

    def other_gauges(self, standard: RailStandard) -> tuple[Gauge, ...]:
        """Read OTHER_GAUGES, and check that they can be distinguished from each other and from the standard's gauge."""
        own = self._has("CENTERLINE_TOLERANCE")
        tolerance_m = self.number("CENTERLINE_TOLERANCE") if own else Parameters.centerline_tolerance_m
        return read_gauges(self.text("OTHER_GAUGES"), "OTHER_GAUGES", standard, tolerance_m, own)[1:]

    def settings(self, standard: RailStandard, other_gauges: tuple[Gauge, ...] = ()) -> Parameters:
        """Return the algorithm's parameters for the core, with the core's defaults for all others."""
        given: dict[str, Any] = {}
        for name, field in NUMBERS.items():
            if self._has(name):
                optional = getattr(Parameters, field) is None
                given[field] = self.optional_number(name) if optional else self.number(name)
        given.update({field: self.choice(name) for name, field in CHOICES.items() if self._has(name)})
        if self._has("ITERATIONS"):
            given["passes"] = int(self.number("ITERATIONS"))
        return Parameters(standard.gauge_m, standard.head_width_m, **given).with_gauges(other_gauges)

    def _has(self, name: str) -> bool:
        return self.algorithm.parameterDefinition(name) is not None


def destination_text(value: Any, context: QgsProcessingContext) -> str:
    """Return a destination as a user writes it; empty if there is none."""
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        value = value.sink
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    return value or ""


def class_numbers(text: str, what: str) -> tuple[int, ...]:
    """Parse classes such as "10,11"; `what` is the name of the parameter, for the error.

    Raises
    ------
    ParameterError
        The text is not a list of classes, or is empty.
    """
    words = _words(text)
    if not words or not all(map(is_class, words)):
        raise ParameterError(f'{what} "{text}" must be whole numbers from 0 to {LAST_CLASS} such as 10 or 10,11.')
    return tuple(dict.fromkeys(int(word) for word in words))


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[;,\s]+", text) if word]
