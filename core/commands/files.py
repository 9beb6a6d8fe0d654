"""The values of a run that a command line or Python gives: texts, numbers, and files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Callable

import numpy as np

from ..clouds.crs import MAX_COORDINATE, is_geographic, parse_crs
from ..clouds.readers import CATALOGUE, paths_of
from ..disk import Destination, scratch_folder, writing
from ..errors import CrsError, ParameterError, RailExtractError
from ..files.rail_rasters import RasterSource, open_with_rasterio, write_rasters
from ..jobs import declaration as kinds
from ..jobs.clouds import Bounds, CloudSource
from ..jobs.declaration import Parameter
from ..jobs.outputs import WEB_PAGES
from ..jobs.result import Result
from ..jobs.values import Job, Values
from ..progress import Progress
from ..run.processes import workers
from ..run.tasks import Runner

if TYPE_CHECKING:
    from ..jobs.features import FeatureSource
    from ..jobs.result import Rasters

Spell = Callable[[Parameter], str]
"""Returns how a front end names a parameter."""

LAYERS, PAGES, RASTERS = (".gpkg", ".dxf", ".csv"), (".html", ".htm"), (".tif", ".tiff")
"""Suffixes of the files for layers, of which only a GeoPackage holds several, for web pages and for rasters."""


class FileValues(Values):
    """Values of the parameters of one run of a job: values and files by name; None, or none, where one is left empty.

    `command` repeats the run, `keeps` says whether the result stays after it, and `work` is a folder that keeps what is
    finished for later runs. Raises ParameterError if a value is
    wrong, and DiskError if an output could not be written after the run.
    """

    def __init__(
        self, job: Job, given: Mapping[str, Any], command: str, keeps: bool = False, work: Path | None = None
    ) -> None:
        self.job, self._command, self._keeps, self._read = job, command, keeps, dict[str, Any]()
        self._work = work
        self._values = {one.name: read_value(one, given.get(one.name)) for one in job.parameters}
        self._filled = {name for name, one in given.items() if not (one is None or (isinstance(one, str) and not one))}
        named = {one.name: given.get(one.name) for one in job.outputs}
        for one in job.outputs:
            if named[one.name] is not None:
                check_packages(one)
        self.destinations = destinations_of(
            job, {name: Path(file) for name, file in named.items() if file is not None}, keeps
        )

    def __getitem__(self, name: str) -> Any:
        """Return the value of a parameter, by its kind; None if it is empty, and the WKT of a coordinate system."""
        return self._values[name]

    @property
    def command(self) -> str:
        """What repeats the run."""
        return self._command

    def filled(self, name: str) -> bool:
        """Return whether a value was given; a default does not count."""
        return name in self._filled

    def wanted(self, name: str) -> bool:
        """Return whether an output is to be written."""
        return name in self.destinations

    def path(self, name: str) -> Path:
        """Return the file that an output names, before the run."""
        return self.destinations[name].path

    def destination(self, name: str) -> Destination:
        """Return the file of an output that is wanted."""
        return self.destinations[name]

    def title(self, name: str) -> str:
        """Return the file that was given for an input; empty without one."""
        return str(self._values[name] or "")

    def prepare(self, crs_wkt: str | None) -> None:
        """Do nothing: only QGIS builds its coordinate systems before a run."""

    def runner(self) -> AbstractContextManager[Runner]:
        """Provide the runner with as many processes as WORKERS asks for."""
        return workers(self["WORKERS"])

    @property
    def keeps(self) -> bool:
        """Whether the result stays after the run, so that its layers can be had without naming files."""
        return self._keeps

    def cloud(self, name: str = "INPUT") -> CloudSource:
        """Return the files of a cloud, and which of their points count."""
        source = CloudSource(tuple(paths_of(self[name])), self._values.get("CRS"))
        return self.once(f"cloud {name}", lambda: self.with_mask(source))

    def raster(self, name: str) -> RasterSource:
        """Return a file of rail rasters."""
        check_rasterio(name)
        return RasterSource(Path(self[name]), open_with_rasterio)

    def extent(self, crs_wkt: str | None) -> Bounds | None:
        """Return EXTENT, which is in the coordinate system of the cloud."""
        return self["EXTENT"]

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """Provide a folder for the points of a run: where it is kept, or next to the first output, if there is one."""
        if self._work is not None:
            yield self._work
            return
        if not self.destinations:
            with TemporaryDirectory() as folder:
                yield Path(folder)
            return
        parent = next(iter(self.destinations.values())).file.parent
        with writing(parent), scratch_folder(parent) as folder:
            yield folder

    def picked(self, crs_wkt: str | None) -> list[np.ndarray]:
        """Return the places of SEED, which are in the coordinate system of the cloud."""
        return [np.array([place]) for place in self["SEED"]]

    def source(self, name: str) -> FeatureSource:
        """Return a layer of a file."""
        return self.once(name, lambda: vector_module(name).read_features(self[name], name, name == "AXIS"))


def run_with_files(job: Job, make: Callable[[], FileValues], progress: Progress, spell: Spell) -> Result:
    """Run a job and write the outputs that were given; one that fails does not stop the others.

    `make` returns the values, and `spell` how messages name a parameter. Raises RailExtractError if a value is wrong,
    or an output could not be written.
    """
    try:
        values = make()
        job.check(values)
        result = job.run(values, progress)
        made = {*result.layers, *result.pages, *result.rasters, *result.figures}
        for name in sorted(set(values.destinations) - made):
            progress.warning(f"{name} is not written: a run with these inputs does not make it.")
        errors = list(_failures(result, values))
        if len(errors) > 1:
            raise RailExtractError(" ".join(map(str, errors)))
        if errors:
            raise errors[0]
        return result
    except RailExtractError as error:
        error.args = (job.reworded(str(error), spell),)
        raise


def _failures(result: Result, values: FileValues) -> Iterator[RailExtractError]:
    """Write what is wanted of a result, layers of one file together, and yield the errors."""
    writers: list[Callable[[], None]] = []
    layers = {name: make() for name, make in result.layers.items() if values.wanted(name)}
    for file in dict.fromkeys(values.destination(name).file for name in layers):
        names = [name for name in layers if values.destination(name).file == file]
        writing_module = vector_module(names[0], ".files.writing")
        together = [layers[name] for name in names], values.destination(names[0]), result.frame
        writers.append(partial(writing_module.write_layers, *together))
    pages = {name: make for name, make in result.pages.items() if values.wanted(name)}
    writers += [partial(_write_page, values.destination(name), make) for name, make in pages.items()]
    rasters = {name: make for name, make in result.rasters.items() if values.wanted(name)}
    writers += [partial(_write_rasters, values.destination(name), make) for name, make in rasters.items()]
    for write in writers:
        try:
            write()
        except RailExtractError as error:
            yield error


def _write_rasters(destination: Destination, make: Callable[[], Rasters | None]) -> None:
    made = make()
    if made is not None:
        with destination.replacing() as new:
            write_rasters(new, *made)


def _write_page(destination: Destination, make: Callable[[], str]) -> None:
    destination.write_text(make())


def read_value(one: Parameter, given: Any) -> Any:
    """Return the value of a parameter that was given, its default if nothing was."""
    if given is None or (isinstance(given, str) and not given):
        if one.required:
            raise ParameterError(one.refusal(None))
        return None if given == "" and one.optional else one.default
    try:
        return READERS.get(type(one), lambda one, given: str(given))(one, given)
    except (TypeError, ValueError):
        raise ParameterError(one.refusal(given)) from None


def _number(one: kinds.Number, given: Any) -> float:
    value = float(given)
    if not (one.low <= value <= one.high) or (one.whole and not value.is_integer()):
        raise ValueError
    return int(value) if one.whole else value


def _chosen(one: kinds.Choice, given: Any) -> Any:
    """Read a choice: one id, several, or the place of one."""
    if one.numbered:
        return range(len(one.options)).index(int(given))
    if not one.several:
        return one.options[one.options.index(given)]
    words = given.split(",") if isinstance(given, str) else given
    return tuple(one.options[one.options.index(word.strip().upper())] for word in words)


def _system(one: kinds.System, given: Any) -> str:
    """Read a coordinate system."""
    try:
        crs = parse_crs(str(given))
    except CrsError:
        raise ParameterError(f"{one.name} {given} is not a coordinate system: give one such as EPSG:25832.") from None
    if is_geographic(crs):
        raise ParameterError(
            f"{one.name} {given} is in degrees, where lengths can't be measured: give a projected one."
        )
    return crs.to_wkt()


def _extent(one: kinds.Extent, given: Any) -> Bounds:
    """Read a rectangle; the order of its numbers is that of command lines and Python, not that of QGIS."""
    try:
        xmin, ymin, xmax, ymax = map(float, given.split(",") if isinstance(given, str) else given)
    except (TypeError, ValueError):
        raise ParameterError(f'{one.name} "{given}" should be four numbers: xmin,ymin,xmax,ymax.') from None
    return xmin, ymin, xmax, ymax


def _places(one: kinds.Place, given: Any) -> list[tuple[float, float]]:
    """Read one place or several, as texts or as pairs of numbers."""
    several = isinstance(given, Sequence) and not isinstance(given, str) and not isinstance(given[0], (int, float))
    found = []
    for place in given if several else [given]:
        try:
            x, y = map(float, place.split(",") if isinstance(place, str) else place)
            if not max(abs(x), abs(y)) <= MAX_COORDINATE:
                raise ValueError
        except (TypeError, ValueError):
            raise ParameterError(f'{one.name} "{place}" should be two numbers: x,y.') from None
        found.append((x, y))
    return found


READERS: dict[type, Callable[[Any, Any], Any]] = {
    kinds.Number: _number,
    kinds.Flag: lambda one, given: bool(given),
    kinds.Choice: _chosen,
    kinds.Text: lambda one, given: given if isinstance(given, str) else ",".join(map(str, given)),
    kinds.FileInput: lambda one, given: Path(given),
    kinds.System: _system,
    kinds.Extent: _extent,
    kinds.Place: _places,
    kinds.Cloud: lambda one, given: paths_of(given),
}
"""Functions that read a value, by the kind of the parameter; others are texts."""


def check_packages(one: kinds.Output) -> None:
    """Check before a run that an output can be written, with the packages that are installed."""
    if isinstance(one, kinds.LayerOutput):
        vector_module(one.name, ".files.writing")
    elif isinstance(one, kinds.RasterOutput):
        check_rasterio(one.name)


def check_rasterio(name: str) -> None:
    """Check before a run that an input or output can be read or written."""
    if find_spec("rasterio") is None:
        raise ParameterError(f"{name} needs the package rasterio: in a clone, run pip install .[cluster].")


def destinations_of(job: Job, files: Mapping[str, Path], keeps: bool = False) -> dict[str, Destination]:
    """Check that outputs can be written, make their folders, and return their destinations.

    Raises an error if a required output is missing, one could not be written after the run, or two are the same file.
    """
    found: dict[str, Destination] = {}
    shared: dict[Path, Destination] = {}
    for one in job.outputs:
        if one.name not in files:
            if one.required and not (keeps and isinstance(one, kinds.LayerOutput)):
                raise ParameterError(one.refusal(None))
            continue
        path = files[one.name]
        if isinstance(one, kinds.FileOutput) and CATALOGUE in one.kinds and not path.suffix:
            path = path.with_suffix(CATALOGUE)
        is_page = isinstance(one, kinds.FileOutput) and one.kinds == WEB_PAGES
        suffixes = LAYERS if isinstance(one, kinds.LayerOutput) else PAGES if is_page else ()
        suffixes = RASTERS if isinstance(one, kinds.RasterOutput) else suffixes
        if suffixes and path.suffix.lower() not in suffixes:
            raise ParameterError(f"{one.name} can't be {path.name}: let it end in {' or '.join(suffixes)}.")
        with writing(path.parent):
            path.parent.mkdir(parents=True, exist_ok=True)
        destination = Destination.at(path)
        if destination.file in shared and path.suffix.lower() != ".gpkg":
            other = next(name for name in found if found[name].file == destination.file)
            raise ParameterError(f"{other} and {one.name} are the same file: give each its own name.")
        found[one.name] = shared.setdefault(destination.file, destination)
    return found


def vector_module(option: str, name: str = "vectors") -> Any:
    """Return the module that reads vector files, or another one of this package that needs the same packages.

    Raises ParameterError if the packages are not installed; `option` is what needs them.
    """
    try:
        return import_module(f".{name}", __package__)
    except ImportError as error:
        raise ParameterError(
            f"{option} needs the packages pyogrio and shapely: in a clone, run pip install .[cluster]."
        ) from error
