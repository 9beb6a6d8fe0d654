"""The limits in the report, in QtWebKit where it is installed: what the reader enters is counted at once."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from rail_extract.core.frame import LocalFrame
from rail_extract.core.rails import Centerline, RailNetwork, TrackGeometry
from rail_extract.core.report import build_page

COUNT = 101

BROWSER = """
import json, os, sys
try:
    from PyQt5.QtWebKitWidgets import QWebPage
    from PyQt5.QtWidgets import QApplication
except ImportError:
    os._exit(77)
application, page = QApplication([]), QWebPage()
page.mainFrame().setHtml(open(sys.argv[1], encoding="utf-8").read())
for quantity, limit in json.loads(sys.argv[2]):
    page.mainFrame().evaluateJavaScript(
        "var field = document.querySelector('input[data-limit=%s]');"
        "if ('%s' != 'None') { field.value = '%s'; field.onchange(); }" % (quantity, limit, limit)
    )
    cells = (
        "[].map.call(document.querySelector('tr[data-quantity=%s]').cells,"
        "function (one) { return one.textContent })"
    )
    print(json.dumps(page.mainFrame().evaluateJavaScript(cells % quantity)))
sys.stdout.flush()
os._exit(0)  # WebKit crashes where Python removes it
"""
"""Enters limits one by one; None leaves the one of the run. Prints the cells of the row after each."""


def report():
    """The report on a track whose gauge and twist grow along it."""
    along, plain, none = np.arange(float(COUNT)), np.zeros(COUNT), np.full(COUNT, np.nan)
    xyz = np.column_stack([along, plain, plain])
    profiles = {"gauge_mm": 1435 + 0.2 * along, "cant_mm": plain, "twist_mm": 0.1 * along, "radius_m": none}
    profiles |= {"grade_pm": plain, "sigma_mm": plain + 1.5, "points": np.full(COUNT, 100), "strip_mm": none}
    profiles |= {"bridged": np.zeros(COUNT, bool), "strips": np.ones(COUNT, int), "sigmaz_mm": plain + 0.5}
    geometry = TrackGeometry(1, xyz, along, **profiles)
    line = Centerline(xyz, 1, 10, (1,), (2,), 1435.0, 1.0, 0.0, 0.0, 0.0)
    return build_page(RailNetwork((), (line,), LocalFrame(np.zeros(3)), "", (geometry,)), (1.435,), "cloud.laz")


def test_a_limit_that_is_entered_is_counted(tmp_path):
    (tmp_path / "report.html").write_text(report(), encoding="utf-8")
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
    command = [sys.executable, "-c", BROWSER, str(tmp_path / "report.html"), json.dumps(list(steps))]
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    if ended.returncode == 77:
        pytest.skip("QtWebKit is not installed.")
    found = [json.loads(line)[2:] for line in ended.stdout.splitlines()]
    assert dict(zip(steps, found)) == steps, ended.stderr
