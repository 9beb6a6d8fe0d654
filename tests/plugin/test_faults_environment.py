"""Faults of the environment: packages, weights, disks, other programs, cancelling."""

import os
import re
import shutil
import signal
import sqlite3
import zipfile
from pathlib import Path

import numpy as np
import pytest
from faults import cancelled, faults, full_disk, titles
from memory_layers import layer_of
from osgeo import ogr
from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateTransformContext,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from rail_extract.core.disk import Destination
from rail_extract.core.errors import RailExtractError
from rail_extract.core.frpdf import cleanup, models
from rail_extract.core.pipeline import drawing
from rail_extract.core.run import processes, worker
from rail_extract.rail_extract_plugin.algorithms import base
from rail_extract.rail_extract_plugin.dialog import parameter_values
from rail_extract.rail_extract_plugin.setup import dependencies


def points_only(bench):
    return {"INPUT": bench.cloud(bench.track(length_m=6.0))}


def cloud(bench):
    return {**points_only(bench), "ITERATIONS": 1}


def without(*modules):
    """A Python without some packages."""

    def prepare(bench):
        find_spec = dependencies.find_spec
        for module in (dependencies, cleanup):
            bench.patch.setattr(module, "find_spec", lambda name: None if name in modules else find_spec(name))
        return cloud(bench)

    return prepare


def without_engine(bench):
    return {**without("torch")(bench), "ENGINE": "TORCH"}


def with_weights(change):
    """A plugin with changed weights."""

    def prepare(bench):
        shutil.copytree(models.FOLDER, bench.folder / "models")
        bench.patch.setattr(models, "FOLDER", bench.folder / "models")
        change(models.MODELS[0].path)
        return {**cloud(bench), "MODEL": models.MODELS[0].name}

    return prepare


def put_others(path):
    np.savez(path, other=np.zeros(3, np.float32))


def put_bomb(path):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("layer.9.bias.npy", "w") as member:
        for _ in range(256):
            member.write(bytes(2**20))


def replacing(name, change):
    """Weights of which one array is changed."""

    def replace(path):
        with np.load(path) as archive:
            arrays = dict(archive)
        np.savez(path, **{**arrays, name: change(arrays[name])})

    return replace


def put_code(path):
    """Weights that would run code when unpickled."""
    np.savez(path, other=np.array([print], dtype=object))


def output(make):
    """An output at an impossible path."""
    return lambda bench: {**cloud(bench), "RAILS": make(bench.folder)}


def below_a_file(folder):
    (folder / "file").write_text("no folder")
    return folder / "file" / "rails.gpkg"


def a_folder(folder):
    (folder / "rails.gpkg").mkdir()
    return folder / "rails.gpkg"


def in_a_folder_with_a_colon(folder):
    (folder / "at 10:30").mkdir()
    return folder / "at 10:30" / "rails.gpkg"


def over_the_cloud(bench):
    parameters = cloud(bench)
    return {**parameters, "REPORT": parameters["INPUT"]}


def without_outputs(bench):
    return {**cloud(bench), **dict.fromkeys(("RAILS", "CENTERLINES", "QUALITY", "FINDINGS", "CLEANED"))}


def a_pipe(folder):
    os.mkfifo(folder / "rails.gpkg")
    return folder / "rails.gpkg"


def a_link(folder):
    (folder / "data").mkdir()
    (folder / "rails.gpkg").symlink_to(folder / "data" / "later.gpkg")
    return folder / "rails.gpkg"


def replaced_on_the_way(bench):
    """Another run writes the same output during this one."""

    def replace(percent):
        if not (bench.folder / "rails.gpkg").exists():
            with Destination.at(bench.folder / "rails.gpkg").replacing() as new:
                earlier(new)

    bench.feedback.progressChanged.connect(replace)
    skipped = dict.fromkeys(("CENTERLINES", "QUALITY", "FINDINGS"))
    return {**cloud(bench), **skipped, "RAILS": bench.folder / "rails.gpkg", "CLEANED": bench.folder / "cleaned.tif"}


def removed_on_the_way(bench):
    """The folder of the outputs is deleted during the run."""
    bench.feedback.progressChanged.connect(lambda done: shutil.rmtree(bench.folder / "gone", ignore_errors=True))
    (bench.folder / "gone").mkdir()
    skipped = dict.fromkeys(("CENTERLINES", "QUALITY", "FINDINGS", "CLEANED"))
    return {**cloud(bench), **skipped, "RAILS": bench.folder / "gone" / "rails.gpkg"}


