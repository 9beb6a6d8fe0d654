"""Kill runs while they write: an output is then the old one or the new one, never part of each.

`. build/environment.sh; .venv/bin/python tools/kills.py 50` kills fifty times for each format, at random moments. A run
writes one version after another, in each of which all features, cells and words state the version, so that it is always
at work on a file when it is killed. After each kill, the version is read, and the next run must remove what is left.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from osgeo import gdal, ogr
from qgis.core import QgsApplication, QgsProcessingContext
from rail_extract.core.clouds.points import ask
from rail_extract.core.clouds.readers import list_files
from rail_extract.core.disk import MARK, MIN_UNMARKED_AGE_S, PREFIX, Destination, identity
from rail_extract.core.fields import RAILS
from rail_extract.core.files.layers import lines_layer
from rail_extract.core.files.rail_rasters import header_for
from rail_extract.core.frame import LocalFrame
from rail_extract.core.labelling.files import Content, Labels, OutputFiles, write_labelled
from rail_extract.core.progress import SILENT
from rail_extract.core.rails import RailLine
from rail_extract.core.raster import rasterize
from rail_extract.core.run.tasks import Runner
from rail_extract.core.standards import SEARCHED_CLASSES, resolve
from rail_extract.rail_extract_plugin.algorithms import ALGORITHMS
from rail_extract.rail_extract_plugin.dialog.parameter_values import ParameterValues
from rail_extract.rail_extract_plugin.writing.layers import write_layer as write_output
from rail_extract.rail_extract_plugin.writing.layers import write_raster

MAX_S = 0.3
"""Longest time from the first complete version to the kill."""

COUNT = 40
"""Features of a layer."""

FRAME = LocalFrame(np.array([500_000.0, 3_000_000.0, 0.0]), 1.0, 1.0, None)

POINTS = 20_000
"""Points of a cloud."""

TILES = ("west.laz", "east.las")

LEFT_OVER = re.compile(rf"{re.escape(PREFIX)}\w+")


def write_layer(destination: Destination, version: int) -> None:
    """Write rails whose number and place are the version."""
    xyz = np.array([[version, 0.0, version], [version, 10.0, version]], dtype=float)
    made = lines_layer(RAILS, [RailLine(xyz, version, 10, version, 1.0, 1.0, 0.0) for _ in range(COUNT)])
    _write("vectorizerails", destination, lambda values: write_output(values, "OUTPUT", made, FRAME))


def read_layer(path: Path) -> set[int]:
    """Return the versions in a layer: of each feature's number and of its geometry."""
    dataset = ogr.Open(str(path))
    layer = dataset.GetLayerByName("rails") or dataset.GetLayer(0)
    features = list(layer)
    found = {feature.GetField("rail_id") for feature in features}
    found |= {round(feature.GetGeometryRef().GetZ(0)) for feature in features}
    return found if len(features) == COUNT else {-len(features)}


def read_drawing(path: Path) -> set[int]:
    """Return the versions in a drawing, from its heights."""
    dataset = ogr.Open(str(path))
    features = list(dataset.GetLayer(0))
    return {round(one.GetGeometryRef().GetZ(0)) for one in features} if len(features) == COUNT else {-len(features)}


def write_table(destination: Destination, version: int) -> None:
    """Write rails into a GeoPackage that has a table of other people."""
    if not destination.file.exists():
        dataset = ogr.GetDriverByName("GPKG").CreateDataSource(str(destination.file))
        dataset.CreateLayer("signals", geom_type=ogr.wkbPoint)
        del dataset
        destination = Destination.at(destination.path)
    write_layer(destination, version)


def read_table(path: Path) -> set[int]:
    """Read a layer as `read_layer` does; -1 if the table of other people is gone."""
    dataset = ogr.Open(str(path))
    return read_layer(path) if dataset.GetLayerByName("signals") else {-1}


