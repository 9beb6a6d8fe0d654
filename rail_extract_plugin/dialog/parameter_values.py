"""The values of an algorithm's parameters, read from QGIS in the types that the core expects."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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

from ...core.disk import Destination
from ...core.errors import ParameterError, RailExtractError, RasterError
from ...core.jobs import declaration as kinds
from ...core.jobs.clouds import Bounds, CloudSource, checked_crs
from ...core.jobs.declaration import Job
from ...core.jobs.shared import DECREASING
from ...core.jobs.values import Rows, Values
from ..reading.clouds import cloud_source, points_folder
from ..setup.interpreter import known_interpreter
from ..systems import prepare_system, system
from .passwords import masked

if TYPE_CHECKING:
    import numpy as np

    from ...core.airborne.survey import Guide
    from ...core.clouds.mask import Mask
    from ...core.files.rail_rasters import RasterSource
    from ...core.jobs.lines import Lines
    from ...core.jobs.places import Places
    from ...core.kilometres.axes import PlacedAxes
    from ...core.progress import Progress
    from ...core.run.loop import Runner

TYPES_WITHOUT_LINES = (
    QgsWkbTypes.GeometryType.PointGeometry,
    QgsWkbTypes.GeometryType.PolygonGeometry,
    QgsWkbTypes.GeometryType.NullGeometry,
)
"""Types of layers without lines; a layer of unknown type may have lines."""


class ParameterValues(Values):
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
        self.job: Job = algorithm.JOB
        self._opened: dict[str, Any] = {}
        self._command = ""

    def __getitem__(self, name: str) -> Any:
        """Return the value of a parameter, by its kind; None if it is empty, and the WKT of a coordinate system."""
        one = next(one for one in self.job.parameters if one.name == name)
        if isinstance(one, kinds.Number):
            number = self.optional_number(name) if one.optional else self.number(name)
            return int(number) if one.whole and number is not None else number
        return READERS[type(one)](self, one)

    @property
    def command(self) -> str:
        """What repeats the run, without passwords."""
        self._command = self._command or masked(self.algorithm.asPythonCommand(self.parameters, self.context))
        return self._command

    def follow(self, prepared: ParameterValues) -> None:
        """Take over what was read in the main thread."""
        self._opened, self._command = prepared._opened, prepared.command

    def open_sources(self) -> None:
        """Find the clouds and open the layers, in the main thread.

        Raises
        ------
        RailExtractError
            One can't be read, has no lines where lines are needed, or has them in degrees.
        """
        for one in self.job.parameters:
            if isinstance(one, kinds.Cloud) and self.filled(one.name):
                self.cloud(one.name)
            elif isinstance(one, kinds.LayerInput) and not one.transformed and self.filled(one.name):
                readers = {kinds.LINE: self._lines_source, kinds.PLACES: self._places_source}
                read = self.table if len(one.kinds) > 1 else readers.get(one.kinds[0], self.table)
                self._opened[one.name] = read(one.name)

    def title(self, name: str) -> str:
        """Return the name of the layer that was given for an input, to show to users; empty without one."""
        return self._opened[name].sourceName() if name in self._opened else ""

    def prepare(self, crs_wkt: str | None) -> None:
        """Build the coordinate system of the results in this thread, which is the main one."""
        prepare_system(crs_wkt)

    def path(self, name: str) -> Path:
        """Return the file that an output names; QGIS chooses that of a temporary one during the run."""
        return Path(self.output_file(name))

    def destination(self, name: str) -> Destination:
        """Return the file of an output that is wanted."""
        return self.algorithm.destinations.get(name) or Destination.at(self.path(name))

    def system(self, name: str) -> str | None:
        """Return the coordinate system of a layer as WKT; None if it has none."""
        from ..reading.line_layers import wkt_of

        return wkt_of(self._once(name, lambda: self._line_source(name)).sourceCrs()) or None

    def rows(self, name: str, progress: Progress) -> Rows:
        """Read the fields of a layer."""
        from ..reading.line_layers import rows_of

        return rows_of(self._opened[name], progress)

    def lines(self, name: str, progress: Progress) -> Lines:
        """Read the lines of a layer."""
        from ..reading.line_layers import read_lines

        return read_lines(self._opened[name], progress, name)

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

    def raster(self, name: str) -> RasterSource:
        """Return a rail raster, whose header is read in the main thread."""
        return self._once(name, lambda: self._raster(name))

    def _raster(self, name: str) -> RasterSource:
        from ...core.files.rail_rasters import RasterSource
        from ..reading.rasters import open_with_gdal

        layer = self.algorithm.parameterAsRasterLayer(self.parameters, name, self.context)
        if layer is None:
            raise RasterError(f"{name} is not a readable raster: give the output of Rasterize Rail Points.")
        source = RasterSource(Path(layer.source()), open_with_gdal)
        prepare_system(source.header.frame.crs_wkt)
        return source

    def _lines_source(self, name: str) -> QgsProcessingFeatureSource:
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

    def axes(self, crs_wkt: str | None) -> PlacedAxes:
        """Read AXIS and what states its kilometres, in a coordinate system."""
        return self._once("kilometres", lambda: self._axes(system(crs_wkt)))

    def places(self, name: str, plane: str | None, progress: Progress) -> Places:
        """Read the features of a layer of any kind, in the plane of the axes."""
        from ..reading.places import read_places

        return read_places(self._opened[name], system(plane), self.context, name, progress)

    def _axes(self, crs: QgsCoordinateReferenceSystem) -> PlacedAxes:
        """Read AXIS and what states its kilometres, in a coordinate system.

        Raises
        ------
        RailExtractError
            They can't be transformed, state no kilometres or contradict each other.
        """
        from ...core.kilometres.axes import Start
        from ..reading.axes import AxisSources, read_axes

        start_km = self.optional_number("START_KM")
        start = None if start_km is None else Start(start_km, self.choice("DIRECTION") == DECREASING)
        posts, jumps = (self.table(name) if self.filled(name) else None for name in ("POSTS", "JUMPS"))
        sources = AxisSources(self._line_source("AXIS"), start, posts, self.text("POST_FIELD"), jumps)
        return read_axes(sources, crs, self.choice("FORMAT"), self.context)

    def _places_source(self, name: str) -> QgsProcessingFeatureSource:
        """Return a layer with geometries of any kind."""
        source = self.table(name)
        if QgsWkbTypes.geometryType(source.wkbType()) == QgsWkbTypes.GeometryType.NullGeometry:
            from ...core.jobs.places import without_places

            raise without_places(name)
        return source

    def table(self, name: str) -> QgsProcessingFeatureSource:
        """Return a layer or a table."""
        source = self.algorithm.parameterAsSource(self.parameters, name, self.context)
        if source is None:
            raise RailExtractError(f"{name} is not a readable layer: choose another one.")
        return source

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
        return self["LEAVE_OUT"] if self.has("LEAVE_OUT") else ()

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

    def cloud(self, name: str = "INPUT") -> CloudSource:
        """Return the files of a cloud; the parameter CRS, if any, applies to files that state no coordinate system."""
        if name not in self._opened:
            source = cloud_source(self.parameters.get(name), self.context)
            crs = self.projected_crs()
            source = replace(source, crs_wkt=crs.toWkt()) if crs.isValid() else source
            prepare_system(checked_crs(source))
            self._opened[name] = replace(source, mask=self._mask(source), leave_out=self._left_out())
        return self._opened[name]

    def scratch(self) -> AbstractContextManager[Path]:
        """Provide a folder for the points of a run."""
        return points_folder()

    def lines_along(self, name: str, crs_wkt: str | None) -> Sequence[np.ndarray]:
        """Read lines that show places along tracks, (k, 2) each, in a coordinate system."""
        from ..reading.line_layers import read_guide

        return self._once(name, lambda: read_guide(self._line_source(name), system(crs_wkt), self.context))

    def guides(self, name: str, crs_wkt: str | None) -> Sequence[Guide]:
        """Read such lines with what they state of their tracks."""
        from ..reading.line_layers import read_tracks_meant

        return self._once(name, lambda: read_tracks_meant(self._line_source(name), system(crs_wkt), self.context))

    def seeds(self, crs_wkt: str | None) -> Sequence[np.ndarray]:
        """Read SEEDS and SEED in a coordinate system: points, (1, 2), and lines, (k, 2)."""
        return self._once("SEEDS", lambda: self._seeds(system(crs_wkt)))

    def _seeds(self, crs: QgsCoordinateReferenceSystem) -> list[np.ndarray]:
        from ..reading.line_layers import read_place, read_seeds

        found: list[np.ndarray] = []
        if self.filled("SEEDS"):
            source = self.algorithm.parameterAsSource(self.parameters, "SEEDS", self.context)
            if source is None:
                raise RailExtractError("SEEDS is not a readable layer: give a layer of points or lines.")
            found += read_seeds(source, crs, self.context)
        if self.filled("SEED"):
            place = self.algorithm.parameterAsPoint(self.parameters, "SEED", self.context)
            own = self.algorithm.parameterAsPointCrs(self.parameters, "SEED", self.context)
            found.append(read_place(place, own, crs, self.context))
        return found

    def _once(self, name: str, read: Callable[[], Any]) -> Any:
        """Return what was read in the main thread."""
        if name not in self._opened:
            self._opened[name] = read()
        return self._opened[name]

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

    def extent(self, crs_wkt: str | None) -> Bounds | None:
        """Read EXTENT in a coordinate system: west, south, east and north limits.

        Raises
        ------
        ParameterError
            The extent has no area, or an infinite one.
        """
        if not self.filled("EXTENT"):
            return None
        extent = self.algorithm.parameterAsExtent(self.parameters, "EXTENT", self.context, system(crs_wkt))
        if extent.isEmpty() or not extent.isFinite():
            raise ParameterError(
                "EXTENT has no area, or an infinite one: give a rectangle as xmin,xmax,ymin,ymax, or leave it empty."
            )
        return extent.xMinimum(), extent.yMinimum(), extent.xMaximum(), extent.yMaximum()


def destination_text(value: Any, context: QgsProcessingContext) -> str:
    """Return a destination as a user writes it; empty if there is none."""
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        value = value.sink
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    return value or ""


def _chosen(values: ParameterValues, one: kinds.Choice) -> Any:
    """Read a choice: one id, several, or the place of one."""
    algorithm, given = values.algorithm, (values.parameters, one.name, values.context)
    if one.numbered:
        return algorithm.parameterAsEnum(*given)
    return tuple(algorithm.parameterAsEnumStrings(*given)) if one.several else values.choice(one.name)


def _system(values: ParameterValues, one: kinds.System) -> str | None:
    from ..reading.line_layers import wkt_of

    return wkt_of(values.projected_crs()) or None


READERS: dict[type, Callable[[ParameterValues, Any], Any]] = {
    kinds.Flag: lambda values, one: values.flag(one.name),
    kinds.Choice: _chosen,
    kinds.Text: lambda values, one: values.text(one.name),
    kinds.FieldInput: lambda values, one: values.text(one.name),
    kinds.FileInput: lambda values, one: values.file(one.name),
    kinds.System: _system,
}
"""Functions that read a value, by the kind of the parameter."""
