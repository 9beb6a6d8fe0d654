"""The front door: the tracks of a cloud in one call, and the results as tables, files and a report.

`import rail_extract` gives these names.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, fields
from importlib import import_module
from inspect import Parameter, Signature
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .clouds.points import ask
from .clouds.readers import Extent, Paths, paths_of
from .commands.files import run_with_files
from .disk import Destination
from .errors import ParameterError
from .jobs import CALLS
from .jobs.declaration import Job
from .jobs.result import Result
from .parameters import DEFAULT_STEP_M, Parameters
from .pipeline import extract_files
from .progress import SILENT, Progress
from .rails import RailNetwork
from .report import Origin
from .standards import DEFAULT, RAIL_CLASS, SEARCHED_CLASSES, resolve
from .workers.runner import workers as workers_of

if TYPE_CHECKING:
    import geopandas

    from .output.layers import Layer

LAYERS = ("rails", "centerlines", "quality", "findings")
"""Layers of a result; `quality` holds the stations of the track geometry."""

FORMATS = (".gpkg", ".dxf", ".csv")
"""File name suffixes of layers."""


def _missing() -> Origin:
    raise TypeError("A Network needs its origin.")


@dataclass(frozen=True)
class Network(RailNetwork):
    """The rails and tracks of a cloud; see `RailNetwork` for what it holds.

    Attributes
    ----------
    origin : Origin
        Files, standard and parameters of the extraction.
    """

    origin: Origin = field(default_factory=_missing)  # fields before it have defaults

    def to_geodataframe(self, layer: str = "rails") -> geopandas.GeoDataFrame:
        """Return a layer as a table, with the fields of docs/reference.md and the cloud's coordinate system.

        Parameters
        ----------
        layer : str
            One of `LAYERS`.

        Raises
        ------
        ParameterError
            There is no such layer, or a package is not installed.
        """
        geopandas = _package("geopandas")
        (written,) = self._layers([layer])
        from .output.writing import shapes_of

        columns = dict(zip((one.name for one in written.product.fields), written.written_columns()))
        return geopandas.GeoDataFrame(columns, geometry=shapes_of(written, self.frame), crs=self.frame.crs_wkt or None)

    def save(self, path: str | Path, layer: str | None = None) -> None:
        """Write the layers into a GeoPackage, whose other layers stay, or one layer into a DXF or CSV file.

        Parameters
        ----------
        path : path
            Ends in .gpkg, .dxf or .csv.
        layer : str, optional
            One of `LAYERS`. Without it, a GeoPackage gets all of them, and another file the rails.

        Raises
        ------
        ParameterError
            There is no such layer or format, or a package is not installed.
        DiskError
            The file can't be written.
        """
        suffix = Path(path).suffix.lower()
        if suffix not in FORMATS:
            raise ParameterError(f"{Path(path).name} can't be written: let the name end in {' or '.join(FORMATS)}.")
        names = LAYERS if layer is None and suffix == ".gpkg" else [layer or LAYERS[0]]
        layers = self._layers(names)
        from .output.writing import write_layers

        write_layers(layers, Destination.at(Path(path)), self.frame)

    def report(self, path: str | Path) -> None:
        """Write the report with the verdict, an HTML page.

        Raises
        ------
        DiskError
            The file can't be written.
        """
        Destination.at(Path(path)).write_text(self.origin.report(self))

    def _layers(self, names: Collection[str]) -> list[Layer]:
        """Make the layers of these names."""
        unknown = set(names) - set(LAYERS)
        if unknown:
            raise ParameterError(f"There is no layer {unknown.pop()!r}: choose one of {', '.join(LAYERS)}.")
        for package in ("pyogrio", "shapely"):
            _package(package)
        from .output.layers import network_layers

        return network_layers(self, names, self.origin.gauges_m)


def extract(
    clouds: Paths,
    standard: str = DEFAULT,
    *,
    rail_classes: Sequence[int] = (RAIL_CLASS,),
    raw: bool = False,
    crs: str | None = None,
    extent: Extent | None = None,
    workers: int = 1,
    progress: Progress = SILENT,
    **parameters: Any,
) -> Network:
    """Extract rails, track centerlines and track geometry from point clouds.

    Parameters
    ----------
    clouds : path or sequence of paths
        LAS, LAZ or COPC files, virtual point clouds (.vpc), or folders of tiles.
    standard : str
        Name of a rail standard, of docs/reference.md.
    rail_classes : sequence of int
        Classes of rail points.
    raw : bool
        Whether nobody has classified the rail points: they are found first, among all classes.
    crs : str, optional
        Coordinate system of files that state none, as WKT or EPSG code.
    extent : tuple of float, optional
        Smallest x, smallest y, largest x, largest y of the points to use, in units of the coordinate system.
    workers : int
        Processes that compute; 0 is one per core, as far as memory allows.
    progress : Progress
    **parameters
        Fields of `Parameters`, such as `max_gap_m=8.0`.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a cloud can't be read, or nothing can be extracted.

    Examples
    --------
    >>> from pathlib import Path
    >>> import rail_extract as rx
    >>> sample = Path(rx.__file__).parent / "resources" / "sample" / "sample.laz"
    >>> network = rx.extract(sample, standard="IN_75R_1000")
    >>> len(network.rails), len(network.centerlines)
    (6, 3)
    """
    profile = resolve(standard)
    known = {one.name for one in fields(Parameters)} - {"gauge_m", "head_width_m"}
    if not set(parameters) <= known:
        unknown = sorted(set(parameters) - known)[0]
        raise ParameterError(f"There is no parameter {unknown!r}: choose from {', '.join(sorted(known))}.")
    settings = Parameters(profile.gauge_m, profile.head_width_m, **{"quality_step_m": DEFAULT_STEP_M, **parameters})
    request = ask(clouds, SEARCHED_CLASSES if raw else rail_classes, crs, extent, progress)
    with TemporaryDirectory() as folder, workers_of(workers) as runner:
        found = extract_files(request, Path(folder), settings, runner, progress, classify=raw)
    paths = tuple(paths_of(clouds))
    command = f"rail_extract.extract({', '.join(repr(str(path)) for path in paths)}, standard={standard!r})"
    return Network(**vars(found), origin=Origin(paths, profile, settings.gauges[1:], command, settings))


def __getattr__(name: str) -> Callable[..., Result]:
    """Return a job as a function."""
    if name not in CALLS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return function_of(CALLS[name])


def function_of(job: Job) -> Callable[..., Result]:
    """Return a job as a function whose arguments have the names of its parameters and outputs, in small letters.

    What must be given comes first; files of outputs may be left out, because the result writes them as well.
    """
    stated = sorted((*job.parameters, *job.outputs), key=lambda one: not one.required)

    def call(*args: Any, **given: Any) -> Result:
        values = signature.bind(*args, **given).arguments
        progress = values.pop("progress", SILENT)
        plain = {name: str(value) if isinstance(value, Path) else value for name, value in values.items()}
        command = f"rail_extract.{job.call}({', '.join(f'{name}={value!r}' for name, value in plain.items())})"
        named = {name.upper(): value for name, value in values.items()}
        return run_with_files(job, named, command, progress, lambda one: one.name.lower(), keeps=True)

    first, later = Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY
    arguments = [
        Parameter(one.name.lower(), first) if one.required else Parameter(one.name.lower(), later, default=one.default)
        for one in stated
    ]
    signature = Signature([*arguments, Parameter("progress", later, default=SILENT)], return_annotation=Result)
    texts = [f"{one.name.lower()}\n    {one.label}. {one.help}" for one in stated]
    call.__name__, call.__signature__ = job.call, signature  # type: ignore[attr-defined]
    call.__doc__ = "\n".join([job.summary, "", job.help, "", "Parameters", "----------", *texts])
    return call


def _package(name: str) -> ModuleType:
    """Import a package that not every installation has."""
    try:
        return import_module(name)
    except ImportError as error:
        raise ParameterError(f"This needs the package {name}: run pip install {name}.") from error
