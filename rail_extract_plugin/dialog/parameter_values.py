"""The values of an algorithm's parameters, read from QGIS in the types that the core expects."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
    QgsWkbTypes,
)

from ...core.disk import Destination
from ...core.errors import ParameterError, RailExtractError, RasterError
from ...core.jobs import declaration as kinds
from ...core.jobs.clouds import Bounds, CloudSource, checked_crs
from ...core.jobs.values import Job, Values
from ...core.progress import SILENT
from ..reading.clouds import cloud_source, points_folder
from ..setup.interpreter import known_interpreter
from ..systems import prepare_system, system
from .passwords import masked

if TYPE_CHECKING:
    import numpy as np

    from ...core.files.rail_rasters import RasterSource
    from ...core.run.tasks import Runner
    from ..reading.layers import LayerSource

TYPES_WITHOUT_LINES = (
    QgsWkbTypes.GeometryType.PointGeometry,
    QgsWkbTypes.GeometryType.PolygonGeometry,
    QgsWkbTypes.GeometryType.NullGeometry,
)
"""Types of layers without lines; a layer of unknown type may have lines."""


class ParameterValues(Values):
    """Values of the parameters of one run, by name, as QGIS passes them.

    Algorithm, parameters and context are kept for the functions that write outputs.
    """

    def __init__(
        self, algorithm: QgsProcessingAlgorithm, parameters: dict[str, Any], context: QgsProcessingContext
    ) -> None:
        self.algorithm, self.parameters, self.context = algorithm, parameters, context
        self.job: Job = algorithm.JOB
        self._read: dict[str, Any] = {}
        self._command = ""

    def __getitem__(self, name: str) -> Any:
        """Return the value of a parameter, by its kind; None if it is empty, and the WKT of a coordinate system."""
        one = next(one for one in self.job.parameters if one.name == name)
        return READERS[type(one)](self, one)

    def read_as(self, kind: str, name: str) -> Any:
        """Return a value as QGIS reads it for a kind of parameters."""
        return getattr(self.algorithm, f"parameterAs{kind}")(self.parameters, name, self.context)

    @property
    def command(self) -> str:
        """What repeats the run, without passwords."""
        self._command = self._command or masked(self.algorithm.asPythonCommand(self.parameters, self.context))
        return self._command

    def follow(self, prepared: ParameterValues) -> None:
        """Take over what was read in the main thread."""
        self._read, self._command = prepared._read, prepared.command

    def open_sources(self) -> None:
        """Find the clouds and open the layers, in the main thread.

        Raises RailExtractError if one can't be read, has no lines where lines are needed, or has them in degrees.
        """
        for one in self.job.parameters:
            if isinstance(one, kinds.Cloud) and self.filled(one.name):
                self.cloud(one.name)
            elif isinstance(one, kinds.LayerInput) and not one.transformed and self.filled(one.name):
                self.source(one.name)

    def title(self, name: str) -> str:
        """Return the name of the layer that was given for an input, to show to users; empty without one."""
        return self._read[name].source.sourceName() if name in self._read else ""

    def prepare(self, crs_wkt: str | None) -> None:
        """Build the coordinate system of the results in this thread, which is the main one."""
        prepare_system(crs_wkt)

    def path(self, name: str) -> Path:
        """Return the file that an output names; QGIS chooses a temporary one during the run."""
        return Path(self.output_file(name))

    def destination(self, name: str) -> Destination:
        """Return the file of an output that is wanted."""
        return self.algorithm.destinations.get(name) or Destination.at(self.path(name))

    def runner(self) -> AbstractContextManager[Runner]:
        """Provide the runner with as many processes as WORKERS asks for."""
        from ...core.run.processes import workers

        return workers(self["WORKERS"], known_interpreter)

    def filled(self, name: str) -> bool:
        """Return whether a value was entered."""
        return self.parameters.get(name) not in (None, "", NULL)

    def wanted(self, name: str) -> bool:
        """Return whether an output is to be written; the batch dialog gives an empty definition for a skipped one."""
        return bool(destination_text(self.parameters.get(name), self.context))

    def output_file(self, name: str) -> str:
        """Return the file of an output; QGIS chooses the name of a temporary one during the run."""
        return self.read_as("FileOutput", name)

    def raster(self, name: str) -> RasterSource:
        """Return a rail raster, whose header is read in the main thread."""
        return self.once(name, lambda: self._raster(name))

    def _raster(self, name: str) -> RasterSource:
        from ...core.files.rail_rasters import RasterSource
        from ..reading.rasters import open_with_gdal

        layer = self.read_as("RasterLayer", name)
        if layer is None:
            raise RasterError(f"{name} is not a readable raster: give the output of Rasterize Rail Points.")
        source = RasterSource(Path(layer.source()), open_with_gdal)
        prepare_system(source.header.frame.crs_wkt)
        return source

    def source(self, name: str) -> LayerSource:
        """Return a vector layer or a table.

        Raises RailExtractError if it can't be read, has no lines where only these are of use, or has them in degrees
        where they are measured.
        """
        return self.once(name, lambda: self._source(name))

    def _source(self, name: str) -> LayerSource:
        from ...core.jobs.lines import system_of
        from ..reading.layers import LayerSource

        layers = (one for one in self.job.parameters if isinstance(one, kinds.LayerInput))
        one = next(one for one in layers if one.name == name)
        has_lines = one.kinds == (kinds.LINE,)
        layer = self.read_as("Source", name)
        if layer is None:
            raise RailExtractError(f"{name} is not a readable layer: choose another one.")
        if has_lines:
            _check_lines(name, layer.wkbType())
        source = LayerSource(name, layer, self.context)
        if has_lines and not one.transformed:
            system_of(source.crs_wkt, SILENT)
            prepare_system(source.crs_wkt)
        return source

    def cloud(self, name: str = "INPUT") -> CloudSource:
        """Return the files of a cloud; the parameter CRS, if any, applies to files that state no coordinate system."""
        return self.once(f"cloud {name}", lambda: self._cloud(name))

    def _cloud(self, name: str) -> CloudSource:
        source = cloud_source(self.parameters.get(name), self.context)
        crs = self.projected_crs()
        source = replace(source, crs_wkt=crs.toWkt()) if crs.isValid() else source
        prepare_system(checked_crs(source))
        return self.with_mask(source)

    def scratch(self) -> AbstractContextManager[Path]:
        """Provide a folder for the points of a run."""
        return points_folder()

    def picked(self, crs_wkt: str | None) -> list[np.ndarray]:
        """Return the place of SEED in a coordinate system, (1, 2)."""
        from ..reading.layers import read_place

        place = self.read_as("Point", "SEED")
        own = self.read_as("PointCrs", "SEED")
        return [read_place(place, own, system(crs_wkt), self.context)]

    def projected_crs(self) -> QgsCoordinateReferenceSystem:
        """Return the coordinate system CRS, an invalid one if it is empty.

        Raises ParameterError if it is not a coordinate system, or is in degrees.
        """
        crs = self.read_as("Crs", "CRS")
        if self.filled("CRS") and not crs.isValid():
            raise ParameterError(f"CRS {self.parameters['CRS']} is not a coordinate system: choose one from the list.")
        if crs.isGeographic():
            raise ParameterError(
                f"CRS {crs.authid()} is in degrees, where lengths can't be measured: choose a projected one."
            )
        return crs

    def extent(self, crs_wkt: str | None) -> Bounds | None:
        """Read EXTENT in a coordinate system: west, south, east and north limits.

        Raises ParameterError if the extent has no area, or an infinite one.
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


