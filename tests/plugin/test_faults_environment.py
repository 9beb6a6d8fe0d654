"""Faults of the environment: packages, weights, disks, other programs, cancelling."""

import os
import shutil
import signal
import sqlite3
import zipfile

import faults
import numpy as np
import pytest
from faults import FINE, Fault, refused
from memory_layers import layer_of
from osgeo import ogr
from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateTransformContext,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from rail_extract.core import pipeline
from rail_extract.core.disk import Destination
from rail_extract.core.errors import RailExtractError
from rail_extract.core.frpdf import engine, models
from rail_extract.core.workers import process, runner
from rail_extract.rail_extract_plugin.algorithms import base
from rail_extract.rail_extract_plugin.dialog import parameter_values
from rail_extract.rail_extract_plugin.setup import dependencies

resource = pytest.importorskip("resource", reason="only Unix limits the size of files")

TITLE = "Environment"

MEASURE = "measuretrackgeometry"
TRACK = {"RAIL_COUNT": 2, "CENTERLINE_COUNT": 1}


def cloud(bench):
    return {"INPUT": bench.cloud(bench.track(length_m=6.0)), "ITERATIONS": 1}


def without(*modules):
    """A Python without some packages."""

    def prepare(bench):
        find_spec = dependencies.find_spec
        for module in (dependencies, engine):
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


def halve(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


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


def a_loop(folder):
    (folder / "rails.gpkg").symlink_to(folder / "rails.gpkg")
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


def cancelled(percent):
    """The user cancels at this progress."""

    def prepare(bench):
        bench.feedback.progressChanged.connect(lambda done: bench.feedback.cancel() if done >= percent else None)
        return cloud(bench)

    return prepare


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


def long_track():
    """Six kilometres of track, with stations that take a megabyte."""
    left, middle, right = (
        f"LINESTRING Z (500000 {3000000 + across} 100, 506000 {3000000 + across} 100)" for across in (1.507, 0.7535, 0)
    )
    return {"INPUT": layer_of(middle), "RAILS": layer_of(left, right)}


def full_disk(room, make, suffix):
    """A disk that takes files of up to `room` bytes; further writing fails as on a full disk."""

    def prepare(bench):
        parameters = make(bench)
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        bench.run.callback(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard)))
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        return {**parameters, "OUTPUT": bench.folder / "out" / f"OUTPUT{suffix}"}

    return prepare


def points_only(bench):
    return {"INPUT": bench.cloud(bench.track(length_m=6.0))}


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
    bench.patch.setattr(runner, "WORTH_S", 0.0)
    return {"INPUT": bench.folder / "tiles", "ITERATIONS": 1, "WORKERS": 2}


def ended_workers(bench):
    """The system ends a worker process, as Linux does if memory is short."""
    bench.patch.setattr(process.Worker, "send", lambda self, *task: os.kill(self.number, signal.SIGKILL))
    return divided(bench)


def unknown_interpreter(bench):
    """The Python program of QGIS is not found."""

    def fail():
        raise RailExtractError("The Python program of this QGIS was not found.")

    bench.patch.setattr(parameter_values, "known_interpreter", fail)
    return divided(bench)


class Panic(BaseException):
    """As libraries written in Rust raise it."""


