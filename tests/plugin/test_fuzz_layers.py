"""Damaged rasters and arbitrary lines: they are read, or refused with a sentence."""

import math

import fuzz
import pytest
from fuzzing.kinds import PLUGIN
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from memory_layers import layer_of
from qgis.core import QgsGeometry, QgsLineString, QgsPoint

BOUNDED = settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.mark.parametrize("kind", PLUGIN, ids=lambda kind: kind.name)
def test_damaged_files_are_read_or_refused(kind):
    counts, failures = fuzz.fuzz(kind, range(60))
    assert failures == {}
    assert counts[fuzz.READ] + counts[fuzz.REFUSED] == 60


NUMBER = st.one_of(
    st.floats(0, 20), st.sampled_from([0.0, 1.507, 10.0]), st.floats(-1e9, 1e9), st.sampled_from([math.nan, math.inf])
)
LINE = st.lists(st.tuples(NUMBER, NUMBER, NUMBER), min_size=0, max_size=6)


@BOUNDED
@given(lines=st.lists(LINE, min_size=0, max_size=4))
def test_arbitrary_lines(run_step, lines):
    lines = [[QgsPoint(500_000 + x, 3_000_000 + y, z) for x, y, z in line] for line in lines]
    layer = layer_of(*(QgsGeometry(QgsLineString(line)) for line in lines))
    run = run_step("buildtrackcenterlines", {"INPUT": layer, "OUTPUT": "memory:"})
    assert "Traceback" not in run.error
    assert run.ok or run.error
    assert not run.ok or run.results["CENTERLINE_LENGTH"] >= 0
