"""Coordinate systems of results outlive the thread that the algorithm ran in."""

import numpy as np
import pytest
from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgRunnerTask,
    QgsProcessingUtils,
    QgsProject,
    QgsRasterLayer,
)
from qgis.PyQt.QtCore import QEventLoop, QThread, QThreadPool

ZONES = iter(range(32601, 32660))
"""Systems that no other test uses, because QGIS caches them."""

SETTLING_MS = 500
"""Time for an ended thread to release its objects of PROJ."""


@pytest.fixture
def run_apart(qgis, plugin, context, new_feedback):
    """Run an algorithm as the dialog does, in a thread of the pool, end the thread, and return the results."""

    def run(name, parameters):
        algorithm = qgis.processingRegistry().createAlgorithmById(f"railextract:{name}")
        parameters = {key: str(value) for key, value in parameters.items()}
        feedback, ended, loop = new_feedback(), [], QEventLoop()
        task = QgsProcessingAlgRunnerTask(algorithm, parameters, context, feedback)
        assert not task.isCanceled(), feedback.errors
        task.executed.connect(lambda ok, results: (ended.append((ok, results)), loop.quit()))
        qgis.taskManager().addTask(task)
        loop.exec()
        for pool in (QThreadPool.globalInstance(), *own_pools()):
            pool.waitForDone()  # also ends the threads, as Qt does after 30 s without work
        QThread.msleep(SETTLING_MS)
        ((ok, results),) = ended
        assert ok, feedback.errors
        for value in results.values():
            layer = context.temporaryLayerStore().mapLayer(value) if isinstance(value, str) else None
            if layer is not None:
                QgsProject.instance().addMapLayer(context.takeResultLayer(value))
        return results

    return run


def own_pools():
    """Thread pools that newer QGIS uses for tasks."""
    manager = QgsApplication.taskManager()
    return [manager.threadPool()] if hasattr(manager, "threadPool") else []


@pytest.fixture
def cloud(write_cloud, track):
    zone = next(ZONES)
    return write_cloud(track(), epsg=zone), f"EPSG:{zone}"


def assert_whole(layer, name):
    """Check the system in files, and the system that QGIS now returns for the same code."""
    assert layer.crs().authid() == name
    assert "UTM zone" in layer.crs().toWkt()
    assert "UTM zone" in QgsCoordinateReferenceSystem(name).toWkt()


OUTPUTS = ("RAILS", "CENTERLINES", "QUALITY")


def test_memory_layers_keep_theirs(run_apart, context, cloud):
    path, name = cloud
    results = run_apart("extractrails", {"INPUT": path, **dict.fromkeys(OUTPUTS, "TEMPORARY_OUTPUT")})
    for output in OUTPUTS:
        assert_whole(QgsProcessingUtils.mapLayerFromString(results[output], context), name)


def test_every_step_keeps_its_own(run_apart, context, cloud, tmp_path):
    path, name = cloud
    raster, cleaned = tmp_path / "raster.tif", tmp_path / "cleaned.tif"
    run_apart("rasterizerailpoints", {"INPUT": path, "OUTPUT": raster})
    assert_whole(QgsRasterLayer(str(raster)), name)
    run_apart("frpdfcleanup", {"INPUT": raster, "OUTPUT": cleaned})
    assert_whole(QgsRasterLayer(str(cleaned)), name)
    rails = run_apart("vectorizerails", {"INPUT": cleaned, "POINTS": path, "OUTPUT": "TEMPORARY_OUTPUT"})["OUTPUT"]
    lines = run_apart("buildtrackcenterlines", {"INPUT": rails, "OUTPUT": "TEMPORARY_OUTPUT"})["OUTPUT"]
    measured = {"INPUT": lines, "RAILS": rails, "POINTS": path, "OUTPUT": "TEMPORARY_OUTPUT"}
    for made in (rails, lines, run_apart("measuretrackgeometry", measured)["OUTPUT"]):
        assert_whole(QgsProcessingUtils.mapLayerFromString(made, context), name)


def test_a_cloud_without_one_takes_that_of_the_raster(run_apart, context, write_cloud, track, tmp_path):
    zone = next(ZONES)
    paths = [write_cloud(track(), f"{epsg}.las", epsg=epsg) for epsg in (zone, None)]
    run_apart("rasterizerailpoints", {"INPUT": paths[0], "OUTPUT": tmp_path / "raster.tif"})
    step = {"INPUT": tmp_path / "raster.tif", "POINTS": paths[1], "OUTPUT": "TEMPORARY_OUTPUT"}
    layer = QgsProcessingUtils.mapLayerFromString(run_apart("vectorizerails", step)["OUTPUT"], context)
    assert_whole(layer, f"EPSG:{zone}")


def test_metres_of_a_cloud_without_one_stay_known(run_apart, context, write_cloud, track):
    results = run_apart("extractrails", {"INPUT": write_cloud(track(), epsg=None), "RAILS": "TEMPORARY_OUTPUT"})
    layer = QgsProcessingUtils.mapLayerFromString(results["RAILS"], context)
    assert "metre" in layer.crs().toWkt() and not np.isnan(layer.extent().width())
