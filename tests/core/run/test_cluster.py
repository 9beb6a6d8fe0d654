"""Extraction on real workers: the lines of one process, even if workers die, disks are full or versions differ."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from distributed import Client, KilledWorker, LocalCluster
from heard import Heard
from rail_extract.core.clouds.points import ask, read_rail_points
from rail_extract.core.pipeline import Parameters, extract_files, extract_rails
from rail_extract.core.pipeline.sources import Classified
from rail_extract.core.progress import SILENT
from rail_extract.core.rails import RailLine
from rail_extract.core.run.cluster import Cluster, execute
from rail_extract.core.run.tasks import InTurn, Runner, Task, version
from rail_extract.core.squares.kept import KeptResults
from rail_extract.core.squares.steps import square_side
from rail_extract.core.standards import STANDARDS
from rail_extract.core.tiles.grid import lay_out
from rail_extract.core.tiles.store import spool
from rail_extract.laboratory.scenes.scene import RAIL

STANDARD = STANDARDS["EN_60E1_1435"]
PARAMETERS = Parameters(
    STANDARD.gauge_m,
    STANDARD.head_width_m,
    passes=1,
    engine="OPENCV",
    square_tiles=4,
    quality_step_m=1.0,
    keep_cleaned=True,
)


@pytest.fixture(scope="module")
def one_process(tiles):
    return extract_rails(read_rail_points(tiles, [RAIL]), PARAMETERS)


@pytest.fixture(params=["in turn", "on workers"])
def executor(request):
    """Whatever executes tasks, the same results are kept."""
    return InTurn() if request.param == "in turn" else Cluster(request.getfixturevalue("client"))


def extract(executor, paths, folder, progress=SILENT):
    """Extract as the command does."""
    runner = Runner(executor, KeptResults(folder), tolerant=True)
    return extract_files(
        Classified(ask(paths, [RAIL], unreadable=runner.failures)), folder, PARAMETERS, runner, progress
    )


def same(found, expected, frame, other):
    """Check that lines, ids and figures agree, coordinates to a tenth of a millimetre."""
    assert len(found) == len(expected)
    for one, two in zip(found, expected):
        np.testing.assert_allclose(frame.to_crs(one.xyz), other.to_crs(two.xyz), rtol=0, atol=1e-4)
        for name in ("rail_id", "points", "sigma_mm", "track_id", "left_ids", "gauge_mm", "bridged_m"):
            assert getattr(one, name, None) == pytest.approx(getattr(two, name, None), abs=0.01)


def test_a_local_worker_uses_one_core_and_keeps_its_memory(client):
    found = client.run(lambda: (os.environ["OMP_NUM_THREADS"], os.environ["MALLOC_TRIM_THRESHOLD_"]))
    assert list(found.values()) == [("1", "268435456")] * 2


def test_workers_give_the_results_of_one_process(tiles, one_process, client, tmp_path):
    found = extract(Cluster(client), [tiles], tmp_path)
    assert found.failures == ()
    same(found.rails, one_process.rails, found.frame, one_process.frame)
    same(found.centerlines, one_process.centerlines, found.frame, one_process.frame)
    assert len(found.rails) == 2 and len(found.centerlines) == 1
    assert sum(rail.length_m for rail in found.rails) == pytest.approx(100, abs=1)
    assert found.engine == one_process.engine
    for one, two in zip(found.geometry, one_process.geometry):
        for name in ("chainage_m", "gauge_mm", "cant_mm", "radius_m", "sigma_mm", "points"):
            np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=1e-4, atol=0.01)
    assert len(found.geometry) == 1
    assert found.cleaned_classes == one_process.cleaned_classes == (RAIL,)
    np.testing.assert_array_equal(found.cleaned[0].cells(), one_process.cleaned[0].cells())


def test_a_restart_computes_only_what_changed(tiles, executor, tmp_path):
    extract(executor, [tiles / "tile0.laz", tiles / "tile1.laz"], tmp_path)
    before = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}
    extract(executor, [tiles / "tile0.laz", tiles / "tile1.laz"], tmp_path)
    assert {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()} == before
    extract(executor, [tiles], tmp_path)
    after = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}
    assert before.items() <= after.items()
    assert len([file for file in after.keys() - before.keys() if file.name.startswith("clean")]) > 0


def test_a_killed_worker_is_replaced_and_its_tasks_run_again(tiles, one_process, client, tmp_path):
    killed = []

    def kill(client):
        while not killed:
            busy = [
                worker
                for worker, tasks in client.processing().items()
                if any("Cleaning" in str(task) for task in tasks)
            ]
            pids = client.run(os.getpid, workers=busy[:1]) if busy else {}
            for pid in pids.values():
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
            time.sleep(0.01)

    killer = threading.Thread(target=kill, args=(client,), daemon=True)
    killer.start()
    found = extract(Cluster(client), [tiles], tmp_path)
    killer.join(timeout=5)
    assert len(killed) == 1
    assert found.failures == ()
    same(found.rails, one_process.rails, found.frame, one_process.frame)


@pytest.fixture
def lone_worker():
    """A worker in this process."""
    with LocalCluster(processes=False, n_workers=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        yield client


def die(task, *arguments):
    raise KilledWorker(task.label, None, 10)


def test_the_neighbours_of_a_square_that_kills_its_workers_are_drawn(tiles, lone_worker, tmp_path, monkeypatch):
    submit = lone_worker.submit

    def submit_dying(function, task, *arguments, **named):
        is_doomed = task.label == f"Cleaning square {doomed} of class 10"
        return submit(die if is_doomed else function, task, *arguments, **named)

    doomed = max(square_keys(tiles, tmp_path))
    monkeypatch.setattr(lone_worker, "submit", submit_dying)
    found = extract(Cluster(lone_worker), [tiles], tmp_path / "work")
    assert len(found.failures) == 1
    assert found.failures[0].startswith(f"Cleaning square {doomed} of class 10 was abandoned")
    assert len(found.rails) == 2
    assert 20 < found.rails[0].length_m < 45


def square_keys(tiles, folder):
    (source,) = spool(ask([tiles], [RAIL]), square_side(PARAMETERS), folder)
    return [square.key for square in lay_out([source], source)]


def test_damaged_results_are_computed_again_with_a_warning(tiles, one_process, executor, tmp_path):
    extract(executor, [tiles], tmp_path)
    sizes = {file: file.stat().st_size for file in tmp_path.glob("*.npz")}
    cleaned, drawn = (sorted(tmp_path.glob(f"{step}_*"))[0] for step in ("clean", "draw"))
    cleaned.write_bytes(cleaned.read_bytes()[:-30])
    drawn.write_bytes(b"not an archive")
    points = sorted(tmp_path.glob("*/10_*"))[0]
    points.write_bytes(points.read_bytes()[:-24])
    heard = Heard()
    for _ in range(2):
        found = extract(executor, [tiles], tmp_path, heard)
        assert found.failures == ()
        same(found.rails, one_process.rails, found.frame, one_process.frame)
    assert len(heard.warnings) == 3  # all from the first restart
    assert (
        len([text for text in heard.warnings if "the stored result is damaged, so it is computed again" in text]) == 2
    )
    assert len([text for text in heard.warnings if text.startswith("The stored points of tile")]) == 1
    assert {file: file.stat().st_size for file in tmp_path.glob("*.npz")} == sizes


def first_of(name, context):
    """Stand for any step of the walk."""
    return (RailLine(np.zeros((2, 3)), 1, 10, 5, 1.0, 1.0, 0.0),)


def test_no_step_runs_on_a_worker_of_another_version(tmp_path):
    task = KeptResults(tmp_path).kept(Task("Cleaning", first_of, ("a",)))
    assert "another version" in str(execute(task, {}, "older").error)
    assert list(tmp_path.iterdir()) == []
    assert execute(task, {}, version()).result.path.endswith(".npz")
    assert execute(task, {}, "older").error  # although the result is there
