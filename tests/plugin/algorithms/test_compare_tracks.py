"""Lines of two surveys compared in QGIS: fields, states, shift, report and units."""

import numpy as np
import pytest
from memory_layers import layer_of

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
NAMES = (
    "line_id input_id chainage_m state across_mm height_mm gauge_mm cant_mm sigma_mm sigmaz_mm shift_mm shiftz_mm "
    "moved shifted"
)
SPACING_M = 1.507


def layer(lines, fields="", values=(), crs="EPSG:32643", unit_m=1.0, kind="LineStringZ"):
    """Make a layer of lines, (n, 3) metres from the corner."""
    shapes = [(np.asarray(line) / unit_m + CORNER)[:, : 3 if kind.endswith("Z") else 2] for line in lines]
    return layer_of(*shapes, kind=kind, crs=crs, fields=fields, values=values)


def arc(left_m=0.0, up_m=0.0, bump_m=0.0, length_m=100.0):
    s = np.arange(0, length_m + 0.25, 0.5)
    r = 300.0 - left_m - np.where((s >= 40) & (s <= 60), bump_m, 0.0)
    return np.column_stack([r * np.sin(s / 300), 300 - r * np.cos(s / 300), np.full(len(s), up_m)])


RAIL_FIELDS = "&field=rail_id:integer&field=sigma_mm:double&field=sigmaz_mm:double"


def rails(left_m=0.0, numbers=(4, 5), sigma_mm=1.0, **changed):
    lines = [arc(left_m + SPACING_M / 2, **changed), arc(left_m - SPACING_M / 2, **changed)]
    return layer(lines, RAIL_FIELDS, [(number, sigma_mm, sigma_mm) for number in numbers])


@pytest.fixture
def compare(run_table):
    """Compare, and return results, values by field, and what was said."""

    def run(reference, lines, **parameters):
        results, _, values, feedback = run_table("comparetracks", REFERENCE=reference, INPUT=lines, **parameters)
        return results, {name: np.array(column, dtype=object) for name, column in values.items()}, feedback

    return run


def test_rails_of_two_surveys(compare, tmp_path):
    page = tmp_path / "report.html"
    results, values, feedback = compare(rails(), rails(numbers=(8, 9), bump_m=0.012), REPORT=page)
    assert " ".join(values) == NAMES
    assert set(zip(values["line_id"], values["input_id"])) == {(4, 8), (5, 9)}
    chainage = values["chainage_m"].astype(float)
    bump = (chainage > 42) & (chainage < 58)
    np.testing.assert_allclose(values["across_mm"][bump].astype(float), 12.0, atol=0.2)
    np.testing.assert_allclose(values["sigma_mm"].astype(float), 1.41)
    np.testing.assert_allclose(values["gauge_mm"][bump].astype(float), 0.0, atol=0.2)
    assert set(values["moved"][bump]) == {1}
    assert results["MOVED_LENGTH"] == pytest.approx(2 * 20, abs=3)
    assert results["COMPARED_LENGTH"] == pytest.approx(200, abs=1)
    assert (results["MISSING_LENGTH"], results["EXTRA_LENGTH"]) == (0, 0)
    html = page.read_text(encoding="utf-8")
    assert "have moved by more than 3 standard errors" in html
    assert html.count("<svg") == 2 + 2  # two distributions, and two lines
    assert feedback.warnings == []


def test_centerlines_with_their_rails(compare):
    _, values, _ = compare(
        layer([arc()], "&field=track_id:integer", [(1,)]),
        layer([arc(0.002, 0.003)], "&field=track_id:integer", [(1,)]),
        REFERENCE_RAILS=rails(),
        RAILS=layer([arc(SPACING_M / 2 + 0.004, 0.006), arc(-SPACING_M / 2)], RAIL_FIELDS, [(1, 2, 2), (2, 2, 2)]),
    )
    np.testing.assert_allclose(values["gauge_mm"].astype(float), 4.0, atol=0.1)
    np.testing.assert_allclose(values["cant_mm"].astype(float), 6.0, atol=0.1)
    np.testing.assert_allclose(values["sigma_mm"].astype(float), np.hypot(1, 2) / np.sqrt(2), atol=0.006)
