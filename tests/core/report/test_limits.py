"""Lengths beyond limits: counted as by station, and the limits of the run are those of the findings."""

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rail_extract.core.frame import LocalFrame
from rail_extract.core.rails import Centerline, RailNetwork, TrackGeometry
from rail_extract.core.report.findings import OFF_GAUGE, examine
from rail_extract.core.report.limits import MAX_LIMIT_MM, QUANTITIES, lengths_beyond, limits_table
from rail_extract.core.report.markup import metres

COUNT = 101


@given(values=arrays(float, st.integers(0, 30), elements=st.floats(0, 900, width=32) | st.just(np.nan)))
def test_lengths_are_those_of_the_stations_beyond_each_limit(values):
    length_m = np.arange(1.0, len(values) + 1)
    found = lengths_beyond(values, length_m)
    assert len(found) <= MAX_LIMIT_MM + 1
    for limit in range(MAX_LIMIT_MM + 1):
        expected = length_m[np.nan_to_num(values, nan=-1.0) > limit].sum()
        assert (found[limit] if limit < len(found) else 0.0) == expected


def track_findings():
    """A track of 100 m with 20 m off gauge, twist to either side, and 5 m without points."""
    along = np.arange(float(COUNT))
    gauge_mm, cant_mm = np.full(COUNT, 1435.0), np.full(COUNT, -30.0)
    gauge_mm[40:60] = 1420.0
    bridged = np.zeros(COUNT, dtype=bool)
    bridged[90:95] = True
    gauge_mm[90:95], twist_mm = 1800.0, np.linspace(-8.0, 8.0, COUNT)
    plain, none = np.zeros(COUNT), np.full(COUNT, np.nan)
    xyz = np.column_stack([along, plain, plain])
    geometry = TrackGeometry(
        track_id=1,
        xyz=xyz,
        chainage_m=along,
        gauge_mm=gauge_mm,
        cant_mm=cant_mm,
        twist_mm=twist_mm,
        radius_m=none,
        grade_pm=plain,
        sigma_mm=np.full(COUNT, 1.5),
        points=np.full(COUNT, 100),
        bridged=bridged,
        strips=np.ones(COUNT, dtype=int),
        strip_mm=none,
        sigmaz_mm=np.full(COUNT, 0.5),
    )
    line = Centerline(xyz, 1, 10, (1,), (2,), 1435.0, 1.0, 0.0, 0.0, 0.0)
    return line, geometry


def network(line, geometry):
    return RailNetwork((), (line,), LocalFrame(np.zeros(3)), "", (geometry,))


def rows_of(html):
    """Cells of each row, by quantity."""
    rows = re.findall(r'<tr data-quantity="(\w+)"(.*?)</tr>', html)
    return {name: re.findall("<td>(.*?)</td>", row) for name, row in rows}


def test_the_limits_of_the_run_are_those_of_the_findings():
    findings = examine(network(*track_findings()), (1.435,))
    rows = rows_of(limits_table(findings.tracks))
    assert list(rows) == [one.name for one in QUANTITIES]
    assert rows["gauge"][2:] == ["15.0 mm", "40.0 m", "20 m", "21.1 %"]
    assert rows["gauge"][4] == metres(findings.length_of(OFF_GAUGE))
    assert rows["cant"][2:] == ["30.0 mm", "0.0 m", "", ""]
    assert rows["twist"][2:] == ["8.0 mm", "0.0 m", "", ""]
    assert rows["sigma"][4:] == ["0.0 m", "0.0 %"]


def test_a_track_without_values_has_an_empty_row():
    line, geometry = track_findings()
    geometry.twist_mm[:] = np.nan
    rows = rows_of(limits_table(examine(network(line, geometry), (1.435,)).tracks))
    assert rows["twist"][2:] == ["", "", "", ""]
