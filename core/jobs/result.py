"""The result of a run: layers and pages that are made when they are asked for, and figures."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..disk import Destination
from ..errors import ParameterError

if TYPE_CHECKING:
    import geopandas

    from ..files.layers import AnyLayer
    from ..files.rail_rasters import RasterHeader
    from ..frame import LocalFrame
    from ..raster import RailRaster

    Rasters = tuple[RasterHeader, Sequence[RailRaster]]


@dataclass(frozen=True)
class ShownProfile:
    """The profile of a run: its name, v and w of its ring, its margin, and how far both rails are apart, by track."""

    name: str
    points: tuple[tuple[float, float], ...]
    margin_m: float
    spacing_m: Mapping[int, float]


@dataclass(frozen=True)
class ShownCloud:
    """The points of a run, which its layers remember: the parameter of the cloud, classes, and width of the heads.

    `profile` is what was swept through them, if anything.
    """

    name: str
    class_codes: tuple[int, ...]
    head_width_m: float
    profile: ShownProfile | None = None


FORMATS = (".gpkg", ".dxf", ".csv")
"""File name suffixes of layers."""


@dataclass(frozen=True)
class Result:
    """What a job found.

    Attributes
    ----------
    figures : mapping of str to object
        By name; None where one is unknown.
    frame : LocalFrame
        Converts between the local metres of the layers and the coordinate system.
    layers : mapping of str to callable
        Makes a layer, by the name of the output.
    pages : mapping of str to callable
        Makes a web page, by the name of the output.
    sentences : tuple of str
        The result in words.
    rasters : mapping of str to callable
        Makes rasters of one grid and their header, None if they are empty, by the name of the output.
    found : object
        What layers and pages are made from, such as a `RailNetwork`.
    """

    figures: Mapping[str, Any]
    frame: LocalFrame
    layers: Mapping[str, Callable[[], AnyLayer]] = field(default_factory=dict)
    pages: Mapping[str, Callable[[], str]] = field(default_factory=dict)
    sentences: tuple[str, ...] = ()
    cloud: ShownCloud | None = None
    rasters: Mapping[str, Callable[[], Rasters | None]] = field(default_factory=dict)
    found: Any = None

    def to_geodataframe(self, layer: str) -> geopandas.GeoDataFrame:
        """Return a layer, such as "elements", as a table with the fields of docs/reference.md."""
        geopandas = package("geopandas")
        (written,) = self._made([layer])
        from ..files.layers import written_by_name
        from ..files.writing import shapes_of

        columns = written_by_name(written)
        return geopandas.GeoDataFrame(columns, geometry=shapes_of(written, self.frame), crs=self.frame.crs_wkt or None)

    def save(self, path: str | Path, layer: str | None = None) -> None:
        """Write the layers into a GeoPackage, whose other layers stay, or one layer into a DXF or CSV file.

        The path ends in .gpkg, .dxf or .csv. Without the name of a layer, a GeoPackage gets all layers, and another
        file the first. Raises ParameterError for an unknown layer or format, or a missing package, and DiskError if the
        file can't be written.
        """
        suffix = Path(path).suffix.lower()
        if suffix not in FORMATS:
            raise ParameterError(f"{Path(path).name} can't be written: let the name end in {' or '.join(FORMATS)}.")
        names = list(self.layers) if layer is None and suffix == ".gpkg" else [layer or next(iter(self.layers))]
        made = self._made(names)
        from ..files.writing import write_layers

        write_layers(made, Destination.at(Path(path)), self.frame)

    def report(self, path: str | Path) -> None:
        """Write the report, an HTML page; raise ParameterError if the job has none."""
        if "REPORT" not in self.pages:
            raise ParameterError("This result has no report: save its layers.")
        Destination.at(Path(path)).write_text(self.pages["REPORT"]())

    def _made(self, names: Collection[str]) -> list[AnyLayer]:
        """Make the layers of these names."""
        unknown = {name.upper() for name in names} - set(self.layers)
        if unknown:
            known = ", ".join(name.lower() for name in self.layers)
            raise ParameterError(f"There is no layer {unknown.pop().lower()!r}: choose one of {known}.")
        for name in ("pyogrio", "shapely"):
            package(name)
        return [self.layers[name.upper()]() for name in names]


def package(name: str) -> ModuleType:
    """Import a package that not every installation has; raise ParameterError if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise ParameterError(f"This needs the package {name}: run pip install {name}.") from error
