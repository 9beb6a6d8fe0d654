"""Libraries compute on one thread while a run lasts, and have their threads back afterwards."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest
from rail_extract.__main__ import _run
from rail_extract.core.frpdf.cleanup import clean, make_engine
from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.frpdf.weights import load_arrays
from rail_extract.core.kernels import ENVIRONMENT, Library, _beside, _openblas, blas, cores, one_thread, threads
from rail_extract.core.progress import Progress
from rail_extract.core.raster import rasterize


class Counter:
    """A library whose number of threads is a number."""

    def __init__(self, threads):
        self.threads = threads
        self.library = Library(f"counter {id(self)}", lambda: self.threads, self._set)

    def _set(self, threads):
        self.threads = threads


class Listener(Progress):
    """Notes the threads of a library whenever a run reports."""

    def __init__(self, library):
        self.library, self.seen = library, set()

    def set_fraction(self, fraction):
        self.seen.add(self.library.get())


@pytest.fixture
def on_two_threads():
    """Give libraries two threads for the length of a test."""
    before = []

    def give(*libraries):
        for library in libraries:
            before.append((library, library.get()))
            library.set(2)
        return libraries

    yield give
    for library, count in before:
        library.set(count)


def test_the_blas_of_numpy_and_scipy_has_one_thread_for_the_length_of_a_run(on_two_threads):
    libraries = on_two_threads(*blas())
    assert libraries
    with one_thread(*libraries):
        assert {library.get() for library in libraries} == {1}
    assert {library.get() for library in libraries} == {2}


def test_a_library_beside_its_package_is_the_one_that_is_loaded(on_two_threads):
    brought = [library for package in ("numpy", "scipy") for file in _beside(package) for library in _openblas(file)]
    if not brought:
        pytest.skip("numpy and scipy use the BLAS of the system here")
    assert set(brought) <= set(blas())
    on_two_threads(*brought)
    with one_thread(*blas()):
        assert {library.get() for library in brought} == {1}


def test_the_last_of_overlapping_runs_restores_the_threads():
    one, inside, go_on = Counter(7), threading.Event(), threading.Event()

    def run():
        with one_thread(one.library):
            inside.set()
            go_on.wait(10)

    other = threading.Thread(target=run)
    with one_thread(one.library):
        other.start()
        assert inside.wait(10)
    assert one.threads == 1
    go_on.set()
    other.join()
    assert one.threads == 7


def test_a_run_that_fails_restores_the_threads():
    one = Counter(4)
    with pytest.raises(ZeroDivisionError), one_thread(one.library):
        assert one.threads == 1 / 0
    assert one.threads == 4


@pytest.mark.parametrize("name", ["TORCH", "OPENCV"])
def test_the_network_computes_on_one_thread(name, on_two_threads):
    if name == "TORCH":
        pytest.importorskip("torch")
    engine = make_engine(load_arrays(MODELS[0].path), name, "CPU")
    (library,) = on_two_threads(engine.library)
    listener = Listener(library)
    x = np.arange(0, 4, 0.01)
    clean(rasterize(np.column_stack([x, np.zeros_like(x)]), 0.04), engine, 1, listener)
    assert 1 in listener.seen
    assert library.get() == 2


def test_a_command_runs_on_one_thread(on_two_threads):
    libraries = on_two_threads(*blas())
    seen = []
    assert _run(SimpleNamespace(run=lambda _: seen.extend(library.get() for library in libraries))) == 0
    assert seen == [1] * len(libraries)
    assert {library.get() for library in libraries} == {2}


@pytest.mark.parametrize(("limit", "most"), [("1", 1), ("2", 2), ("all", 64), ("0", 64)])
def test_a_process_computes_on_the_threads_that_its_environment_allows(monkeypatch, limit, most):
    monkeypatch.setenv("OMP_NUM_THREADS", limit)
    assert 1 <= threads() <= min(cores(), most)


def test_a_worker_process_computes_on_one_thread(monkeypatch):
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    assert threads() == 1