def write_cells(destination: Destination, version: int) -> None:
    """Write a raster whose cells and gauge are the version."""
    across = version % 50 * 0.1
    points = np.column_stack([np.linspace(0, 40, 4000), np.full(4000, across), np.zeros(4000)])
    standard = resolve("CUSTOM", 1435.0, 72.0)
    raster = rasterize(points, 0.04)
    header = header_for([raster], (10 + version % 50,), FRAME, standard)
    _write("frpdfcleanup", destination, lambda values: write_raster(values, "OUTPUT", header, [raster], SILENT))


def read_cells(path: Path) -> set[int]:
    """Return the versions, modulo 50, of a raster's band and cells."""
    dataset = gdal.Open(str(path))
    band = dataset.GetRasterBand(1)
    rows = np.argwhere(band.ReadAsArray() == 1)[:, 0]
    _, _, _, top, _, step = dataset.GetGeoTransform()
    across = {round((top + step * (row + 0.5) - FRAME.origin[1]) * 10) for row in np.unique(rows).tolist()}
    return {int(band.GetDescription()) - 10} | across


def write_page(destination: Destination, version: int) -> None:
    """Write a page of 4 MB on which every word is the version."""
    destination.write_text(f"{version} " * 600_000)


def read_page(path: Path) -> set[int]:
    """Return the versions on a page."""
    words = path.read_text(encoding="utf-8").split()
    return set(map(int, set(words))) if len(words) == 600_000 else {-len(words)}


def write_points(destination: Destination, version: int) -> None:
    """Write a classified copy in which the class of every point is the version."""
    _write_copies([raw_tiles()[0]], OutputFiles(destination, (), None), version)


def read_points(path: Path) -> set[int]:
    """Return the versions, modulo 200, of a cloud's points."""
    codes = np.asarray(laspy.read(path).classification)
    return set(np.unique(codes).tolist()) if len(codes) == POINTS else {-len(codes)}


def write_tiles(destination: Destination, version: int) -> None:
    """Write classified copies of tiles, and their catalogue."""
    output = OutputFiles(destination, tuple(tile.name for tile in raw_tiles()), None)
    _write_copies(raw_tiles(), replace(output, before=identity(output.folder)), version)


def read_tiles(path: Path) -> set[int]:
    """Return the versions, modulo 200, of the points of tiles."""
    return set().union(*map(read_points, list_files(path)))


@lru_cache(maxsize=1)
def raw_tiles() -> list[Path]:
    """Write raw clouds into a folder of their own, once."""
    folder = Path(tempfile.mkdtemp())
    elsewhere(lambda: _write_tiles(folder))
    return [folder / name for name in TILES]


def _write_tiles(folder: Path) -> None:
    for name in TILES:
        cloud = laspy.LasData(laspy.LasHeader(version="1.4", point_format=6))
        cloud.xyz = np.random.default_rng(1).uniform(0, 100, (POINTS, 3))
        cloud.write(folder / name)


def _write_copies(tiles: list[Path], output: OutputFiles, version: int) -> None:
    """Write the copies as Classify Rail Points does once it has found the rail points: here, all points."""
    request = ask(tiles, SEARCHED_CLASSES)
    with tempfile.TemporaryDirectory() as folder:
        labels = Labels(request, Path(folder))
        labels.add(np.arange(labels.point_count))
        write_labelled(request, Content(version % 200), labels, output, Runner(), SILENT)


FORMATS: dict[str, tuple[str, Callable[[Destination, int], None], Callable[[Path], set[int]]]] = {
    **{suffix: (f"rails.{suffix}", write_layer, read_layer) for suffix in ("gpkg", "shp", "geojson", "fgb", "gml")},
    "csv": ("rails.csv", write_layer, read_layer),
    "dxf": ("rails.dxf", write_layer, read_drawing),
    "gpkg table": ("rails.gpkg", write_table, read_table),
    "tif": ("rails.tif", write_cells, read_cells),
    "las": ("rails.las", write_points, read_points),
    "laz": ("rails.laz", write_points, read_points),
    "tiles": ("rails.vpc", write_tiles, read_tiles),
    "html": ("rails.html", write_page, read_page),
}
"""By format: name of the file, and how a version is written and read."""

SETS = (".shp", ".gml", ".csv", ".vpc")
"""Suffixes of outputs of several files, whose main file or folder is absent for a moment."""