FAULTS = [
    refused(
        "a worker process is ended from outside",
        ended_workers,
        "Reading ….las failed, because its worker process ended: close other programs that take memory, or set "
        "WORKERS to 1.",
    ),
    Fault("worker processes cannot be started", unknown_interpreter, FINE, gives=TRACK),
    refused(
        "missing package laspy",
        without("laspy"),
        "Extract rails needs the Python package laspy, which this QGIS does not have: run Install packages "
        "in the toolbox under Rail Extract, or …",
    ),
    refused(
        "missing packages torch and cv2",
        without("torch", "cv2"),
        "Extract rails needs the Python package cv2, which this QGIS does not have: run Install packages in "
        "the toolbox under Rail Extract, or …",
    ),
    refused(
        "missing package of the chosen engine",
        without_engine,
        "ENGINE TORCH needs the package torch: install it, or set ENGINE to AUTO.",
    ),
    refused(
        "missing weights",
        with_weights(lambda path: path.unlink()),
        "The weights file …/models/frpdf_base.npz is missing: reinstall the plugin.",
    ),
    refused(
        "truncated weights",
        with_weights(halve),
        "The weights file …/models/frpdf_base.npz cannot be read: reinstall the plugin.",
    ),
    refused(
        "text file as weights",
        with_weights(lambda path: path.write_text("weights")),
        "The weights file …/models/frpdf_base.npz cannot be read: reinstall the plugin.",
    ),
    refused(
        "weights of a different network",
        with_weights(put_others),
        "The weights file does not belong to FRPDF ('layer.0.0.0.weight'): reinstall the plugin.",
    ),
    refused(
        "weights that take 256 MB when they are unpacked",
        with_weights(put_bomb),
        "The weights file …/models/frpdf_base.npz cannot be read: reinstall the plugin.",
    ),
    *(
        refused(
            f"weights with {what}",
            with_weights(replacing("layer.9.bias", change)),
            f"The weights file {said}: reinstall the plugin.",
        )
        for what, change, said in (
            (
                "NaN",
                lambda array: array * np.nan,
                "does not belong to FRPDF (layer.9.bias contains a value that is not a number)",
            ),
            ("complex numbers", lambda array: array * 1j, "…/models/frpdf_base.npz cannot be read"),
            (
                "values missing",
                lambda array: array[:0],
                "does not belong to FRPDF (layer.9.bias has the shape (0,) instead of (1,))",
            ),
        )
    ),
    refused(
        "weights that contain code",
        with_weights(put_code),
        "The weights file …/models/frpdf_base.npz cannot be read: reinstall the plugin.",
    ),
    refused(
        "output in a folder that is a file",
        output(below_a_file),
        "The output …/file/rails.gpkg can't be written (Not a directory): choose another place.",
    ),
    refused(
        "output in a missing folder",
        output(lambda folder: folder / "gone" / "rails.gpkg"),
        "The output …/gone/rails.gpkg can't be written (No such file or directory): choose another place.",
    ),
    refused(
        "output that is a folder",
        output(a_folder),
        "The output …/rails.gpkg is a folder: give the name of a file in it.",
    ),
    refused(
        "output that is a named pipe",
        output(a_pipe),
        "The output …/rails.gpkg is a pipe or a device, not a file: give the name of a file.",
    ),
    refused(
        "output that is a symbolic link to itself",
        output(a_loop),
        "The output …/rails.gpkg can't be written (Too many levels of symbolic links): choose another place.",
    ),
    Fault("output that is a symbolic link to a file", output(a_link), gives=TRACK),
    refused(
        "output replaced by another run during the run",
        replaced_on_the_way,
        "…/rails.gpkg was changed by another program in the meantime. The new file is …/rails_new.gpkg. "
        "Not written: RAILS. Complete: …",
    ),
    refused(
        "GeoPackage with an escaped space in its name",
        output(lambda folder: folder / "a%20b.gpkg"),
        "The output …/a%20b.gpkg can't be opened after it is written, because %20 stands for another character in the "
        "path of a GeoPackage: choose another name.",
    ),
    refused(
        "GeoPackage with a reserved name",
        output(lambda folder: folder / "gpkg_rails.gpkg"),
        "RAILS can't be a table with a name that begins with gpkg, which is reserved in a GeoPackage: choose another "
        "name.",
    ),
    refused(
        "output on a read-only disk",
        output(lambda folder: "/proc/rails.gpkg"),
        "The output /proc/rails.gpkg can't be written (No such file or directory): choose another place.",
    ),
    refused(
        "output with a name that is too long",
        output(lambda folder: folder / f"{'r' * 300}.gpkg"),
        "The output …/rrr….gpkg can't be written (File name too long): choose another place.",
    ),
    refused(
        "output with a name that no file can have",
        lambda bench: {**cloud(bench), "REPORT": f"{bench.folder}/a\0b.html"},
        "The output … can't be written (…): choose another place.",
    ),
    refused(
        "layer in a folder with a colon",
        output(in_a_folder_with_a_colon),
        "RAILS can't be written to …/at 10:30/rails.gpkg, because QGIS takes what comes before the colon for a data "
        "provider: choose a file without a colon in its path.",
    ),
    refused(
        "layer of an unknown data provider",
        output(lambda folder: "EPSG:25832"),
        "RAILS can't be written to EPSG:25832, because QGIS takes what comes before the colon for a data provider: "
        "choose a file without a colon in its path.",
    ),
    refused("report with the name of the cloud", over_the_cloud, "REPORT can't be cloud.las: let it end in .html."),
    *(
        refused(
            f"output of {what}",
            output(lambda folder, suffix=suffix: folder / f"rails.{suffix}"),
            f"“.{suffix}” files are not supported as outputs for this algorithm: choose another one, such as .gpkg.",
        )
        for suffix, what in (
            ("docx", "an unknown format"),
            ("tab", "a format without heights"),
            ("kml", "a format with a coordinate system of its own"),
        )
    ),
    refused(
        "no output at all",
        without_outputs,
        "No output is chosen: name at least one of RAILS, CENTERLINES, QUALITY, FINDINGS, CLEANED, REPORT.",
    ),
    refused(
        "output folder deleted during the run",
        removed_on_the_way,
        "The output …/gone/rails.gpkg can't be written (No such file or directory): choose another place.",
    ),
    refused(
        "folder of one output deleted during the run",
        one_removed_on_the_way,
        "The output …/gone/tracks.gpkg can't be written (No such file or directory): choose another place. "
        "Not written: CENTERLINES. Complete: RAILS.",
    ),
    Fault(
        "output with spaces, umlauts and kanji",
        output(lambda folder: folder / "Schienen größer 線路.gpkg"),
        gives=TRACK,
    ),
    Fault("output of an earlier run, open in another program", open_elsewhere, gives=TRACK),
    refused(
        "output of an earlier run, being edited in another program",
        edited_elsewhere,
        "…/rails.gpkg is open in another program (rails.gpkg-wal exists): close it there, or choose another file.",
    ),
    Fault("shapefile of an earlier run, with a spatial index", indexed_before, gives=TRACK),
    refused(
        "full disk, GeoTIFF",
        full_disk(1000, points_only, ".tif"),
        "The output …/out/OUTPUT.tif can't be written (…): free space on the disk, or choose another place.",
        run="rasterizerailpoints",
    ),
    refused(
        "full disk, GeoPackage that cannot be created",
        full_disk(50_000, lambda bench: long_track(), ".gpkg"),
        "The output can't be written (…): check the free disk space.",
        run=MEASURE,
    ),
    refused(
        "full disk, GeoPackage that cannot be completed",
        full_disk(200_000, lambda bench: long_track(), ".gpkg"),
        "The output can't be written (0 of 6001 features were written): check the free disk space.",
        run=MEASURE,
    ),
    refused(
        "full disk, shapefile",
        full_disk(50_000, lambda bench: long_track(), ".shp"),
        "The output can't be written (…): check the free disk space.",
        run=MEASURE,
    ),
    refused(
        "full disk, GeoJSON",
        full_disk(50_000, lambda bench: long_track(), ".geojson"),
        "The output can't be written (…): check the free disk space.",
        run=MEASURE,
    ),
    refused(
        "not enough memory",
        failing(pipeline, "clean_square", MemoryError()),
        "Not enough memory: choose a smaller extent.",
    ),
    *(
        refused(
            f"unforeseen error {when}",
            failing(module, name, error),
            f"Rail Extract failed unexpectedly ({said}): report this with the traceback from the log.",
        )
        for when, module, name, error, said in (
            ("in the search for packages", base, "missing_packages", OSError("gone"), "OSError: gone"),
            ("in the check of the values", base, "check_values", ZeroDivisionError("by 0"), "ZeroDivisionError: by 0"),
            ("in the run", pipeline, "clean_square", OverflowError("too large"), "OverflowError: too large"),
            ("that is not an Exception", pipeline, "clean_square", Panic("two\nlines"), "Panic: two lines"),
            ("that ends programs", pipeline, "clean_square", SystemExit(3), "SystemExit: 3"),
        )
    ),
    *(
        refused(f"cancelled at {percent} %", cancelled(percent), "Cancelled; nothing was written.")
        for percent in (0, 10, 20, 40, 60, 80, 90)
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "extractrails")


def test_a_bad_cloud_in_a_batch_does_not_affect_the_others(qgis, plugin, outcome, bench):
    good, other = (bench.cloud(bench.track(length_m=6.0), name) for name in ("1.las", "3.las"))
    bad = bench.folder / "2.las"
    bad.write_bytes(b"no cloud")
    algorithm = qgis.processingRegistry().createAlgorithmById("railextract:rasterizerailpoints")
    runs = [
        outcome(algorithm, {"INPUT": path, "OUTPUT": bench.folder / f"{path.stem}.tif"}) for path in (good, bad, other)
    ]
    assert [run.ok for run in runs] == [True, False, True]
    assert runs[1].error.startswith("2.las is not a LAS or LAZ file")
    assert sorted(path.name for path in bench.folder.glob("*.tif")) == ["1.tif", "3.tif"]


def test_the_traceback_of_an_unforeseen_error_goes_into_the_log(run_step, bench):
    logged = []
    log = QgsApplication.messageLog()
    log.messageReceived[str, str, Qgis.MessageLevel].connect(lambda *message: logged.append(message))
    run_step("extractrails", {**failing(pipeline, "clean_square", Panic("here"))(bench), "RAILS": "memory:"})
    (text,) = [text for text, tab, _ in logged if tab == "Rail Extract"]
    assert text.startswith("Traceback")
    assert text.endswith("Panic: here\n")


def test_the_page_lists_every_fault():
    """If this fails, run tools/faults.py."""
    assert faults.PAGE.read_text(encoding="utf-8") == faults.page()


def test_fault_names_are_unique():
    names = [(title, fault.name) for title, table in faults.tables() for fault in table]
    assert len(names) == len(set(names)) >= 60