def _check_lines(name: str, kind: QgsWkbTypes.Type) -> None:
    """Refuse a layer whose type of geometry has no lines."""
    if QgsWkbTypes.geometryType(kind) in TYPES_WITHOUT_LINES:
        raise RailExtractError(f"{name} has the geometry type {QgsWkbTypes.displayString(kind)}: give a line layer.")


def _number(values: ParameterValues, one: kinds.Number) -> float | None:
    """Read a number that is not NaN, which QGIS accepts."""
    if one.optional and not values.filled(one.name):
        return None
    number = values.read_as("Double", one.name)
    if math.isnan(number):
        raise ParameterError(f"{one.name} can't be nan: give a number.")
    return int(number) if one.whole else number


def _chosen(values: ParameterValues, one: kinds.Choice) -> Any:
    """Read a choice: one id, several, or the place of one."""
    if one.several:
        return tuple(values.read_as("EnumStrings", one.name))
    return values.read_as("Enum" if one.numbered else "EnumString", one.name)


def _file(values: ParameterValues, one: kinds.FileInput) -> Path | None:
    given = values.read_as("File", one.name)
    return Path(given) if given else None


def _system(values: ParameterValues, one: kinds.System) -> str | None:
    from ..reading.layers import wkt_of

    return wkt_of(values.projected_crs()) or None


READERS: dict[type, Callable[[ParameterValues, Any], Any]] = {
    kinds.Number: _number,
    kinds.Flag: lambda values, one: values.read_as("Boolean", one.name),
    kinds.Choice: _chosen,
    kinds.Text: lambda values, one: values.read_as("String", one.name),
    kinds.FieldInput: lambda values, one: values.read_as("String", one.name),
    kinds.FileInput: _file,
    kinds.System: _system,
}
"""Functions that read a value, by the kind of the parameter."""
