"""Lengths beyond limits: counted as by station, and the limits of the run are those of the findings."""

import re

import numpy as np
from built import ORIGIN, centerline_of, geometry_of
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rail_extract.core.checks.findings import OFF_GAUGE, examine
from rail_extract.core.progress import metres
from rail_extract.core.rails import RailNetwork
from rail_extract.core.report import build_page
from rail_extract.core.report.limits import MAX_LIMIT_MM, QUANTITIES, lengths_beyond, limits_table

COUNT = 101


@given(values=arrays(float, st.integers(0, 30), elements=st.floats(0, 900, width=32) | st.just(np.nan)))
def test_lengths_are_those_of_the_stations_beyond_each_limit(values):
    length_m = np.arange(1.0, len(values) + 1)
    found = lengths_beyond(values, length_m)
    assert len(found) <= MAX_LIMIT_MM + 1
    for limit in range(MAX_LIMIT_MM + 1):
        expected = length_m[np.nan_to_num(values, nan=-1.0) > limit].sum()
        assert (found[limit] if limit < len(found) else 0.0) == expected


def track(**profiles):
    """A track of 100 m with 20 m off gauge, twist to either side, and 5 m without points, but for `profiles`."""
    along, plain = np.arange(float(COUNT)), np.zeros(COUNT)
    gauge_mm, bridged = np.full(COUNT, 1435.0), np.zeros(COUNT, dtype=bool)
    gauge_mm[40:60], gauge_mm[90:95], bridged[90:95] = 1420.0, 1800.0, True
    twist_mm = np.linspace(-8.0, 8.0, COUNT)
    usual = {"gauge_mm": gauge_mm, "cant_mm": plain - 30, "twist_mm": twist_mm, "bridged": bridged, **profiles}
    xyz = np.column_stack([along, plain, plain])
    return centerline_of(xyz), geometry_of(xyz, along, **usual)


def network(line, geometry):
    return RailNetwork((), (line,), ORIGIN, "", (geometry,))


def rows_of(html):
    """Cells of each row, by quantity."""
    rows = re.findall(r'<tr data-quantity="(\w+)"(.*?)</tr>', html)
    return {name: re.findall("<td>(.*?)</td>", row) for name, row in rows}


def test_the_limits_of_the_run_are_those_of_the_findings():
    sigma_mm = np.full(COUNT, 1.5)
    sigma_mm[50:60] = 4.0  # of which four are more than the gauge is off
    unsure = examine(network(*track(sigma_mm=sigma_mm)), (1.435,))
    assert rows_of(limits_table(unsure.tracks))["gauge"][4] == metres(unsure.length_of(OFF_GAUGE)) == "10 m"
    findings = examine(network(*track()), (1.435,))
    rows = rows_of(limits_table(findings.tracks))
    assert list(rows) == [one.name for one in QUANTITIES]
    assert rows["gauge"][2:] == ["15.0 mm", "40.0 m", "20 m", "21.1 %"]
    assert rows["gauge"][4] == metres(findings.length_of(OFF_GAUGE))
    assert rows["cant"][2:] == ["30.0 mm", "0.0 m", "", ""]
    assert rows["twist"][2:] == ["8.0 mm", "0.0 m", "", ""]
    assert rows["sigma"][4:] == ["0.0 m", "0.0 %"]


def test_a_track_without_values_has_an_empty_row():
    rows = rows_of(limits_table(examine(network(*track(twist_mm=np.full(COUNT, np.nan))), (1.435,)).tracks))
    assert rows["twist"][2:] == ["", "", "", ""]


def test_a_limit_that_is_entered_is_counted(in_browser):
    """What the reader enters is counted at once."""
    along, plain = np.arange(float(COUNT)), np.zeros(COUNT)
    rising = track(gauge_mm=1435 + 0.2 * along, cant_mm=plain, twist_mm=0.1 * along, bridged=np.zeros(COUNT, bool))
    steps = {
        ("gauge", None): ["20.0 mm", "100.0 m", "50 m", "49.5 %"],
        ("gauge", "15"): ["20.0 mm", "100.0 m", "25 m", "24.5 %"],
        ("gauge", "10"): ["20.0 mm", "100.0 m", "50 m", "49.5 %"],  # the script counts what the report states
        ("twist", None): ["10.0 mm", "100.0 m", "", ""],
        ("twist", "5"): ["10.0 mm", "100.0 m", "50 m", "49.5 %"],
        ("twist", ""): ["10.0 mm", "100.0 m", "", ""],
        ("sigma", "1"): ["1.5 mm", "0.0 m", "100 m", "100.0 %"],
        ("sigma", "400"): ["1.5 mm", "0.0 m", "0.0 m", "0.0 %"],
    }
    scripts = [(enter(*step) if step[1] is not None else "") + CELLS % step[0] for step in steps]
    found = in_browser(build_page(network(*rising), (1.435,), "cloud.laz"), scripts)
    assert dict(zip(steps, (cells[2:] for cells in found))) == steps


CELLS = "[].map.call(document.querySelector('tr[data-quantity=%s]').cells, function (one) { return one.textContent })"


def enter(quantity, limit):
    """A script that enters a limit."""
    field = f"document.querySelector('input[data-limit={quantity}]')"
    return f"var field = {field}; field.value = '{limit}'; field.onchange();"