def one_removed_on_the_way(bench):
    """The same for one of two outputs."""
    skipped = dict.fromkeys(("QUALITY", "FINDINGS", "CLEANED"))
    gone = removed_on_the_way(bench)["RAILS"].with_name("tracks.gpkg")
    return {**cloud(bench), **skipped, "RAILS": bench.folder / "rails.gpkg", "CENTERLINES": gone}


def long_track(bench):
    """Six kilometres of track, with stations that take a megabyte."""
    left, middle, right = (
        f"LINESTRING Z (500000 {3000000 + across} 100, 506000 {3000000 + across} 100)" for across in (1.507, 0.7535, 0)
    )
    return {"INPUT": layer_of(middle), "RAILS": layer_of(left, right)}


def earlier(path):
    """An output of an earlier run."""
    before = layer_of("LINESTRING Z (0 0 0, 1 1 1)", "LINESTRING Z (0 0 0, 2 2 2)")
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = QgsVectorFileWriter.driverForExtension(path.suffix)
    QgsVectorFileWriter.writeAsVectorFormatV3(before, str(path), QgsCoordinateTransformContext(), options)
    return path


def open_elsewhere(bench):
    """An output of an earlier run that is open in another program."""
    path = earlier(bench.folder / "out" / "RAILS.gpkg")
    held = QgsVectorLayer(str(path), "held", "ogr").getFeatures()
    assert next(held).isValid()
    bench.run.callback(held.close)
    return cloud(bench)


def edited_elsewhere(bench):
    """An output of an earlier run that is being edited: changes stay in a log until the program closes the file."""
    path = earlier(bench.folder / "rails.gpkg")
    database = sqlite3.connect(path)
    bench.run.callback(database.close)
    assert database.execute("PRAGMA journal_mode = WAL").fetchone() == ("wal",)
    database.execute("CREATE TABLE mine (number)")
    return {**cloud(bench), "RAILS": path}


def indexed_before(bench):
    """A shapefile of an earlier run with a spatial index of its old lines."""
    path = earlier(bench.folder / "out" / "RAILS.shp")
    ogr.Open(str(path), 1).ExecuteSQL("CREATE SPATIAL INDEX ON RAILS")
    assert path.with_suffix(".qix").exists()
    return {**cloud(bench), "RAILS": path}


def failing(module, name, error):
    """A function of a module raises an error."""

    def prepare(bench):
        def fail(*arguments, **named):
            raise error

        bench.patch.setattr(module, name, fail)
        return cloud(bench)

    return prepare


def divided(bench):
    """Two tiles, which are read by two workers however small they are."""
    (bench.folder / "tiles").mkdir()
    for number in range(2):
        bench.cloud(bench.track(length_m=6.0) + [6.0 * number, 0.0, 0.0], f"tiles/{number}.las")
    bench.patch.setattr(processes, "WORTH_S", 0.0)
    return {"INPUT": bench.folder / "tiles", "ITERATIONS": 1, "WORKERS": 2}


def ended_workers(bench):
    """The system ends worker processes, as Linux does if memory is short."""
    bench.patch.setattr(worker.Worker, "send", lambda self, *task: os.kill(self.number, signal.SIGKILL))
    return divided(bench)


def unknown_interpreter(bench):
    """The Python program of QGIS is not found."""

    def fail():
        raise RailExtractError("The Python program of this QGIS was not found.")

    bench.patch.setattr(parameter_values, "known_interpreter", fail)
    return divided(bench)


class Panic(BaseException):
    """As libraries written in Rust raise it."""


