"""OpenCV without enough memory is asked for less, and the run ends if that does not help."""

import cv2
import numpy as np
import pytest
from rail_extract.core.frpdf import cleanup
from rail_extract.core.frpdf.layered import MIN_CELLS, LayeredEngine
from rail_extract.core.frpdf.opencv_engine import OpenCvEngine
from rail_extract.core.progress import Progress
from rail_extract.core.raster import RailRaster

RASTER = RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.column_stack([np.zeros(50), np.arange(50)]).astype(int))


class Listener(Progress):
    def __init__(self):
        self.warnings = []

    def warning(self, text):
        self.warnings.append(text)


def ask_numpy():
    np.empty(1 << 60, dtype=np.uint8)


def ask_opencv():
    side = 1 << 30
    cv2.copyMakeBorder(np.zeros((1, 1), np.uint8), 0, side, 0, side, cv2.BORDER_CONSTANT)


def exhausted(arrays, ask, times):
    """An engine that asks for more memory than any computer has, the first few times that it loads an array."""
    engine = OpenCvEngine(arrays)
    load, left = engine._load, [times]

    def ask_and_load(array):
        if left[0]:
            left[0] -= 1
            ask()
        return load(array)

    engine._load = ask_and_load
    return engine


@pytest.mark.parametrize("ask", [ask_numpy, ask_opencv])
@pytest.mark.parametrize("times", [1, 2])
def test_smaller_parts_give_the_same_result(random_arrays, ask, times):
    expected = cleanup.clean(RASTER, OpenCvEngine(random_arrays), passes=1)
    engine, listener = exhausted(random_arrays, ask, times), Listener()
    found = cleanup.clean(RASTER, engine, passes=1, progress=listener)
    np.testing.assert_array_equal(found.cells(), expected.cells())
    assert listener.warnings == times * ["The computer has too little free memory: continuing with smaller parts."]
    assert engine.max_cells == LayeredEngine.max_cells // 4**times


def test_too_little_memory_for_the_smallest_parts_ends_the_run(random_arrays):
    engine = exhausted(random_arrays, ask_opencv, 100)
    with pytest.raises(MemoryError):
        cleanup.clean(RASTER, engine, passes=1)
    assert MIN_CELLS <= engine.max_cells < 4 * MIN_CELLS


def test_other_errors_are_passed_on(random_arrays):
    engine = exhausted(random_arrays, lambda: cv2.imdecode(None, 0), 1)
    with pytest.raises(cv2.error):
        cleanup.clean(RASTER, engine, passes=1)