def _write(name: str, destination: Destination, write: Callable[[ParameterValues], Any]) -> None:
    """Write an output as the algorithm of this name does."""
    algorithm = next(one for one in ALGORITHMS if one.JOB.name == name)()
    algorithm.initAlgorithm()
    algorithm.destinations = {"OUTPUT": destination}
    write(ParameterValues(algorithm, {"OUTPUT": str(destination.path)}, QgsProcessingContext()))


def elsewhere(call: Callable[[], set[int] | None]) -> set[int]:
    """Call in a process of its own, and return the result.

    The threads that decompress LAZ do not survive a fork: if this process had begun them, later ones would wait for
    them for ever, and a kill would never meet a write.
    """
    reader, writer = os.pipe()
    process = os.fork()
    if process == 0:
        code = 1
        try:
            os.write(writer, json.dumps(sorted(call() or ())).encode())
            code = 0
        except BaseException as error:
            print(f"{error!r}", flush=True)
        os._exit(code)
    os.close(writer)
    with os.fdopen(reader) as stream:
        found = stream.read()
    if os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]):
        raise RuntimeError("A process ended with an error.")
    return set(json.loads(found))


def kill_once(name: str, folder: Path, first: int, after_s: float) -> str:
    """Write versions from `first` on in a process of its own, kill it after a time, and return what is there.

    The folder has the version before `first`. What is there is "whole", "absent until the next run" or what is wrong.
    """
    file, write, read = FORMATS[name]
    reader, writer = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            os.write(writer, b"x")
            for version in range(first, first + 10_000):
                write(Destination.at(folder / file), version)
        except BaseException as error:
            print(f"{name}: {error!r}", flush=True)
        os._exit(1)
    os.read(reader, 1)
    time.sleep(after_s)
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    os.close(reader), os.close(writer)
    absent = not (folder / file).exists() or (file.endswith(".vpc") and not (folder / file).with_suffix("").exists())
    before = None if absent else versions(read, folder / file)
    for left in folder.iterdir():
        if LEFT_OVER.fullmatch(left.name):
            for entry in filter(Path.exists, (left / MARK, left)):
                os.utime(entry, (0, time.time() - MIN_UNMARKED_AGE_S - 1))
    Destination.at(folder / "next.txt")
    left = [one.name for one in folder.iterdir() if LEFT_OVER.fullmatch(one.name)]
    after = versions(read, folder / file)
    if len(after) != 1 or min(after) < 0 or left or (before not in (None, after)):
        return f"{name}: versions {before} and then {after}, left {left}"
    if absent:
        return "absent until the next run" if file.endswith(SETS) else f"{name}: absent"
    return "whole"


def versions(read: Callable[[Path], set[int]], path: Path) -> set[int]:
    """Return the versions in a file; a file that cannot be read has several, one of which is negative."""
    try:
        return elsewhere(lambda: read(path))
    except RuntimeError:
        return {-1, -2}


def kill_often(name: str, times: int, seed: int = 1) -> Counter[str]:
    """Kill runs that write a format, and count what is there afterwards."""
    moments, found = random.Random(seed), Counter[str]()
    file, write, _ = FORMATS[name]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        raw_tiles()
        elsewhere(lambda: write(Destination.at(folder / file), 1))
        for number in range(times):
            found[kill_once(name, folder, 2 + number, MAX_S * moments.random())] += 1
    return found


def start_qgis() -> QgsApplication:
    """Start QGIS without a screen."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    application = QgsApplication([], False)
    application.initQgis()
    return application


def main() -> None:
    """Kill, print the counts, and exit with 1 if anything was half."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("times", type=int, nargs="?", default=50, help="kills per format (default: 50)")
    times = parser.parse_args().times
    application = start_qgis()  # noqa: F841 - kept alive
    wrong = False
    for name in FORMATS:
        found = kill_often(name, times)
        print(name, dict(found), flush=True)
        wrong |= any(outcome not in ("whole", "absent until the next run") for outcome in found)
    sys.stdout.flush()
    os._exit(int(wrong))  # QGIS does not end well in a process that has forked


if __name__ == "__main__":
    main()