FAULTS = {
    "extractrails": {
        "every worker process is ended from outside": ended_workers,
        "worker processes cannot be started": unknown_interpreter,
        "missing package laspy": without("laspy"),
        "missing package of the chosen engine": without_engine,
        "missing weights": with_weights(lambda path: path.unlink()),
        "weights of a different network": with_weights(put_others),
        "weights that take 256 MB when they are unpacked": with_weights(put_bomb),
        "weights with NaN": with_weights(replacing("layer.9.bias", lambda array: array * np.nan)),
        "weights with values missing": with_weights(replacing("layer.9.bias", lambda array: array[:0])),
        "weights that contain code": with_weights(put_code),
        "output in a folder that is a file": output(below_a_file),
        "output in a missing folder": output(lambda folder: folder / "gone" / "rails.gpkg"),
        "output that is a folder": output(a_folder),
        "output that is a named pipe": output(a_pipe),
        "output that is a symbolic link to a file": output(a_link),
        "output replaced by another run during the run": replaced_on_the_way,
        "GeoPackage with an escaped space in its name": output(lambda folder: folder / "a%20b.gpkg"),
        "GeoPackage with a reserved name": output(lambda folder: folder / "gpkg_rails.gpkg"),
        "output with a name that no file can have": lambda bench: {
            **cloud(bench),
            "REPORT": f"{bench.folder}/a\0b.html",
        },
        "layer in a folder with a colon": output(in_a_folder_with_a_colon),
        "report with the name of the cloud": over_the_cloud,
        "output of a format without heights": output(lambda folder: folder / "rails.tab"),
        "no output at all": without_outputs,
        "folder of one output deleted during the run": one_removed_on_the_way,
        "output with spaces, umlauts and kanji": output(lambda folder: folder / "Schienen größer 線路.gpkg"),
        "output of an earlier run, open in another program": open_elsewhere,
        "output of an earlier run, being edited in another program": edited_elsewhere,
        "shapefile of an earlier run, with a spatial index": indexed_before,
        "not enough memory": failing(drawing, "clean_square", MemoryError()),
        "unforeseen error in the search for packages": failing(base, "missing_packages", OSError("gone")),
        "unforeseen error in the check of the values": failing(base, "check_values", ZeroDivisionError("by 0")),
        "unforeseen error in the run": failing(drawing, "clean_square", OverflowError("too large")),
        "unforeseen error that is not an Exception": failing(drawing, "clean_square", Panic("two\nlines")),
        "unforeseen error that ends programs": failing(drawing, "clean_square", SystemExit(3)),
        "cancelled at 0 %": cancelled(cloud, 0),
        "cancelled at 20 %": cancelled(cloud, 20),
        "cancelled at 40 %": cancelled(cloud, 40),
        "cancelled at 60 %": cancelled(cloud, 60),
        "cancelled at 90 %": cancelled(cloud, 90),
    },
    "rasterizerailpoints": {
        "full disk, GeoTIFF": full_disk(points_only, 1000, ".tif"),
    },
    "measuretrackgeometry": {
        "full disk, GeoPackage that cannot be created": full_disk(long_track, 50_000, ".gpkg"),
        "full disk, GeoPackage that cannot be completed": full_disk(long_track, 200_000, ".gpkg"),
    },
}


@pytest.mark.parametrize("fault", faults("Environment", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)


def test_a_bad_cloud_in_a_batch_does_not_affect_the_others(run_step, bench):
    good, other = (bench.cloud(bench.track(length_m=6.0), name) for name in ("1.las", "3.las"))
    bad = bench.folder / "2.las"
    bad.write_bytes(b"no cloud")
    runs = [
        run_step("rasterizerailpoints", {"INPUT": path, "OUTPUT": path.with_suffix(".tif")})
        for path in (good, bad, other)
    ]
    assert [run.ok for run in runs] == [True, False, True]
    assert runs[1].error.startswith("2.las is not a LAS or LAZ file")
    assert sorted(path.name for path in bench.folder.glob("*.tif")) == ["1.tif", "3.tif"]


def test_the_traceback_of_an_unforeseen_error_goes_into_the_log(run_step, bench):
    logged = []
    log = QgsApplication.messageLog()
    log.messageReceived[str, str, Qgis.MessageLevel].connect(lambda *message: logged.append(message))
    run_step("extractrails", {**failing(drawing, "clean_square", Panic("here"))(bench), "RAILS": "memory:"})
    (text,) = [text for text, tab, _ in logged if tab == "Rail Extract"]
    assert text.startswith("Traceback")
    assert text.endswith("Panic: here\n")


def test_every_section_of_the_page_has_its_tests():
    modules = Path(__file__).parent.glob("test_faults_*.py")
    tested = [re.search(r'faults\("(.*?)", FAULTS\)', path.read_text(encoding="utf-8"))[1] for path in modules]
    assert sorted(tested) == sorted(titles())
